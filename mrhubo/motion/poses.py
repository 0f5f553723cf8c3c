"""What a retargeter takes: a `Motion`, or human poses as a NumPy or torch array in one of three forms.

Legend: ... any leading axes, T frames (the leading axes as one), J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.rotation import axis_angle_to_matrix, stack_columns

MotionLike: TypeAlias = Motion | Tensor | np.ndarray
"""A motion, or local rotations of SMPL's joints 1..21: matrices (..., 21, 3, 3), axis-angle [rad] (..., 63), as AMASS's
`pose_body` has it, or 6D (..., 21, 6); any leading axes, none for a single pose."""
MAX_TURN = 8 * math.pi
"""No axis-angle number is that large [rad]; degrees are."""
_JOINTS = len(POSED_JOINT_NAMES)
_SKEW = 1e-2
"""How far R^T R may be from the identity: half precision and rounded text still pass."""
_FLAT = 1e-4
"""Sine of the angle between the two columns of 6D numbers, under which they leave the third open."""


@dataclass(frozen=True)
class Poses:
    """Human poses in the form that the networks and the optimiser work with."""

    local_TJ33: Tensor
    """Local rotations (T, 21, 3, 3) of SMPL's joints 1..21, as they were given, float32."""
    shape: tuple[int, ...]
    """The leading axes as they were given, T numbers in all: `()` for a single pose."""
    frame_rate: float | None
    """Frames per second, where it is known."""


def read_poses(motion: MotionLike, frame_rate: float | None = None) -> Poses:
    """A motion or an array as poses; the form of an array is told by its last axes.

    Args:
        motion: see `MotionLike`.
        frame_rate: frames per second of an array; a `Motion` has its own.

    Raises:
        UserError: it is neither, has another shape, holds NaN or infinite numbers or what is no rotation (says in which
            frame), or the frame rate is not positive.
    """
    if isinstance(motion, Motion):
        array, frame_rate = motion.local_TJ33, motion.frame_rate
    else:
        array = _to_tensor(motion)
    if frame_rate is not None and not (math.isfinite(frame_rate) and frame_rate > 0):
        raise UserError(f"human motion: the frame rate must be a positive number, found {frame_rate}")
    shape = tuple(array.shape)
    if shape[-3:] == (_JOINTS, 3, 3):
        leading, wrong, what = shape[:-3], _no_matrix(array), "a matrix that is no rotation"
        pose = array
    elif shape[-2:] == (_JOINTS, 6):
        leading, wrong, what = shape[:-2], _no_sixd(array), "six numbers that are no rotation"
        pose = stack_columns(array)
    elif shape[-1:] == (3 * _JOINTS,):
        array = array.unflatten(-1, (_JOINTS, 3))
        leading, wrong, what = shape[:-1], (array.abs() > MAX_TURN).any(-1), "no axis-angle in radians (degrees?)"
        pose = axis_angle_to_matrix(array)
    else:
        raise UserError(
            f"human poses must have the shape (..., {_JOINTS}, 3, 3) (matrices), (..., {3 * _JOINTS}) (axis-angle, rad)"
            f" or (..., {_JOINTS}, 6) (6D), found {shape}"
        )
    numbers = array.flatten(len(leading) + 1)
    _refuse(~numbers.isfinite().all(-1), leading, "NaN or infinite numbers")
    _refuse(wrong.any(-1), leading, what)
    return Poses(pose.reshape(-1, _JOINTS, 3, 3).float(), leading, frame_rate)


def _to_tensor(array: Tensor | np.ndarray) -> Tensor:
    if isinstance(array, np.ndarray) and array.dtype.kind in "fiu":
        array = torch.from_numpy(np.array(array))  # a copy: torch wants it writable and without negative strides
    if not isinstance(array, Tensor) or array.is_complex() or array.dtype == torch.bool:
        kind = f"an array of {array.dtype}" if isinstance(array, np.ndarray | Tensor) else type(array).__name__
        raise UserError(f"human motion: expected a Motion, or a NumPy or torch array of numbers, found {kind}")
    return array if array.dtype == torch.float64 else array.float()


def _no_matrix(matrix: Tensor) -> Tensor:
    """Which of the matrices (..., 21, 3, 3) are not orthonormal, or mirror."""
    skew = (matrix.mT @ matrix - torch.eye(3).to(matrix)).abs().amax((-2, -1))
    return (skew > _SKEW) | (torch.linalg.det(matrix) < 0)


def _no_sixd(sixd: Tensor) -> Tensor:
    """Which of the six numbers (..., 21, 6) hold a column that is zero, or two that are parallel."""
    first, second = sixd[..., :3], sixd[..., 3:]
    return torch.linalg.cross(first, second).norm(dim=-1) <= _FLAT * first.norm(dim=-1) * second.norm(dim=-1)


def _refuse(wrong: Tensor, leading: tuple[int, ...], what: str) -> None:
    """Raises for the first frame that is wrong; `wrong` has the leading axes, or one more for the joints."""
    if bool(wrong.any()):
        index = tuple(wrong.nonzero()[0].tolist()[: len(leading)])
        frame = f" {index[0]}" if len(index) == 1 else f" {index}" if index else ""
        raise UserError(f"human pose{frame} holds {what}")
