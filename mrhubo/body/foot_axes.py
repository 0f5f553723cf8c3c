"""How a foot is rolled about itself: SMPL's way, in which a sole that stands is level, and that of other skeletons.

Converted skeletons may have a constant between a foot's own axes and SMPL's: its sole is then rolled by the same angle
wherever it stands, inwards or outwards, by 2 to 28 degrees in conversions of the CMU Graphics Lab Motion Capture
Database. The constant is found in the frames in which the foot stands, and taken out. Shin and foot keep their
directions: the foot is turned about its own bone, from the ankle to the ball.

Legend: T frames, X of them in which a foot stands, J = 21 posed joints. World: y up [m].
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.body.joints import OFFSETS_J3, POSED_JOINT_NAMES, SIDES, ancestors, joint_index
from mrhubo.fast.plain.human import cross, norm, normalize
from mrhubo.fast.rotations import axis_angle_to_matrix

_LOW_M = 0.04
"""A foot that stands is at most so much higher than the lower of both mostly is where it is lowest: one that hangs
beside the shin of the other leg is still, and does not stand."""
_LOWEST = 0.05
"""Share of the frames that tells how low that is."""
_STILL = 0.15
"""Ankle and ball of a foot that stands are slower [m/s]: a heel that lifts or a foot that rolls off is not."""
_FLAT = math.radians(20.0)
"""How far the foot's bone may slope otherwise than at rest, where heel and ball are on the floor."""
_ENOUGH_S = 0.5
"""How long a foot must stand, all in all."""
_STRAY = 0.3
"""Half of the frames may be off the median by this share of it: else no constant rolls the foot, but the person."""
_MOST = math.radians(40.0)
"""No skeleton's foot is rolled by more: an ankle cannot, and who lies does not stand."""


def sole_rolls(
    local_TJ33: np.ndarray, root_rotation_T33: np.ndarray, root_position_T3: np.ndarray, frame_rate: float
) -> dict[str, np.ndarray]:
    """How each side's sole is rolled (X,) [rad] about the foot's bone, in the frames in which it stands.

    0 is level; positive where the side that is to the person's left is higher.

    Args:
        local_TJ33: local rotations (T, 21, 3, 3).
        root_rotation_T33: of the pelvis in the world (T, 3, 3).
        root_position_T3: of the pelvis in the world (T, 3) [m], as far as a constant.
        frame_rate: frames per second.
    """
    if len(local_TJ33) < 2:
        return {side: np.zeros(0) for side in SIDES}
    feet = {side: _foot(local_TJ33, root_rotation_T33, root_position_T3, side) for side in SIDES}
    floor = min(float(np.quantile(ball_T3[:, 1], _LOWEST)) for _, _, ball_T3 in feet.values())
    found = {}
    for side, (rotation_T33, ankle_T3, ball_T3) in feet.items():
        bone_3 = _bone(side)
        lateral_3 = normalize(cross(np.array([0.0, 1.0, 0.0]), bone_3))
        up_T3 = rotation_T33[:, 1]  # the vertical in the foot's own axes; what of it is across the bone tells the roll
        slope_T = np.arcsin(np.clip(up_T3 @ bone_3, -1.0, 1.0)) - math.asin(float(bone_3[1]))
        stands_T = (ball_T3[:, 1] < floor + _LOW_M) & (np.abs(slope_T) < _FLAT)
        for place_T3 in (ankle_T3, ball_T3):
            stands_T &= norm(np.gradient(place_T3, 1 / frame_rate, axis=0)) < _STILL
        found[side] = np.arctan2(up_T3 @ lateral_3, up_T3 @ cross(bone_3, lateral_3))[stands_T]
    return found


def foot_rolls(
    local_TJ33: np.ndarray, root_rotation_T33: np.ndarray, root_position_T3: np.ndarray, frame_rate: float
) -> dict[str, float]:
    """The constant [rad] by which each side's sole is rolled where it stands; arguments as for `sole_rolls`.

    Sides are left out whose foot hardly stands, or is rolled now so, now otherwise, as a person's is.
    """
    found = {}
    for side, roll_X in sole_rolls(local_TJ33, root_rotation_T33, root_position_T3, frame_rate).items():
        if len(roll_X) < max(2.0, _ENOUGH_S * frame_rate):
            continue
        median = float(np.median(roll_X))
        if abs(median) < _MOST and float(np.median(np.abs(roll_X - median))) <= _STRAY * abs(median):
            found[side] = median
    return found


def level_feet(local_TJ33: np.ndarray, rolls: dict[str, float]) -> np.ndarray:
    """Local rotations (T, 21, 3, 3) whose feet are turned back about their bones by the sides' `rolls` [rad]; all
    limbs keep their directions, feet too.
    """
    found = local_TJ33.copy()
    for side, roll in rolls.items():
        ankle = POSED_JOINT_NAMES.index(f"{side}_ankle")
        found[:, ankle] = local_TJ33[:, ankle] @ axis_angle_to_matrix((-roll * _bone(side)).astype(local_TJ33.dtype))
    return found


def _bone(side: str) -> np.ndarray:
    """Where a foot's bone points at rest (3,)."""
    return normalize(_offset(joint_index(f"{side}_foot")))


def _offset(joint: int) -> np.ndarray:
    """Where a joint is from its parent at rest (3,) [m]."""
    return OFFSETS_J3[joint - 1].astype(np.float64)


def _foot(
    local_TJ33: np.ndarray, rotation_T33: np.ndarray, place_T3: np.ndarray, side: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A foot's rotation (T, 3, 3), and the places of ankle and ball (T, 3), in the world."""
    ball = joint_index(f"{side}_foot")
    *_, pelvis = chain = ancestors(ball)[1:]
    for joint in reversed(chain):
        if joint != pelvis:
            place_T3 = place_T3 + rotation_T33 @ _offset(joint)
            rotation_T33 = rotation_T33 @ local_TJ33[:, joint - 1]
    return rotation_T33, place_T3, place_T3 + rotation_T33 @ _offset(ball)


def rolls_in_words(rolls: dict[str, float]) -> str:
    """A sentence for a motion's notes."""
    told = " and ".join(f"the {side} by {math.degrees(roll):.0f}" for side, roll in rolls.items())
    return f"soles are rolled where they stand, {told} degrees: levelled, which SMPL's are"
