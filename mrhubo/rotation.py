"""Rotations: 6D <-> matrix <-> axis-angle <-> quaternion, and the geodesic distance.

6D is the first two COLUMNS of the rotation matrix, flattened column after column: (r00, r10, r20, r01, r11, r21)
(Zhou et al., "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019). Other code flattens rows.
Axis-angle is in radians; quaternions are (x, y, z, w). Every function takes any number of leading batch axes, and its
gradients are finite at angle 0 and at angle pi. Written out here, as the library that has the same formulas takes
longer to import than a motion to retarget.
"""

from __future__ import annotations

import torch
from torch import Tensor

__all__ = [
    "axis_angle_to_matrix",
    "geodesic_distance",
    "matrix_to_axis_angle",
    "matrix_to_quaternion",
    "matrix_to_sixd",
    "orthonormal",
    "quaternion_to_matrix",
    "random_axes",
    "shortest_turn",
    "sixd_to_matrix",
    "stack_columns",
    "wrap_angle",
]

_TINY = 1e-12
_SMALL = 1e-6
"""Angle [rad] under which the first order of a rotation is exact to half of a float64's digits."""


def matrix_to_sixd(matrix: Tensor) -> Tensor:
    """(..., 3, 3) rotation matrices to (..., 6): first column, then second column."""
    return matrix[..., :2].transpose(-1, -2).flatten(-2)


def sixd_to_matrix(sixd: Tensor) -> Tensor:
    """(..., 6) to (..., 3, 3) by Gram-Schmidt; any six numbers with independent halves give a rotation matrix."""
    first, second = sixd[..., :3], sixd[..., 3:]
    x = first * torch.rsqrt(first.square().sum(-1, keepdim=True) + _TINY)
    for _ in range(2):  # once leaves halves that are nearly parallel visibly oblique, in float32
        second = second - (x * second).sum(-1, keepdim=True) * x
    y = second * torch.rsqrt(second.square().sum(-1, keepdim=True) + _TINY)
    return torch.stack((x, y, torch.linalg.cross(x, y)), dim=-1)


def orthonormal(matrix: Tensor) -> Tensor:
    """(..., 3, 3) nearly rotations to rotations: Gram-Schmidt on the first two columns."""
    return sixd_to_matrix(matrix_to_sixd(matrix))


def stack_columns(sixd: Tensor) -> Tensor:
    """(..., 6) to (..., 3, 3): the two columns as they are, and their cross product.

    A rotation if they are orthonormal; `matrix_to_sixd` gives the same six numbers back, bit for bit.
    """
    first, second = sixd[..., :3], sixd[..., 3:]
    return torch.stack((first, second, torch.linalg.cross(first, second)), dim=-1)


def axis_angle_to_matrix(axis_angle: Tensor) -> Tensor:
    """(..., 3) axis times angle [rad] to (..., 3, 3): Rodrigues' formula."""
    angle = axis_angle.norm(dim=-1, keepdim=True)
    small = angle < _SMALL
    axis = axis_angle / angle.clamp_min(_SMALL)  # not zero where another branch is taken: its gradient counts
    sx, sy, sz = torch.where(small, axis_angle, axis * angle.sin()).unbind(-1)
    rest = torch.where(small, torch.zeros_like(angle), 1 - angle.cos())[..., 0]
    x, y, z = axis.unbind(-1)
    xy, xz, yz = x * y * rest, x * z * rest, y * z * rest
    xx, yy, zz = x * x * rest, y * y * rest, z * z * rest
    rows = (1 - yy - zz, xy - sz, xz + sy, xy + sz, 1 - xx - zz, yz - sx, xz - sy, yz + sx, 1 - xx - yy)
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def matrix_to_axis_angle(matrix: Tensor) -> Tensor:
    """(..., 3, 3) to (..., 3), angle in [0, pi] rad."""
    quaternion = matrix_to_quaternion(matrix)
    quaternion = torch.where(quaternion[..., 3:] > 0, quaternion, -quaternion)
    vector = quaternion[..., :3]
    half = torch.atan2(vector.norm(dim=-1, keepdim=True), quaternion[..., 3:])
    # Up to here the series of half / sin(half) is exact to rounding, and its gradient more so than the quotient's.
    small = half < 2 * torch.finfo(half.dtype).eps ** (1 / 6)
    series = 1 + half**2 / 6 + 7 * half**4 / 360
    return 2 * torch.where(small, series, half / torch.where(small, torch.ones_like(half), half.sin())) * vector


def quaternion_to_matrix(quaternion_xyzw: Tensor) -> Tensor:
    """(..., 4) quaternions (x, y, z, w), of any length but zero, to (..., 3, 3)."""
    x, y, z, w = torch.nn.functional.normalize(quaternion_xyzw, dim=-1).unbind(-1)
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    xy, zw, xz, yw, yz, xw = x * y, z * w, x * z, y * w, y * z, x * w
    rows = (
        xx - yy - zz + ww, 2 * (xy - zw), 2 * (xz + yw),
        2 * (xy + zw), -xx + yy - zz + ww, 2 * (yz - xw),
        2 * (xz - yw), 2 * (yz + xw), -xx - yy + zz + ww,
    )  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def wxyz_to_matrix(quaternion_wxyz: Tensor) -> Tensor:
    """(..., 4) quaternions (w, x, y, z), as answers tell a base's, of any length but zero, to (..., 3, 3)."""
    return quaternion_to_matrix(quaternion_wxyz[..., [1, 2, 3, 0]])


def matrix_to_quaternion(matrix: Tensor) -> Tensor:
    """(..., 3, 3) to (..., 4) unit quaternions (x, y, z, w).

    Each row of 4 q q^T is the quaternion times one of its numbers; the row of the largest is taken, which no rotation
    makes small (F. L. Markley, "Unit quaternion from rotation matrix", Journal of Guidance, Control, and Dynamics
    31(2), 2008).
    """
    (m00, m01, m02), (m10, m11, m12), (m20, m21, m22) = (row.unbind(-1) for row in matrix.unbind(-2))
    xy, xz, yz = m10 + m01, m20 + m02, m21 + m12
    xw, yw, zw = m21 - m12, m02 - m20, m10 - m01
    rows = (
        1 + m00 - m11 - m22, xy, xz, xw,
        xy, 1 + m11 - m22 - m00, yz, yw,
        xz, yz, 1 + m22 - m00 - m11, zw,
        xw, yw, zw, 1 + m00 + m11 + m22,
    )  # fmt: skip
    product = torch.stack(rows, dim=-1).unflatten(-1, (4, 4))
    largest = product.diagonal(dim1=-2, dim2=-1).argmax(dim=-1)
    row = torch.take_along_dim(product, largest[..., None, None], dim=-2)[..., 0, :]
    return row / row.norm(dim=-1, keepdim=True)


def shortest_turn(start: Tensor, end: Tensor) -> Tensor:
    """The smallest rotations (..., 3, 3) between unit vectors (..., 3); none if they are opposite, where no axis is
    told.
    """
    axis = torch.linalg.cross(start, end)
    sine = axis.norm(dim=-1, keepdim=True)
    angle = torch.atan2(sine, (start * end).sum(-1, keepdim=True))
    return axis_angle_to_matrix(axis * (angle / sine.clamp_min(1e-9)))


def random_axes(*shape: int, generator: torch.Generator | None, dtype: torch.dtype | None = None) -> Tensor:
    """Unit vectors (*shape, 3), uniform on the sphere."""
    return torch.nn.functional.normalize(torch.randn(*shape, 3, generator=generator, dtype=dtype), dim=-1)


def geodesic_distance(a: Tensor, b: Tensor) -> Tensor:
    """Angle [rad], (...), in [0, pi] between rotation matrices (..., 3, 3).

    atan2 of the sine (from the skew part) and the cosine (from the trace) is accurate where arccos is not, near 0 and
    pi; the sine's square root is kept off zero, where its gradient would be infinite, and is zero there instead.
    """
    relative = a.transpose(-1, -2) @ b
    skew = torch.stack(
        (
            relative[..., 2, 1] - relative[..., 1, 2],
            relative[..., 0, 2] - relative[..., 2, 0],
            relative[..., 1, 0] - relative[..., 0, 1],
        ),
        dim=-1,
    )
    squared = skew.square().sum(-1)
    positive = squared > 0
    sine = torch.where(positive, torch.where(positive, squared, torch.ones_like(squared)).sqrt(), squared) / 2
    cosine = (relative.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2
    return torch.atan2(sine, cosine)


def wrap_angle(angle: Tensor) -> Tensor:
    """The same angle in [-pi, pi) [rad]."""
    return torch.remainder(angle + torch.pi, 2 * torch.pi) - torch.pi
