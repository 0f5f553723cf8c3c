"""What a retargeter takes: a `Motion`, or human poses as a NumPy or torch array in one of three forms.

Legend: ... any leading axes, T frames (the leading axes as one), J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import torch
from torch import Tensor

from mrhubo.body.skeleton import POSED_JOINT_NAMES, Skeleton
from mrhubo.errors import UserError
from mrhubo.fast.poses import check_frame_rate, plain_array
from mrhubo.fast.rotations import SKEW
from mrhubo.motion.checks import MAX_TURN, Turns
from mrhubo.motion.motion import Motion
from mrhubo.rotation import axis_angle_to_matrix, stack_columns

MotionLike: TypeAlias = Motion | Tensor | np.ndarray | Sequence[Any]
"""A motion, or local rotations of SMPL's joints 1..21 as an array or nested lists: matrices (..., 21, 3, 3), axis-angle
[rad] (..., 63), as AMASS's `pose_body` has it, or 6D (..., 21, 6); any leading axes, none for a single pose."""
_MANY = 50
"""Frames of an array from which on such shares say something."""
_CHUNK = 16_384
"""Frames that are checked and converted at a time."""
_JOINTS = len(POSED_JOINT_NAMES)
NOT_FINITE = "NaN or infinite numbers"
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


def read_poses(motion: MotionLike, frame_rate: float | None = None, skeleton: Skeleton | None = None) -> Poses:
    """A motion or an array as poses; the form of an array is told by its last axes.

    Args:
        motion: see `MotionLike`.
        frame_rate: frames per second of an array; a `Motion` has its own.
        skeleton: whose rest pose the rotations shall refer to (`Motion.for_skeleton`); default: ours. An array's refer
            to whichever skeleton it is given for.

    Raises:
        UserError: it is neither, has another shape, holds NaN or infinite numbers or what is no rotation (says in which
            frame), or the frame rate is not positive.
    """
    array = to_tensor(motion, skeleton)
    frame_rate = motion.frame_rate if isinstance(motion, Motion) else frame_rate
    check_frame_rate(frame_rate)
    shape = tuple(array.shape)
    form = next((form for form in _FORMS if shape[-len(form.axes) :] == form.axes), None)
    if form is None:
        raise UserError(
            f"human poses must have the shape (..., {_JOINTS}, 3, 3) (matrices), (..., {3 * _JOINTS}) (axis-angle, rad)"
            f" or (..., {_JOINTS}, 6) (6D), found {shape}"
        )
    leading = shape[: -len(form.axes)]
    array = array.reshape(math.prod(leading), *form.axes)
    poses, turns = [], Turns()
    for number, part in enumerate(array.split(_CHUNK)):
        refuse_frames(~part.flatten(1).isfinite().all(-1), NOT_FINITE, number * _CHUNK, leading)
        wrong_TJ, pose_TJ33 = form.read(part, turns)
        refuse_frames(wrong_TJ.any(-1), form.wrong, number * _CHUNK, leading)
        if pose_TJ33 is not part:
            poses.append(pose_TJ33.float())
    if turns.are_degrees and len(array) >= _MANY:
        raise UserError(f"human poses are no axis-angle in radians (degrees?): {turns.described}")
    return Poses(torch.cat(poses) if poses else array.float(), leading, frame_rate)


def to_tensor(array: MotionLike, skeleton: Skeleton | None = None) -> Tensor:
    """Numbers, or a motion's rotations (for a skeleton, as for `read_poses`), as a tensor, float32 or, where they come
    so, float64.

    Raises:
        UserError: it is no NumPy or torch array of numbers, nor lists of numbers that make one.
    """
    if isinstance(array, Motion):
        array = (array.for_skeleton(skeleton) if skeleton is not None else array).local_TJ33
    kind = type(array).__name__
    if isinstance(array, list | tuple):
        with contextlib.suppress(Exception):  # ragged lists, tensors on other devices
            array = np.array(array)
    if isinstance(array, np.ndarray) and array.dtype.kind in "fiu":
        array = plain_array(array)
        # a copy: torch wants it writable, without negative strides, and in this machine's order of bytes
        exact = array.dtype.kind == "f" and array.dtype.itemsize >= 8
        with np.errstate(over="ignore"):
            array = torch.from_numpy(np.array(array, np.float64 if exact else np.float32))
    if (
        not isinstance(array, Tensor)
        or array.is_complex()
        or array.dtype == torch.bool
        or array.layout != torch.strided
        or array.is_nested
        or array.is_quantized
        or array.is_meta
    ):
        kind = f"an array of {array.dtype}" if isinstance(array, np.ndarray | Tensor) else kind
        raise UserError(f"human motion: expected a Motion, or a NumPy or torch array of numbers, found {kind}")
    return array if array.dtype == torch.float64 else array.float()


@dataclass(frozen=True)
class _Form:
    """A form in which arrays hold rotations."""

    axes: tuple[int, ...]
    """The last axes."""
    read: Callable[[Tensor, Turns], tuple[Tensor, Tensor]]
    """Which joints (T, 21) are no rotation, and the matrices (T, 21, 3, 3); counts turns where it can."""
    wrong: str
    """What is wrong with those joints."""


def _read_matrices(matrix: Tensor, _: Turns) -> tuple[Tensor, Tensor]:
    """Those that are not orthonormal, or mirror, are wrong."""
    return are_crooked(matrix), matrix


def are_crooked(matrix: Tensor) -> Tensor:
    """Which (...) of some matrices (..., 3, 3) are no rotations: not orthonormal, mirrors, or not finite."""
    skew = (matrix.mT @ matrix - torch.eye(3).to(matrix)).abs().amax((-2, -1))
    return ~((skew < SKEW) & (torch.linalg.det(matrix) > 0))


def _read_sixd(sixd: Tensor, _: Turns) -> tuple[Tensor, Tensor]:
    """Those that hold a column that is zero, or two that are parallel, are wrong."""
    first, second = sixd[..., :3], sixd[..., 3:]
    parallel = torch.linalg.cross(first, second).norm(dim=-1) <= _FLAT * first.norm(dim=-1) * second.norm(dim=-1)
    return parallel, stack_columns(sixd)


def _read_axis_angle(numbers: Tensor, turns: Turns) -> tuple[Tensor, Tensor]:
    """Those that turn further than any joint of a body are wrong."""
    rotvec = numbers.unflatten(-1, (_JOINTS, 3))
    turn_TJ = rotvec.norm(dim=-1)
    turns.add(turn_TJ.cpu().numpy())
    return turn_TJ > MAX_TURN, axis_angle_to_matrix(rotvec)


_FORMS = (
    _Form((_JOINTS, 3, 3), _read_matrices, "a matrix that is no rotation"),
    _Form((_JOINTS, 6), _read_sixd, "six numbers that are no rotation"),
    _Form((3 * _JOINTS,), _read_axis_angle, "no axis-angle in radians (degrees?)"),
)


def refuse_frames(wrong_T: Tensor, what: str, first: int = 0, leading: tuple[int, ...] | None = None) -> None:
    """Refuses poses of which some frames are wrong; names the first of them.

    Args:
        wrong_T: which frames (T,) are wrong.
        what: what these hold.
        first: number of the first of them among all frames.
        leading: the leading axes that all frames had as they were given; default: one.

    Raises:
        UserError: one is wrong.
    """
    if bool(wrong_T.any()):
        place = first + int(wrong_T.nonzero()[0, 0])
        leading = (place + 1,) if leading is None else leading
        index = tuple(map(int, np.unravel_index(place, leading))) if leading else ()
        frame = f" {index[0]}" if len(index) == 1 else f" {index}" if index else ""
        raise UserError(f"human pose{frame} holds {what}")
