"""Feet that stand are level: finds, and takes out, a constant turn of the ankles.

The skeletons of the CMU Graphics Lab Motion Capture Database roll a foot that stands flat by 5 to 27 degrees, always to
the same side and each performer's by an angle of its own, and a conversion that keeps the skeleton's frames keeps that.
Where the floor is need not be known: a foot that does not turn, and whose ankle is not above the other, is taken for
one that stands, as most of those do.

Legend: T frames, J = 21 posed joints, X frames in which a foot stands; feet are (left, right).
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.body.joints import OFFSETS_J3, POSED_JOINT_NAMES, SIDES
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import matrix_to_axis_angle, shortest_turn

Feet = tuple[np.ndarray, np.ndarray]
"""Of the left foot, and of the right one."""
_UP, _MIRROR = np.array([0, 1, 0], np.float32), np.array([-1, 1, 1], np.float32)
"""In single precision, so that whatever they are put together with keeps its own."""
_TURNING = math.radians(1.5)
"""How far [rad] a foot that stands may turn from one frame to the next, at some 12 to 30 frames a second: at more, feet
that swing would pass for standing."""
_ABOVE = 0.02
"""How far [m] its ankle may be above the other one."""
_NEAR = math.radians(5.0)
"""Frames count by how near they are to the middle: a quarter at this angle, a hundredth at three times it."""
_ROUNDS = 20
_OWN = math.radians(15.0)
"""How far a performer's feet may be from what is usual: further off are handstands and rolls."""
_ENOUGH = 200
"""Frames in which they must stand, to have an angle of their own."""
_SOME = 20
"""Frames in which both feet of a single motion must stand, to be told rolled."""
_ROLLED, _MOST = math.radians(6.0), math.radians(30.0)
"""From where on they are, and up to where: the data's performers have 5 to 27 degrees."""
_LEANING = math.radians(6.0)
"""How far heel and toe of such feet may be from level, which no skeleton turns."""
_ALIKE = math.radians(6.0)
"""How far each of them may be from the mirror image of the other, half-way."""


def standing_up(root_T33: np.ndarray, local_TJ33: np.ndarray, below: float = 0.0) -> Feet:
    """The world's up in the frame of each foot, in those frames (X, 3) of a clip in which it stands.

    Args:
        root_T33: rotations (T, 3, 3) of the pelvis in the world, y up.
        local_TJ33: local rotations (T, 21, 3, 3).
        below: how far [m] the foot's ankle must be under the pelvis.
    """
    height, turned = [], []
    for side in SIDES:
        foot_T33, place_T3 = root_T33, np.zeros(3)
        for name in ("hip", "knee", "ankle"):
            joint = POSED_JOINT_NAMES.index(f"{side}_{name}")
            place_T3 = place_T3 + foot_T33 @ OFFSETS_J3[joint]
            foot_T33 = foot_T33 @ local_TJ33[:, joint]
        height.append(place_T3[:, 1])
        turned.append(foot_T33)
    found = []
    for foot_T33, height_T, other_T in zip(turned, height, height[::-1], strict=True):
        still_T = np.zeros(len(foot_T33), bool)
        if len(foot_T33) > 2:
            turn_T33 = np.swapaxes(foot_T33[:-2], -1, -2) @ foot_T33[2:]
            still_T[1:-1] = norm(matrix_to_axis_angle(turn_T33)) < 2 * _TURNING
        found.append(foot_T33[still_T & (height_T - other_T < _ABOVE) & (height_T < -below), 1])
    return found[0], found[1]


def usual_up(feet: list[Feet]) -> np.ndarray:
    """What is up (3,) for most left feet, and, mirrored, for most right ones; the feet's own y where none stands."""
    up_X3 = np.concatenate([up_X3 for left, right in feet for up_X3 in (left, right * _MIRROR)])
    return middle(up_X3) if len(up_X3) else _UP


def own_up(feet: Feet, usual_3: np.ndarray) -> Feet:
    """What is up (3,) for each of a performer's feet: by its own frames (X, 3) where they are enough, and near what is
    usual for a left foot; else what is usual.
    """
    found = []
    for up_X3, usual in zip(feet, (usual_3, usual_3 * _MIRROR), strict=True):
        up_3 = middle(up_X3) if len(up_X3) >= _ENOUGH else usual
        found.append(up_3 if up_3 @ usual > math.cos(_OWN) else usual)
    return found[0], found[1]


def rolled_up(feet: Feet) -> Feet | None:
    """What is up (3,) for each foot of a motion whose feet stand rolled to opposite sides; None where they stand level,
    one like the other, or too seldom to tell.
    """
    if min(map(len, feet)) < _SOME:
        return None
    left_3, right_3 = (middle(up_X3) for up_X3 in feet)
    usual_3 = normalize(left_3 + right_3 * _MIRROR)
    rolled = math.sin(_ROLLED) < -usual_3[0] < math.sin(_MOST) and abs(usual_3[2]) < math.sin(_LEANING)
    alike = left_3 @ usual_3 > math.cos(_ALIKE)
    return (left_3, right_3) if rolled and alike else None


def turn_feet(local_TJ33: np.ndarray, up: Feet) -> np.ndarray:
    """Local rotations (T, 21, 3, 3) whose ankles are turned by the least that makes y what is up (3,) for each foot."""
    found = local_TJ33.copy()
    for side, up_3 in zip(SIDES, up, strict=True):
        ankle = POSED_JOINT_NAMES.index(f"{side}_ankle")
        found[:, ankle] = local_TJ33[:, ankle] @ shortest_turn(_UP, up_3)
    return found


def middle(up_X3: np.ndarray) -> np.ndarray:
    """A unit vector (3,) in the midst of most unit vectors (X, 3), whatever the others are: a mean whose weights fall
    with the fourth power of the angle to it.
    """
    middle_3 = normalize(np.median(up_X3, axis=0))
    for _ in range(_ROUNDS):
        angle_X = np.arccos(np.clip(up_X3 @ middle_3, -1.0, 1.0))
        weight_X1 = (1 + (angle_X / _NEAR) ** 2)[:, None] ** -2
        middle_3 = normalize((weight_X1 * up_X3).sum(axis=0))
    return middle_3
