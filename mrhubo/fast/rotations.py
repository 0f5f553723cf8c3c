"""Rotations in NumPy: axis-angle <-> matrix, and what of `mrhubo.rotation` is needed of poses without PyTorch.

Axis-angle is in radians. Every function takes any number of leading axes, and gives numbers of the kind that it takes.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.plain.human import cross, norm, orthonormal_columns
from mrhubo.fast.plain.judging import quaternions

_SMALL = 1e-6
"""Angle [rad] under which the first order of a rotation is exact to half of a float64's digits."""
SKEW = 1e-2
"""How far R^T R may be from the identity: half precision and rounded text still pass."""


def orthonormal(matrix_X33: np.ndarray) -> np.ndarray:
    """(..., 3, 3) nearly rotations to rotations: Gram-Schmidt on the first two columns."""
    return orthonormal_columns(matrix_X33[..., :2])


def axis_angle_to_matrix(axis_angle_X3: np.ndarray) -> np.ndarray:
    """(..., 3) axis times angle [rad] to (..., 3, 3): Rodrigues' formula."""
    angle_X1 = norm(axis_angle_X3)[..., None]
    small_X1 = angle_X1 < _SMALL
    axis_X3 = axis_angle_X3 / np.maximum(angle_X1, angle_X1.dtype.type(_SMALL))
    sine_X3 = np.where(small_X1, axis_angle_X3, axis_X3 * np.sin(angle_X1))
    rest_X = np.where(small_X1, angle_X1.dtype.type(0), 1 - np.cos(angle_X1))[..., 0]
    (x, y, z), (sx, sy, sz) = np.moveaxis(axis_X3, -1, 0), np.moveaxis(sine_X3, -1, 0)
    xy, xz, yz = x * y * rest_X, x * z * rest_X, y * z * rest_X
    xx, yy, zz = x * x * rest_X, y * y * rest_X, z * z * rest_X
    rows = (1 - yy - zz, xy - sz, xz + sy, xy + sz, 1 - xx - zz, yz - sx, xz - sy, yz + sx, 1 - xx - yy)
    return np.stack(rows, axis=-1).reshape(*axis_angle_X3.shape, 3)


def matrix_to_axis_angle(matrix_X33: np.ndarray) -> np.ndarray:
    """(..., 3, 3) to (..., 3), angle in [0, pi] rad."""
    quaternion_X4 = quaternions(matrix_X33)
    vector_X3 = quaternion_X4[..., :3]
    half_X1 = np.arctan2(norm(vector_X3)[..., None], quaternion_X4[..., 3:])
    # Up to here the series of half / sin(half) is exact to rounding.
    small_X1 = half_X1 < 2 * np.finfo(half_X1.dtype).eps ** (1 / 6)
    series_X1 = 1 + half_X1**2 / 6 + 7 * half_X1**4 / 360
    return 2 * np.where(small_X1, series_X1, half_X1 / np.where(small_X1, 1, np.sin(half_X1))) * vector_X3


def quaternion_to_matrix(quaternion_X4: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4), w last, to (..., 3, 3)."""
    x, y, z, w = np.moveaxis(quaternion_X4, -1, 0)
    rows = (
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    )  # fmt: skip
    return np.stack(rows, axis=-1).reshape(*quaternion_X4.shape[:-1], 3, 3)


def shortest_turn(start_X3: np.ndarray, end_X3: np.ndarray) -> np.ndarray:
    """The smallest rotations (..., 3, 3) between unit vectors (..., 3); none if they are opposite, where no axis is
    told.
    """
    axis_X3 = cross(start_X3, end_X3)
    sine_X1 = norm(axis_X3)[..., None]
    angle_X1 = np.arctan2(sine_X1, (start_X3 * end_X3).sum(-1, keepdims=True))
    return axis_angle_to_matrix(axis_X3 * (angle_X1 / np.maximum(sine_X1, 1e-9)))


def slerp(start_X33: np.ndarray, end_X33: np.ndarray, share_X: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) at shares of the shortest ways from some to others (K. Shoemake, "Animating rotation with
    quaternion curves", SIGGRAPH 1985).
    """
    turn_X3 = matrix_to_axis_angle(start_X33.mT @ end_X33)
    return start_X33 @ axis_angle_to_matrix(share_X.astype(turn_X3.dtype)[..., None] * turn_X3)


def angles_between(one_B33: np.ndarray, other_B33: np.ndarray) -> np.ndarray:
    """Between rotations (B,) [rad], each given as (3, 3) or its nine numbers; within 3e-8 of 0 and pi in float64."""
    one_B9, other_B9 = one_B33.reshape(-1, 9), other_B33.reshape(-1, 9)
    return np.arccos(np.clip(0.5 * (np.einsum("bi,bi->b", one_B9, other_B9) - 1), -1, 1))


def are_crooked(matrix_X33: np.ndarray) -> np.ndarray:
    """Which (...) of some matrices (..., 3, 3) are no rotations: not orthonormal, mirrors, or not finite."""
    with np.errstate(all="ignore"):
        skew_X = np.abs(matrix_X33.mT @ matrix_X33 - np.eye(3, dtype=matrix_X33.dtype)).max(axis=(-2, -1))
        third_X3 = cross(matrix_X33[..., 0], matrix_X33[..., 1])
        return ~((skew_X < SKEW) & ((third_X3 * matrix_X33[..., 2]).sum(-1) > 0))


def turned(matrix_X33: np.ndarray, vector_X3: np.ndarray) -> np.ndarray:
    """Products (..., 3) of matrices with vectors."""
    return (matrix_X33 @ vector_X3[..., None])[..., 0]
