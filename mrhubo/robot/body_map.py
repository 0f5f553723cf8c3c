"""What a robot shares with a human body: directions of body parts, and keypoints of a human made from them.

Legend: B batch, D directions, K keypoints, N robot joints.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from functools import cached_property

from torch import Tensor, nn

from mrhubo.body.skeleton import Skeleton
from mrhubo.config import RobotConfig, with_places
from mrhubo.errors import UserError
from mrhubo.robot.auto_scale import AutoScale
from mrhubo.robot.bending import BendAxis
from mrhubo.robot.checks import check_body_map, check_key_links
from mrhubo.robot.collision import SelfCollision
from mrhubo.robot.directions import Directions
from mrhubo.robot.entries import check_names
from mrhubo.robot.keypoints import Axis, Keypoints, Limb, read_keypoints
from mrhubo.robot.manual_scale import ManualScale, check_ranges
from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.told_joints import tell_of_waist, waist_joints
from mrhubo.robot.urdf import describe
from mrhubo.robot.yardstick import Yardstick


class BodyMap(nn.Module):
    """A robot, a human skeleton, and which links stand for which body parts."""

    def __init__(
        self,
        robot: Robot,
        keypoints: Keypoints | None = None,
        skeleton: Skeleton | None = None,
        manual: ManualScale | None = None,
    ) -> None:
        """Puts them together, unchecked; `BodyMap.of` also looks whether they make sense.

        Args:
            robot: computes the poses of all links of `keypoints` and of `manual`.
            keypoints: the robot's body parts; default: those that the robot knows.
            skeleton: the human's; default: the open one.
            manual: the numbers of `scale: manual`; None: lengths are matched by `scale: auto`.

        Raises:
            UserError: no body parts are given, and the robot knows none.
        """
        super().__init__()
        keypoints = keypoints or robot.keypoints
        if keypoints is None:
            raise UserError(
                f"{robot.urdf}: nothing tells which link of '{robot.name}' stands for which body part; make the robot "
                "with Robot.from_urdf(..., keypoints=...) or Robot.from_config(...)"
            )
        self.robot, self.keypoints, self.skeleton = robot, keypoints, skeleton or Skeleton()
        self.shared = Directions(robot, keypoints, self.skeleton)
        self.auto = AutoScale(self.shared)
        if manual is not None:
            manual.prepare(robot)
        self.scale: AutoScale | ManualScale = manual or self.auto
        self._collision: SelfCollision | None = None

    @classmethod
    def of(
        cls,
        robot: Robot,
        keypoints: Keypoints | None = None,
        skeleton: Skeleton | None = None,
        manual: ManualScale | None = None,
    ) -> BodyMap:
        """A body map that has been checked, without joints that carry all that is seen and so are told by nothing: they
        are held. Arguments as for the class.

        Raises:
            UserError: the map cannot be right (`mrhubo.robot.checks`); names what is wrong.
        """
        body_map = cls(robot, keypoints, skeleton, manual)
        waist = waist_joints(body_map)
        if waist and len(waist) < len(robot.joint_names):
            tell_of_waist(body_map, waist)
            body_map = cls(robot.without(waist), body_map.keypoints, body_map.skeleton, manual)
        check_body_map(body_map)
        return body_map

    @property
    def directions(self) -> tuple[Limb | Axis | BendAxis, ...]:
        """The directions that robot and human share."""
        return self.shared.all

    @property
    def direction_names(self) -> tuple[str, ...]:
        """Names of the directions, in the order of the table of body parts."""
        return self.shared.names

    @property
    def measured(self) -> list[int]:
        """Which of the directions a robot's answer is measured by: all but bend axes."""
        return self.shared.measured_columns

    @property
    def measured_names(self) -> tuple[str, ...]:
        """Their names, in order: those of the columns of `RetargetResult.direction_error_deg`."""
        return tuple(self.direction_names[i] for i in self.measured)

    @property
    def keypoint_names(self) -> tuple[str, ...]:
        """Names of the target keypoints."""
        return self.scale.keypoint_names

    @property
    def keypoint_indices(self) -> list[int]:
        """Their positions in the skeleton's keypoints."""
        return self.scale.keypoint_indices

    @property
    def collision(self) -> SelfCollision:
        """The robot's collision shapes; read when first asked for."""
        if self._collision is None:
            self._collision = SelfCollision(self.robot)
        return self._collision

    @cached_property
    def yardstick(self) -> Yardstick:
        """What the robot's own axes tell of its body; looked for when first asked for."""
        return Yardstick(self.robot)

    @cached_property
    def geometric(self) -> BodyMap | None:
        """The same with limbs from one joint's centre to the next, as the robot's axes tell them (`yardstick`): what a
        limb is measured by, so that a point beside a joint shows. None where the axes tell no centre.
        """
        points = dict(self.keypoints.points)
        points |= {n: c for n, p in points.items() if (c := self.yardstick.centre(n, p.link)) is not None}
        if points == self.keypoints.points:
            return None if self.yardstick.found is None else self
        keypoints = dataclasses.replace(self.keypoints, points=points)
        return BodyMap(self.robot.with_links(keypoints.links), keypoints, self.skeleton)

    def robot_directions(self, poses: LinkPoses) -> Tensor:
        """Unit directions (B, D, 3) of the robot, in human axes of the parts from which they are seen."""
        return self.shared.view_robot(poses).direction_BD3

    def human_directions(self, local_BJ33: Tensor) -> Tensor:
        """Directions (B, D, 3) of human poses, local rotations (B, 21, 3, 3), in human axes of the parts from which
        they are seen. Their length is how much they count: 1, but for bend axes, which count 0 to 1.
        """
        return self.shared.of_human(local_BJ33)

    def input_joints(self, directions: Iterable[int] | None = None) -> tuple[str, ...]:
        """The human joints that tell about the robot's parts, or about some directions alone: what a pose needs to
        tell the network.
        """
        return self.shared.input_joints(directions)

    def targets(self, poses: LinkPoses) -> Tensor:
        """P: target keypoints (B, K, 3) [m], human frame, of robot poses."""
        return self.scale.targets(poses)

    def upright_keypoints(self, poses: LinkPoses) -> Tensor:
        """`human_keypoints` (B, K, 3) [m] of robot poses."""
        return self.auto.targets(poses)

    def human_keypoints(self, direction_BD3: Tensor) -> Tensor:
        """Keypoints (B, K, 3) [m] of an upright human whose parts have these directions (`scale: auto`)."""
        return self.auto.keypoints(direction_BD3)


@with_places
def build_body_map(config: RobotConfig, skeleton: Skeleton | None = None) -> BodyMap:
    """Robot and body map of a config's `robot` section, checked; `skeleton` is the human's, by default the open one.

    Raises:
        UserError: the URDF, a joint, a link or a keypoint entry is wrong; says which, and the nearest valid name.
            Or the body map as a whole cannot be right.
    """
    keypoints = dataclasses.replace(read_keypoints(config.keypoints), root_follows=config.root_follows)
    if config.scale != "auto" and config.manual is None:
        raise UserError(f"robot.manual: is missing; `scale: {config.scale}` needs its numbers")
    if config.scale == "search" and config.search is None:
        raise UserError("robot.search: is missing; `scale: search` needs the ranges of what varies")
    manual = ManualScale(config.manual) if config.scale != "auto" and config.manual else None
    if config.scale == "search" and config.search and config.manual:
        check_ranges(config.manual, config.search.ranges)
    if not config.key_links:
        raise UserError("robot.key_links: is empty; name the links whose error is measured")
    links = [*keypoints.links, *config.key_links, *(manual.links if manual else [])]
    description = describe(config.urdf)
    check_names(config, description)
    robot = Robot(description, config.joints, links, config.ranges, config.hold, config.name, config.max_speed)
    robot.balance = config.balance
    body_map = BodyMap.of(robot, keypoints, skeleton, manual)
    check_key_links(robot, config.key_links)
    return body_map
