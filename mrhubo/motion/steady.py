"""A pelvis that does not shake: what no pelvis can do is the recording's, and a robot's base would do it.

Markers change places for a frame, and estimators of pose doubt for a few: the pelvis then turns by 10 or 30 degrees and
back within a thirtieth of a second, while the limbs, which other markers tell, stay where they are. A robot's base is
turned as the pelvis is. So its rotation is smoothed over time, robustly: frames that differ much from their neighbours
have no say.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from mrhubo.body.joints import PARENTS
from mrhubo.motion.motion import Motion

CUTOFF_HZ = 8.0
"""What is faster is smoothed away. Even of feet that strike the floor, 99% of the power is below 15 Hz
(E. K. Antonsson, R. W. Mann, "The frequency content of gait", J. Biomechanics 18, 1985), and a trunk is slower:
pirouettes and kicks pass unchanged."""
DOUBT_RAD = 0.05
"""Angle from the smooth motion at which a frame counts a quarter (3 degrees)."""
_ROUNDS = 12
_ORDER = 3
"""Differences over time that a smooth motion has small: of the third order, so that turns at any speed, and those that
grow quicker, cost nothing."""
_SHORTEST = 8
"""Frames; a shorter motion is left as it is."""
_HANGING = [joint - 1 for joint, parent in enumerate(PARENTS) if parent == 0]
"""The posed joints that hang on the pelvis."""


def steady_root(motion: Motion) -> Motion:
    """The motion with a root that turns smoothly; all limbs are turned in the world as they were.

    A Whittaker smoother of the rotation matrices (E. T. Whittaker, "On a new method of graduation", 1923) whose frames
    are weighted anew by how far they are from it (Geman-McClure's weights).

    Args:
        motion: as it was read. Without a root, with one of a few frames, or one that is NaN somewhere, it is left as it
            is.
    """
    root_T33 = motion.arrays.root_rotation_T33
    if root_T33 is None or len(root_T33) < _SHORTEST or not np.isfinite(root_T33).all():
        return motion
    smooth_T33 = smooth_rotations(root_T33.astype(np.float64), motion.frame_rate)
    back_T33 = (smooth_T33.swapaxes(1, 2) @ root_T33).astype(np.float32)
    local_TJ33 = motion.arrays.local_TJ33.copy()
    local_TJ33[:, _HANGING] = back_T33[:, None] @ local_TJ33[:, _HANGING]
    return motion.changed(root_rotation_T33=smooth_T33.astype(np.float32), local_TJ33=local_TJ33)


def smooth_rotations(rotation_T33: np.ndarray, frame_rate: float) -> np.ndarray:
    """Rotations (T, 3, 3) without what is faster than `CUTOFF_HZ`, and without frames that are nothing like the others
    around; float64, `_SHORTEST` frames or more.
    """
    value_T9 = rotation_T33.reshape(-1, 9)
    share = np.sin(np.pi * min(CUTOFF_HZ / frame_rate, 0.5))
    penalty = _penalty(len(value_T9)) / (2 * share) ** (2 * _ORDER)
    weight_T = np.ones(len(value_T9))
    found_T33 = rotation_T33
    for _ in range(_ROUNDS):
        banded = penalty.copy()
        banded[-1] += weight_T
        found_T33 = _nearest_rotations(solveh_banded(banded, weight_T[:, None] * value_T9).reshape(-1, 3, 3))
        cosine_T = 0.5 * (np.einsum("tij,tij->t", found_T33, rotation_T33) - 1)
        off_T = np.arccos(np.clip(cosine_T, -1, 1))
        weight_T = (1 + (off_T / DOUBT_RAD) ** 2) ** -2
    return found_T33


def _penalty(count: int) -> np.ndarray:
    """The upper bands (`_ORDER` + 1, T) of D'D, where D takes differences of that order."""
    row = np.array([1.0])
    for _ in range(_ORDER):
        row = np.convolve(row, [1.0, -1.0])
    bands = np.zeros((_ORDER + 1, count))
    for apart in range(_ORDER + 1):
        products = row[: len(row) - apart] * row[apart:]
        for place, product in enumerate(products):
            bands[_ORDER - apart, apart + place : count - _ORDER + place + apart] += product
    return bands


def _nearest_rotations(matrix_T33: np.ndarray) -> np.ndarray:
    u_T33, _, v_T33 = np.linalg.svd(matrix_T33)
    u_T33[:, :, 2] *= np.linalg.det(u_T33 @ v_T33)[:, None]
    return u_T33 @ v_T33
