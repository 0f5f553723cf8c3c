"""A robot as files of its motion tell it: limits, and the joints that a motion does not turn by itself."""

from __future__ import annotations

from collections.abc import Iterator

from scipy.spatial.transform import Rotation

from mrhubo.errors import UserError
from mrhubo.robot.joint import drive
from mrhubo.robot.model import Robot
from mrhubo.robot.standing import StandingRobot
from mrhubo.robot_motion import FollowingJoint, RobotFacts


def robot_facts(robot: Robot, made_by: str, checksum: str) -> RobotFacts:
    """The facts of a robot.

    Args:
        robot: the robot.
        made_by: who finds its joint angles.
        checksum: of that.
    """
    return RobotFacts(
        name=robot.name,
        made_by=made_by,
        checksum=checksum,
        lower=robot.lower_N.cpu().numpy(),
        upper=robot.upper_N.cpu().numpy(),
        velocity=robot.velocity_N.cpu().numpy(),
        others=tuple(_others(robot)),
        on_base=_on_base(robot),
    )


def _on_base(robot: Robot) -> dict[str, tuple[float, ...]]:
    """Links that fixed joints hang on the root link, by name, as `RobotFacts.on_base` has them."""
    description, found = robot.description, {}
    poses = StandingRobot(description, {}).poses
    for link in dict.fromkeys((description.root, *description.links)):
        if all(joint.kind == "fixed" for joint in description.joints_above(link)):
            turn_4 = Rotation.from_matrix(poses[link][:3, :3]).as_quat(canonical=True, scalar_first=True)
            found[link] = (*poses[link][:3, 3].tolist(), *turn_4.tolist())
    return found


def _others(robot: Robot) -> Iterator[FollowingJoint]:
    joints = robot.description.joints
    for name in robot.held:
        if name in robot.joint_names:
            continue
        try:
            found = drive(joints, name)
        except UserError:  # it mimics what is not there, and nothing that is needed hangs on it
            continue
        if found.joint in robot.joint_names:
            yield FollowingJoint(name, found.joint, found.multiplier, found.offset)
        else:
            held = robot.held.get(found.joint, 0.0)
            yield FollowingJoint(name, offset=found.multiplier * held + found.offset)
