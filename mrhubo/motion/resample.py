"""A motion at another frame rate.

Legend: T frames, S frames of the new rate.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.poses import check_frame_rate
from mrhubo.fast.rotations import slerp
from mrhubo.motion.motion import Motion

_MOST_FRAMES = 2_000_000
"""As many as are read of a file."""
_BLOCK = 2**14
"""Frames whose rotations are worked on at a time, as what they pass through takes several times their memory."""


def resample(motion: Motion, frame_rate: float) -> Motion:
    """The motion with `frame_rate` frames per second, from its first frame to no later than its last.

    Rotations are on the shortest way between those of the two frames around, places on the straight line. Frames that
    both rates share stay as they are.

    Raises:
        UserError: the frame rate is not positive, or would make more than two million frames.
    """
    check_frame_rate(frame_rate, needed=True)
    if frame_rate == motion.frame_rate or not len(motion):
        return motion.changed(frame_rate=float(frame_rate))
    # a hair more, so that a last frame that both have is not lost to rounding
    count = (len(motion) - 1) * frame_rate / motion.frame_rate * (1 + 1e-12)
    if count > _MOST_FRAMES:
        raise UserError(
            f"{motion.name}: {frame_rate:g} frames a second would be {count:,.0f} frames; "
            f"at most {_MOST_FRAMES:,} are made"
        )
    place_S = np.arange(math.floor(count) + 1) * (motion.frame_rate / frame_rate)
    before_S = np.minimum(place_S.astype(np.int64), len(motion) - 1)
    after_S = np.minimum(before_S + 1, len(motion) - 1)
    share_S = place_S - before_S

    def line(values_TX: np.ndarray | None) -> np.ndarray | None:
        if values_TX is None:
            return None
        first, share_S1 = values_TX[before_S], share_S[:, None].astype(values_TX.dtype)
        return first + share_S1 * (values_TX[after_S] - first)

    arrays = motion.arrays
    root = arrays.root_rotation_T33
    return motion.changed(
        local_TJ33=_slerp(arrays.local_TJ33, before_S, after_S, share_S),
        frame_rate=float(frame_rate),
        root_rotation_T33=None if root is None else _slerp(root, before_S, after_S, share_S),
        root_position_T3=line(arrays.root_position_T3),
        confidence_TJ=line(arrays.confidence_TJ),
        contact_T4=None if arrays.contact_T4 is None else arrays.contact_T4[np.where(share_S < 0.5, before_S, after_S)],
    )


def _slerp(rotation_TX33: np.ndarray, before_S: np.ndarray, after_S: np.ndarray, share_S: np.ndarray) -> np.ndarray:
    found_SX33 = np.empty((len(share_S), *rotation_TX33.shape[1:]), rotation_TX33.dtype)
    for start in range(0, len(share_S), _BLOCK):
        block = slice(start, start + _BLOCK)
        first = rotation_TX33[before_S[block]]
        share = share_S[block].reshape(-1, *[1] * (first.ndim - 3))
        between = slerp(first, rotation_TX33[after_S[block]], share)
        found_SX33[block] = np.where(share[..., None, None] == 0, first, between)
    return found_SX33
