"""Where the soles of a robot are at joint angles, and what else of it could be in the floor.

Legend: B joint angles, N joints, H points of soles, R feet, J balls of soles and of the rest of the body.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mrhubo.fast.leg_section import Legs
from mrhubo.fast.plain.robot import place
from mrhubo.fast.plain.soles import carrier, turned_points
from mrhubo.fast.sections import Kinematics

_OF_JOINTS = ("parent_A", "origin_A34", "axis_A3", "rotary_A", "column_A", "ratio_A", "offset_A")
_OF_DIRECTIONS = (
    "limb_D", "start_body_D", "start_D3", "end_body_D", "end_D3", "view_body_V", "view_V33", "direction_Q", "joint_Q",
    "column_Q", "factor_Q4",
)  # fmt: skip


class Soles(NamedTuple):
    """A robot's soles at some joint angles, and balls of all that touches the floor, base frame."""

    point_H3: np.ndarray
    ball_J3: np.ndarray
    turn_R33: np.ndarray
    """How the feet are turned."""


class LegKinematics:
    """What of one robot touches the floor."""

    def __init__(self, kinematics: Kinematics, legs: Legs) -> None:
        """Of the whole robot's."""
        self._kinematics, self._legs = _without_others(kinematics, legs)

    def soles(self, *q_N: np.ndarray) -> list[Soles]:
        """Soles at some joint angles each, all at once, as that takes hardly longer than one."""
        legs, placed = self._legs, place(self._kinematics, np.stack(q_N))
        point_BH3 = turned_points(placed, legs.body_H, legs.point_H3)
        ball_BJ3 = turned_points(placed, legs.ball_body_J, legs.ball_J3)
        turn_BR33 = placed.rotation_BL33[:, legs.body_H[::2]]
        return [Soles(*found) for found in zip(point_BH3, ball_BJ3, turn_BR33, strict=True)]

    def carrier(self, q_N: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Human axes (3, 3) of what carries the legs, and the middle of the joints where they start (3,) [m]."""
        axes_B33, root_B3 = carrier(self._legs, place(self._kinematics, q_N[None]))
        return axes_B33[0], root_B3[0]

    def lowest(self, soles: Soles, turn_33: np.ndarray) -> tuple[np.ndarray, float]:
        """How high [m] over the base, which is turned so in the world, the lowest ball at each point is (H,), and the
        lowest of all.
        """
        height_J = soles.ball_J3 @ turn_33[2] - self._legs.radius_J
        return np.where(self._legs.near_HJ > 0, height_J, np.inf).min(axis=1), float(height_J.min())


def _without_others(kinematics: Kinematics, legs: Legs) -> tuple[Kinematics, Legs]:
    """Both without joints that move nothing of that, and without directions, which take time."""
    wanted, parents = set(), [-1, *kinematics.parent_A.tolist()]
    for body in {int(legs.carrier_1[0]), *legs.body_H.tolist(), *legs.ball_body_J.tolist()}:
        while body > 0 and body not in wanted:
            wanted.add(body)
            body = parents[body]
    kept = sorted(wanted)
    joint_A = np.array(kept, int) - 1
    number_L = np.zeros(len(parents), int)
    number_L[kept] = np.arange(1, len(kept) + 1)
    of_joints = {name: getattr(kinematics, name)[joint_A] for name in _OF_JOINTS}
    none = {name: getattr(kinematics, name)[:0] for name in _OF_DIRECTIONS}
    trimmed = replace(kinematics, **of_joints, **none)
    trimmed = replace(trimmed, parent_A=number_L[trimmed.parent_A])
    bodies = {name: number_L[getattr(legs, name)] for name in ("carrier_1", "body_H", "ball_body_J")}
    return trimmed, replace(legs, **bodies)
