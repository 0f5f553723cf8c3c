"""How an arm is turned about itself: SMPL's way, and that of skeletons whose elbows are hinges about an oblique axis.

SMPL's elbows bend about the vertical of the T-pose, (0, -1, 0) on the left. The skeletons of the CMU Graphics Lab
Motion Capture Database bend theirs about an oblique axis of the upper arm, and a conversion that keeps the skeleton's
frames keeps that. The limbs point the same way; upper arm and forearm are turned about themselves by a constant, the
tilt, which is taken out here.

Legend: B batch, T frames, J = 21 posed joints.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.body.joints import POSED_JOINT_NAMES, SIDES, hinge_axis
from mrhubo.fast.plain.human import cross, norm, normalize
from mrhubo.fast.rotations import axis_angle_to_matrix, matrix_to_axis_angle

CMU_TILT = math.atan2(-0.491, 0.871)
"""Of the CMU recordings: their left elbow bends about (0, -0.871, 0.491)."""
_BENT = math.radians(10.0)
"""From which bend on an elbow tells its axis."""
_ENOUGH = 10
"""Frames in which it must."""
_PURE = math.radians(6.0)
"""How far a hinge's axis may stray; four degrees are left of hinges where a motion was resampled. Elbows of fitted
bodies are ball joints, and stray by tens of degrees."""
_ACROSS = math.radians(10.0)
"""How far a hinge's axis may be from a right angle with the bone."""


def untilt_arms(local_BJ33: np.ndarray, tilt: float) -> np.ndarray:
    """Local rotations (B, 21, 3, 3) with both arms turned about their bones, so that elbows that bend about an axis
    tilted by `tilt` [rad] bend about SMPL's; limbs keep their directions, and hands their orientation.
    """
    turn_33 = axis_angle_to_matrix(np.array([tilt, 0.0, 0.0], local_BJ33.dtype))
    found = local_BJ33.copy()
    for side in SIDES:  # bones lie along x, and a turn about x is its own mirror image
        shoulder, elbow, wrist = (POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("shoulder", "elbow", "wrist"))
        found[:, shoulder] = local_BJ33[:, shoulder] @ turn_33
        found[:, elbow] = turn_33.T @ local_BJ33[:, elbow] @ turn_33
        found[:, wrist] = turn_33.T @ local_BJ33[:, wrist]
    return found


def elbow_tilt(local_TJ33: np.ndarray) -> float | None:
    """By what angle [rad] about the bones the axis of both elbows is tilted from SMPL's, where the elbows of a motion
    (T, 21, 3, 3) are hinges; None where they are not, or do not bend enough to tell.
    """
    tilts = []
    for elbow in (f"{side}_elbow" for side in SIDES):
        turn_T3 = matrix_to_axis_angle(local_TJ33[:, POSED_JOINT_NAMES.index(elbow)])
        axis_X3 = normalize(turn_T3[norm(turn_T3) > _BENT])
        if len(axis_X3) < _ENOUGH:
            continue
        mean_3 = normalize(axis_X3.mean(axis=0))
        strays = norm(cross(axis_X3, np.broadcast_to(mean_3, axis_X3.shape))).max()
        if float(strays) > math.sin(_PURE) or abs(float(mean_3[0])) > math.sin(_ACROSS):
            return None
        _, y, _ = hinge_axis(elbow)
        tilts.append(math.atan2(y * float(mean_3[2]), y * float(mean_3[1])))
    if not tilts or max(tilts) - min(tilts) > _PURE:
        return None
    return sum(tilts) / len(tilts)
