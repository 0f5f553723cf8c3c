"""Poses that a retargeter is given, checked, in parts that fit into memory with all that is made of them.

Legend: T frames, J = 21 human joints.
"""

from __future__ import annotations

from collections.abc import Iterator

import torch
from torch import Tensor

from mrhubo.body import Skeleton
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.fast.poses import checked_polish
from mrhubo.motion import NOT_FINITE, MotionLike, refuse_frames, to_tensor

_CHUNK = 8_192
"""Frames that are worked on at a time: each takes some 13 kB on the way."""
_LARGEST = 2.0
"""No number of a rotation matrix is larger than 1; those that come near to one may be a little."""


def checked_parts(local_TJ33: MotionLike, skeleton: Skeleton, device: torch.device, polish: int) -> list[Tensor]:
    """`pose_parts` of what is to be answered with so many steps of optimisation.

    Raises:
        UserError: as `checked_polish` and `pose_parts`.
    """
    checked_polish(polish)
    return list(pose_parts(local_TJ33, skeleton, device))


def pose_parts(local_TJ33: MotionLike, skeleton: Skeleton, device: torch.device) -> Iterator[Tensor]:
    """The poses as the networks want them, on a device, float32.

    Raises:
        UserError: they have another shape, or hold NaN, infinite numbers or some that no rotation has.
    """
    given, joints = to_tensor(local_TJ33, skeleton), len(POSED_JOINT_NAMES)
    if given.ndim != 4 or given.shape[1:] != (joints, 3, 3):
        raise UserError(
            f"human poses must have the shape (frames, {joints}, 3, 3), found {tuple(given.shape)}; other forms are"
            " for a call, retargeter(poses)"
        )
    for number, part in enumerate(given.split(_CHUNK)):
        largest_T = part.abs().flatten(1).amax(dim=1) if len(part) else part.new_zeros(0)
        refuse_frames(~largest_T.isfinite(), NOT_FINITE, number * _CHUNK)
        refuse_frames(largest_T > _LARGEST, "numbers that no rotation has", number * _CHUNK)
        yield part.to(device, torch.float32)
