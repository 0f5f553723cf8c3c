"""A pelvis that does not shake: what no pelvis can do is the recording's, and a robot's base would do it.

Markers change places for a frame, and estimators of pose doubt for a few: the pelvis then turns by 10 or 30 degrees and
back within a thirtieth of a second, while the limbs, which other markers tell, stay where they are. A robot's base is
turned as the pelvis is. So its rotation is smoothed over time, robustly: frames that differ much from their neighbours
have no say. Its place stays as it is, but for such frames: they go where the others are.

Legend: T frames, X numbers of a frame.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import solveh_banded

from mrhubo.fast.pelvis import HANGING, Pelvises
from mrhubo.fast.roots import without_jumps
from mrhubo.fast.rotations import angles_between
from mrhubo.motion.motion import Motion

CUTOFF_HZ = 8.0
"""What is faster is smoothed away. Even of feet that strike the floor, 99% of the power is below 15 Hz
(E. K. Antonsson, R. W. Mann, "The frequency content of gait", J. Biomechanics 18, 1985), and a trunk is slower:
pirouettes and kicks pass unchanged."""
DOUBT_RAD = 0.05
"""Angle from the smooth motion at which a frame counts a quarter (3 degrees)."""
SPIKE_M, DOUBT_M = 0.03, 0.02
"""How far a place is from the smooth way that is none [m]: of people who run and dance it is 6 mm at most; and where a
frame counts a quarter."""
_ROUNDS = 12
_ORDER = 3
"""Differences over time that a smooth motion has small: of the third order, so that turns at any speed, and those that
grow quicker, cost nothing."""
_SHORTEST = 8
"""Frames; a shorter motion is left as it is."""


def steady_root(motion: Motion) -> Motion:
    """The motion with a root that turns smoothly and has no spikes in its way, nor jumps (`mrhubo.fast.roots`); all
    limbs are turned in the world as they were.

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
    local_TJ33[:, HANGING] = back_T33[:, None] @ local_TJ33[:, HANGING]
    place_T3 = motion.arrays.root_position_T3
    if place_T3 is not None and np.isfinite(place_T3).all():
        place_T3 = without_spikes(place_T3, motion.frame_rate)
    return motion.changed(
        root_rotation_T33=smooth_T33.astype(np.float32), root_position_T3=place_T3, local_TJ33=local_TJ33
    )


def steady_frames(motion: Motion) -> Motion:
    """The motion as a stream sees it, frame after frame (`mrhubo.fast.pelvis`): without turns that no pelvis makes.
    Without a root, or with one that is NaN somewhere, it is left as it is.
    """
    root_T33, local_TJ33 = motion.arrays.root_rotation_T33, motion.arrays.local_TJ33
    if root_T33 is None or root_T33.shape != (len(local_TJ33), 3, 3) or not np.isfinite(root_T33).all():
        return motion
    pelvis, seen, since = Pelvises(1), np.array([True]), np.array([np.inf])
    turn_T33, steady_TJ33, changed = root_T33.copy(), local_TJ33.copy(), False
    for frame in range(len(root_T33)):
        told = (root_T33[frame, None], local_TJ33[frame, None])
        (turn_T33[frame],), (steady_TJ33[frame],) = found = pelvis.follow(*told, seen, since)
        changed, since = changed or found[0] is not told[0], np.array([1 / motion.frame_rate])
    return motion.changed(root_rotation_T33=turn_T33, local_TJ33=steady_TJ33) if changed else motion


def without_spikes(place_T3: np.ndarray, frame_rate: float) -> np.ndarray:
    """A way (T, 3) [m], with its own type, whose jumps are taken out and whose spikes are where frames around tell;
    itself, if it has none; `_SHORTEST` frames or more.
    """
    way_T3, jump_T3 = without_jumps(place_T3, frame_rate)
    smooth_T3, off_T = _smooth(way_T3, frame_rate, DOUBT_M, lambda found_TX: found_TX, _distances)
    spike_T = off_T > SPIKE_M
    if not spike_T.any() and not jump_T3.any():
        return place_T3
    return np.where(spike_T[:, None], smooth_T3, way_T3).astype(place_T3.dtype)


def smooth_rotations(rotation_T33: np.ndarray, frame_rate: float) -> np.ndarray:
    """Rotations (T, 3, 3) without what is faster than `CUTOFF_HZ`, and without frames that are nothing like the others
    around; float64, `_SHORTEST` frames or more.
    """
    smooth_T9, _ = _smooth(rotation_T33.reshape(-1, 9), frame_rate, DOUBT_RAD, _nearest_rotations, angles_between)
    return smooth_T9.reshape(-1, 3, 3)


def _smooth(
    value_TX: np.ndarray,
    frame_rate: float,
    doubt: float,
    nearest: Callable[[np.ndarray], np.ndarray],
    apart: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Smooth values (T, X), made such as there are by `nearest`, and how far those that were given are `apart` (T,)."""
    share = np.sin(np.pi * min(CUTOFF_HZ / frame_rate, 0.5))
    penalty = _penalty(len(value_TX)) / (2 * share) ** (2 * _ORDER)
    weight_T, found_TX, off_T = np.ones(len(value_TX)), value_TX, np.zeros(len(value_TX))
    for _ in range(_ROUNDS):
        banded = penalty.copy()
        banded[-1] += weight_T
        found_TX = nearest(solveh_banded(banded, weight_T[:, None] * value_TX))
        off_T = apart(found_TX, value_TX)
        weight_T = (1 + (off_T / doubt) ** 2) ** -2
    return found_TX, off_T


def _distances(one_TX: np.ndarray, other_TX: np.ndarray) -> np.ndarray:
    return np.linalg.norm(one_TX - other_TX, axis=1)


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


def _nearest_rotations(matrix_T9: np.ndarray) -> np.ndarray:
    u_T33, _, v_T33 = np.linalg.svd(matrix_T9.reshape(-1, 3, 3))
    u_T33[:, :, 2] *= np.linalg.det(u_T33 @ v_T33)[:, None]
    return (u_T33 @ v_T33).reshape(-1, 9)
