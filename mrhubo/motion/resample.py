"""A motion at another frame rate.

Legend: T frames, S frames of the new rate.
"""

from __future__ import annotations

import dataclasses
import math

import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.poses import check_frame_rate
from mrhubo.rotation import axis_angle_to_matrix, matrix_to_axis_angle

_MOST_FRAMES = 10_000_000


def resample(motion: Motion, frame_rate: float) -> Motion:
    """The motion with `frame_rate` frames per second, from its first frame to no later than its last.

    Rotations are on the shortest way between those of the two frames around (slerp: K. Shoemake, "Animating rotation
    with quaternion curves", SIGGRAPH 1985), places on the straight line. Frames that both rates share stay as they are.

    Raises:
        UserError: the frame rate is not positive, or would make more than ten million frames.
    """
    check_frame_rate(frame_rate, needed=True)
    if frame_rate == motion.frame_rate or not len(motion):
        return dataclasses.replace(motion, frame_rate=float(frame_rate))
    # a hair more, so that a last frame that both have is not lost to rounding
    count = (len(motion) - 1) * frame_rate / motion.frame_rate * (1 + 1e-12)
    if count > _MOST_FRAMES:
        raise UserError(f"{motion.name}: {frame_rate:g} frames a second would be {count:.3g} frames")
    place_S = torch.arange(math.floor(count) + 1, dtype=torch.float64) * (motion.frame_rate / frame_rate)
    before_S = place_S.long().clamp(max=len(motion) - 1)
    after_S, share_S = (before_S + 1).clamp(max=len(motion) - 1), place_S - before_S

    def line(values_TX: Tensor | None) -> Tensor | None:
        if values_TX is None:
            return None
        first, share_S1 = values_TX[before_S], share_S[:, None].to(values_TX)
        return first + share_S1 * (values_TX[after_S] - first)

    root = motion.root_rotation_T33
    return dataclasses.replace(
        motion,
        local_TJ33=_slerp(motion.local_TJ33, before_S, after_S, share_S),
        frame_rate=float(frame_rate),
        root_rotation_T33=None if root is None else _slerp(root, before_S, after_S, share_S),
        root_position_T3=line(motion.root_position_T3),
        confidence_TJ=line(motion.confidence_TJ),
    )


def _slerp(rotation_TX33: Tensor, before_S: Tensor, after_S: Tensor, share_S: Tensor) -> Tensor:
    first = rotation_TX33[before_S]
    turn = matrix_to_axis_angle(first.mT @ rotation_TX33[after_S])
    share = share_S.to(turn).reshape(-1, *[1] * (turn.ndim - 1))
    return torch.where(share[..., None] == 0, first, first @ axis_angle_to_matrix(share * turn))
