"""About which axis an elbow or a knee bends, by the way of its two bones and the upper one's own turn.

Legend: T frames.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.fast.plain.human import BEND_DEG, bend_axis, cross, norm, normalize
from mrhubo.fast.rotations import axis_angle_to_matrix, shortest_turn, turned
from mrhubo.motion.gaps import Neighbours

BENT = math.radians(12.0)
"""From which bend on the plane of two limbs tells the axis of the joint between them, whatever the upper limb's own
turn (as in `mrhubo.robot.bending`)."""
BACKWARD = math.radians(30.0)
"""Knees do not bend backwards: up to this bend, what looks so is a straight leg and a noisy point."""


def hinge_axes(
    upper_T3: np.ndarray,
    lower_T3: np.ndarray,
    own_T3: np.ndarray | None,
    usual_T3: np.ndarray,
    known_T: np.ndarray,
    one_way: bool,
) -> np.ndarray:
    """The axis (T, 3) of a limb's hinge: by the plane of its bones where it is bent, else by the upper bone's own turn,
    else as when it was bent last.
    """
    cross_T3 = cross(upper_T3, lower_T3)
    bend_T = np.arctan2(norm(cross_T3), (upper_T3 * lower_T3).sum(-1))
    plane_T3 = normalize(cross_T3)
    told_T = known_T & (bend_T > BENT)
    reference_T3 = usual_T3 if own_T3 is None else own_T3
    backward_T = one_way & (bend_T < BACKWARD) & ((plane_T3 * reference_T3).sum(-1) < 0)
    told_T &= ~backward_T
    if own_T3 is None:
        own_T3 = _carried(plane_T3, upper_T3, told_T) if told_T.any() else usual_T3
    axis_T3 = np.where(backward_T[:, None], own_T3, bend_axis(upper_T3, lower_T3, own_T3, BEND_DEG)[0])
    across_T3 = axis_T3 - upper_T3 * (upper_T3 * axis_T3).sum(-1, keepdims=True)
    lost_T = norm(across_T3) < 1e-3
    return np.where(lost_T[:, None], usual_T3, normalize(across_T3))


def _carried(axis_T3: np.ndarray, upper_T3: np.ndarray, told_T: np.ndarray) -> np.ndarray:
    """Axes (T, 3) at right angles to the upper bones (T, 3), from the last frame that tells one and the next: each is
    carried along by the shortest turn of the bone, and between the two the axis turns evenly about it.
    """
    near = Neighbours.of(told_T)
    before_T3, after_T3 = (
        turned(shortest_turn(upper_T3[place_T], upper_T3), axis_T3[place_T])
        for place_T in (near.before_T, near.after_T)
    )
    sine_T = (upper_T3 * cross(before_T3, after_T3)).sum(-1)
    angle_T = np.arctan2(sine_T, (before_T3 * after_T3).sum(-1)) * near.share_T
    return turned(axis_angle_to_matrix(upper_T3 * angle_T[:, None]), before_T3)
