"""Whether the parts of a body map lie and point where a human's do: left on the left, up at the top, fingers outwards.

A human at rest is the measure, so every row of the table of body parts is looked at alike. Only gross errors count: a
robot's shoulders may sit where they like.

Legend: B random poses, D directions, E limbs that hang on one part.
"""

from __future__ import annotations

import itertools
import math
import warnings
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from mrhubo.errors import InputWarning, UserError
from mrhubo.robot.discovery.names import sides
from mrhubo.robot.keypoints import Axis, Limb
from mrhubo.robot.suggestions import exchanged

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_ODD_LINE, _WRONG_LINE = 45.0, 85.0
"""Degrees between the line through two shoulders (or hips) and a human's; 0 to 28 on right maps, 90 to 180 on wrong."""
_ODD_MIDDLE = 60.0
"""Degrees between where these lie and where a human's do; 0 to 35 on right maps."""
_ASIDE = 0.3
"""How far on the wrong side a single shoulder may lie, as a share of the upper arm."""


def check_placement(body_map: BodyMap, q_BN: Tensor) -> None:
    """Refuses and warns.

    Args:
        body_map: the body map.
        q_BN: random joint angles (B, N) [rad].

    Raises:
        UserError: limbs are on the wrong sides of what they hang on.
    """
    limbs = [direction for direction in body_map.directions if isinstance(direction, Limb)]
    for name in body_map.shared.views:
        hanging = [limb for limb in limbs if limb.part.hangs_on == limb.part.seen_from == name]
        if not (hanging and _Starts(body_map, name, hanging, q_BN).check()):
            _check_facing(body_map, name)
    _check_axes(body_map, q_BN)


def _check_facing(body_map: BodyMap, name: str) -> None:
    """Warns of a part from which others are seen that looks elsewhere than the robot does."""
    end, yardstick = body_map.keypoints.ends[name], body_map.yardstick
    turned = yardstick.turned(end, name)
    if turned is not None and turned > _ODD_MIDDLE:
        sides = f"; left and right then: {exchanged(body_map.keypoints)}" if turned > 180 - _ODD_MIDDLE else ""
        warn(
            f"robot.keypoints.{name}: its forward and up are turned by {turned:.0f} degrees from where the robot "
            f"faces, as {yardstick.facing_cue} tell; write {yardstick.entry(name)}{sides}"
        )


def warn(sentence: str) -> None:
    """Tells of what may be a mistake."""
    warnings.warn(sentence, InputWarning, stacklevel=2)


class _Starts:
    """Where the limbs start that hang on one part, on the robot and on a human."""

    def __init__(self, body_map: BodyMap, name: str, limbs: list[Limb], q_BN: Tensor) -> None:
        self.name, self.limbs, self.end = name, limbs, body_map.keypoints.ends[name]
        self._body_map = body_map
        poses = body_map.robot.forward(q_BN)
        shared = body_map.shared
        view = shared.view_robot(poses)
        axes_B33 = view.views[shared.views.index(name)]
        every = [direction.name for direction in body_map.directions if isinstance(direction, Limb)]
        rows = [every.index(limb.name) for limb in limbs]
        origin_B3 = poses.position_BL3[:, body_map.robot.link_index(self.end.link)]
        self.start_E3 = (view.start_BE3[:, rows] @ axes_B33).mean(0)
        """From the robot's root."""
        self.local_E3 = ((view.start_BE3[:, rows] - origin_B3[:, None]) @ axes_B33).mean(0)
        """From the link's origin; both in human axes of the part."""
        part = next(part for part in body_map.keypoints.parts if part.name == name)
        rest = body_map.skeleton.rest_points
        self.human_E3 = torch.stack([rest[limb.part.start] - rest[part.joint] for limb in limbs])
        self.length = float((view.end_BE3 - view.start_BE3)[:, rows].norm(dim=-1).mean())

    def check(self) -> bool:
        """Looks at every two limbs, or at the only one; whether it has warned."""
        if len(self.limbs) == 1:
            return self._check_one()
        pairs = itertools.combinations(enumerate(self.limbs), 2)
        return any([self._check_two(i, j, one, other) for (i, one), (j, other) in pairs])

    def _check_one(self) -> bool:
        human, robot = float(self.human_E3[0, 0]), float(self.local_E3[0, 0])
        if robot * math.copysign(1.0, human) < -_ASIDE * self.length:
            side, wrong = ("left", "right") if human > 0 else ("right", "left")
            start = self.limbs[0].part.start
            warn(
                f"robot.keypoints.{start}: lies on the {wrong} of '{self.name}' ('{self.end.link}'), a human's on the "
                f"{side}; {self._advice()}"
            )
            return True
        return False

    def _check_two(self, i: int, j: int, one: Limb, other: Limb) -> bool:
        line_3 = self.start_E3[i] - self.start_E3[j]
        off = _degrees(line_3, self.human_E3[i] - self.human_E3[j])
        if off > _ODD_LINE:
            line = f"the line from '{other.part.start}' to '{one.part.start}'"
            sentence = (
                f"robot.keypoints.{self.name}: {line} points {off:.0f} degrees away from a human's, seen from "
                f"'{self.end.link}'; {self._remedies(one, other, off)}"
            )
            if off > _WRONG_LINE:
                raise UserError(sentence)
            warn(sentence)
            return True
        middle_3 = (self.human_E3[i] + self.human_E3[j]) / 2
        seen = [(offset_E3[i] + offset_E3[j]) / 2 for offset_E3 in (self.start_E3, self.local_E3)]
        angles = [_degrees(robot_3, middle_3) for robot_3 in seen if robot_3.norm() >= line_3.norm() / 2]
        turned = self._body_map.yardstick.turned(self.end, self.name)
        if angles and min(angles) > _ODD_MIDDLE and (turned is None or turned > _ODD_LINE):
            warn(
                f"robot.keypoints.{self.name}: '{one.part.start}' and '{other.part.start}' lie {min(angles):.0f} "
                f"degrees from where they lie on a human, seen from '{self.end.link}'; {self._advice()}"
            )
            return True
        return False

    def _remedies(self, one: Limb, other: Limb, off: float) -> str:
        """What to write: what is known of the robot's facing tells whether the sides or the frame are wrong, else names
        tell which is likelier. Sides that are exchanged turn the line right round.
        """
        left, right = (one, other) if self.human_E3[self.limbs.index(one), 0] > 0 else (other, one)
        ends = [(limb.start.link, limb.end.link) for limb in (left, right)]
        turned = self._body_map.yardstick.turned(self.end, self.name)
        frame = f"the {self.name} does not look forward and up: {self._entry()}"
        exchange = f"left and right are exchanged: write {exchanged(self._body_map.keypoints)}"
        if turned is not None and turned <= _ODD_LINE < 180 - off:
            starts = self._body_map.yardstick.advice(one.part.start, other.part.start, after=" ")
            return f"are these points where the limbs start?{starts}"
        if turned is not None:
            return frame if turned > _ODD_LINE else exchange
        return f"{exchange}; or {frame}" if sides(zip(*ends, strict=True)) < 0 else f"{frame}; or {exchange}"

    def _advice(self) -> str:
        return f"does the {self.name} look forward and up? {self._entry()}"

    def _entry(self) -> str:
        entry = self._body_map.yardstick.entry(self.name)
        return f"write {entry or f'{self.name}: {{link: {self.end.link}, forward: [x, y, z], up: [x, y, z]}}'}"


def _check_axes(body_map: BodyMap, q_BN: Tensor) -> None:
    """Warns of an axis of a hand or head that points the other way than a human's, at rest and on the whole."""
    robot = body_map.robot
    random_BD3, home_BD3 = (body_map.robot_directions(robot.forward(q)) for q in (q_BN, robot.home()[None]))
    column = {name: i for i, name in enumerate(body_map.direction_names)}
    rest = body_map.skeleton.rest_points
    limbs = {direction.part.name: direction for direction in body_map.directions if isinstance(direction, Limb)}
    for axis in (direction for direction in body_map.directions if isinstance(direction, Axis)):
        rest_3, carrier = torch.tensor(axis.rest), limbs.get(axis.part.hangs_on or "")
        if carrier is None:
            against_3, seen, human = rest_3, axis.part.seen_from, 1.0
            found = [(direction_BD3[:, column[axis.name]] @ against_3) for direction_BD3 in (random_BD3, home_BD3)]
        else:
            seen, i, j = f"{carrier.part.start} and {carrier.part.end}", column[axis.name], column[carrier.name]
            bone_3 = rest[carrier.part.end] - rest[carrier.part.start]
            human = float(rest_3 @ torch.nn.functional.normalize(bone_3, dim=0))
            found = [(direction_BD3[:, i] * direction_BD3[:, j]).sum(-1) for direction_BD3 in (random_BD3, home_BD3)]
        if all(abs(float(cosine_B.mean()) - human) > 1.0 for cosine_B in found):
            word = axis.part.words[axis.part.direction_names.index(axis.name)]
            warn(
                f"robot.keypoints.{axis.part.name}: '{word}' points the other way than a human's, seen from {seen}; is "
                f"it right in the frame of the link '{axis.link}'?"
            )


def _degrees(a_3: Tensor, b_3: Tensor) -> float:
    return math.degrees(float(torch.atan2(torch.linalg.cross(a_3, b_3).norm(), a_3 @ b_3)))
