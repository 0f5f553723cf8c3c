"""A robot that performs a motion: its bodies, where they are in every frame, limits of its joints.

Legend: T frames, N joints of the motion, B bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.errors import UserError, encodable
from mrhubo.robot import Robot
from mrhubo.robot_motion import RobotMotion
from mrhubo.viewer.bodies import Body, dress, link_places, read_bodies
from mrhubo.viewer.poses import from_wxyz, poses
from mrhubo.viewer.skin import human_skins

_SHORTEST_M = 1e-3
"""A robot without any height is not made larger."""


@dataclass(frozen=True)
class Performance:
    """A robot's motion, at the size in which it is shown."""

    label: str
    """What stands above its head."""
    robot: Robot
    motion: RobotMotion
    """With one leading axis."""
    frame_rate: float
    scale: float
    """How many times larger than it is it is shown."""
    bodies: tuple[Body, ...]
    """At that size."""
    local_BT44: np.ndarray
    """Pose of each body in the frame of the one that it hangs on; of the first, in that of the base."""
    base_T44: np.ndarray | None
    """Pose of the base on the floor, at that size; None where it is fixed."""
    lower_N: np.ndarray
    """Lower limits of the motion's joints [rad]; -inf where there is none."""
    upper_N: np.ndarray

    def __len__(self) -> int:
        return len(self.motion)

    def links(self) -> tuple[list[str], np.ndarray]:
        """Names of all links and their poses (T, L, 4, 4) in the frame of the base, at the size that is shown."""
        return link_places(self.bodies, self.motion.q)

    def body_poses(self, frames: np.ndarray) -> np.ndarray:
        """Poses (B, T, 4, 4) of all bodies in the frame of the base, in some frames."""
        found: list[np.ndarray] = []
        for body, local_T44 in zip(self.bodies, self.local_BT44[:, frames], strict=True):
            found.append(local_T44 if body.parent is None else found[body.parent] @ local_T44)
        return np.stack(found)


def perform(
    label: str, robot: Robot, motion: RobotMotion, frame_rate: float | None = None, true_size: bool = False
) -> Performance:
    """A robot and a motion of it.

    Args:
        label: what stands above its head.
        robot: whose links and limits these are.
        motion: its joints are joints of the robot's URDF.
        frame_rate: frames per second, where the motion does not tell them.
        true_size: whether it is as large as it is, and not as tall as the human.

    Raises:
        UserError: there is no such joint, no frame, or nobody tells the frame rate.
    """
    motion, label = motion.single(), encodable(label)
    rate = motion.frame_rate or frame_rate
    if not len(motion):
        raise UserError(f"{label}: the robot's motion has no frames, so there is nothing to show")
    if rate is None:
        raise UserError(f"{label}: the robot's motion does not tell its frame rate; give --rate")
    bodies = read_bodies(robot, motion.joint_names)
    dress(bodies, robot)
    scale = 1.0 if true_size else _height_of_human() / max(_height(bodies, robot, motion), _SHORTEST_M)
    bodies = [_scaled(body, scale) for body in bodies]
    local_BT44 = np.stack([body.local_poses(motion.q) for body in bodies])
    base_T44 = None
    if motion.root_position is not None and motion.root_quaternion_wxyz is not None:
        base_T44 = poses(scale * motion.root_position.astype(float), from_wxyz(motion.root_quaternion_wxyz))
    limits = np.array([_limits(robot, name) for name in motion.joint_names]).T
    return Performance(label, robot, motion, rate, scale, tuple(bodies), local_BT44, base_T44, *limits)


def _limits(robot: Robot, joint: str) -> tuple[float, float]:
    if joint in robot.joint_names:
        column = robot.joint_names.index(joint)
        return float(robot.lower_N[column]), float(robot.upper_N[column])
    known = robot.description.joint(joint)
    return -np.inf if known.lower is None else known.lower, np.inf if known.upper is None else known.upper


def _height(bodies: list[Body], robot: Robot, motion: RobotMotion) -> float:
    """Of the robot with all joints at 0, or at the limit nearest to it."""
    limits = np.array([_limits(robot, name) for name in motion.joint_names]).T
    home_1N = np.clip(np.zeros((1, len(motion.joint_names))), *limits)
    found: list[np.ndarray] = []
    for body in bodies:
        local_44 = body.local_poses(home_1N)[0]
        found.append(local_44 if body.parent is None else found[body.parent] @ local_44)
    heights = [
        mesh.vertices_V3 @ pose_44[2, :3] + pose_44[2, 3]
        for body, pose_44 in zip(bodies, found, strict=True)
        for mesh in body.meshes
    ]
    return float(np.ptp(np.concatenate(heights))) if heights else 0.0


def _height_of_human() -> float:
    return float(np.ptp(np.concatenate([skin.mesh.vertices_V3[:, 2] for skin in human_skins()])))


def _scaled(body: Body, factor: float) -> Body:
    def larger(pose_44: np.ndarray) -> np.ndarray:
        return np.concatenate([pose_44[:, :3], np.append(factor * pose_44[:3, 3], 1.0)[:, None]], axis=1)

    if factor == 1.0:
        return body
    stretch = factor if body.slides else 1.0
    return Body(
        body.name, body.parent, larger(body.origin_44), body.axis_3, body.slides, body.column,
        stretch * body.multiplier, stretch * body.offset, {link: larger(pose) for link, pose in body.links.items()},
        [mesh.scaled(factor) for mesh in body.meshes],
    )  # fmt: skip
