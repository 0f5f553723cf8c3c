"""Rotations one at a time, as matrices, axes times angles and quaternions: in a tenth of the time that functions of
many (`mrhubo.fast.rotations`) need for one.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.fast.rotations import matrix_to_axis_angle
from mrhubo.live.vectors import about

_SMALL = 1e-9


def turn_of(matrix_33: np.ndarray) -> np.ndarray:
    """A rotation as axis times angle (3,), 0 to pi [rad]."""
    (a, b, c), (d, e, f), (g, h, i) = matrix_33.tolist()
    x, y, z = h - f, c - g, d - b
    twice_sine, twice_cosine = math.sqrt(x * x + y * y + z * z), a + e + i - 1.0
    if twice_sine > _SMALL:
        return np.array((x, y, z)) * (math.atan2(twice_sine, twice_cosine) / twice_sine)
    return np.zeros(3) if twice_cosine > 0 else matrix_to_axis_angle(matrix_33)


def turns_of(matrix_R33: np.ndarray) -> np.ndarray:
    """The same of some (R, 3)."""
    return np.stack([turn_of(matrix_33) for matrix_33 in matrix_R33])


def rotation_of(turn_3: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) about an axis, by its length [rad]."""
    x, y, z = turn_3.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    return np.eye(3) if angle < 1e-12 else np.array(about((x / angle, y / angle, z / angle), angle)).T


def quaternion_of(matrix_33: np.ndarray, near_4: np.ndarray | None = None) -> np.ndarray:
    """A rotation as a unit quaternion (4,), w first; of the two that there are the nearer one to another one, or that
    whose w is not negative.
    """
    turn_3 = turn_of(matrix_33)
    angle = math.sqrt(float(turn_3 @ turn_3))
    share = 0.5 if angle < _SMALL else math.sin(angle / 2) / angle
    found_4 = np.append(math.cos(angle / 2), share * turn_3)
    return -found_4 if near_4 is not None and found_4 @ near_4 < 0 else found_4
