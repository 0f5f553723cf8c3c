"""A part of a motion, and a motion with left and right exchanged.

Legend: T frames, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import dataclasses
import math

import torch

from mrhubo.body.skeleton import mirror_joints, mirror_rotations
from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion

_PER_FRAME = ("local_TJ33", "root_rotation_T33", "root_position_T3", "confidence_TJ")
_SLACK = 1e-6
"""Of a frame: times that were rounded still name the frame that they are of."""


def trim(motion: Motion, start: float = 0.0, end: float | None = None) -> Motion:
    """The frames from `start` to `end` seconds, both in; None: to the motion's end.

    Raises:
        UserError: the times are no such span, or no frame lies between them.
    """
    check_span(start, end)
    first = math.ceil(start * motion.frame_rate - _SLACK)
    last = len(motion) - 1
    if end is not None:
        last = min(last, math.floor(end * motion.frame_rate + _SLACK))
    if first > last:
        length = max(0, len(motion) - 1) / motion.frame_rate
        span = f"from {start:g} s" + ("" if end is None else f" to {end:g} s")
        raise UserError(f"{motion.name}: has no frame {span}; it lasts from 0 to {length:.3f} s")
    arrays = {name: getattr(motion, name) for name in _PER_FRAME}
    cut = {name: array[first : last + 1] for name, array in arrays.items() if array is not None}
    return dataclasses.replace(motion, **cut)


def check_span(start: float, end: float | None) -> None:
    """Refuses seconds between which no motion can be."""
    if not math.isfinite(start) or start < 0 or (end is not None and not start <= end < math.inf):
        until = "its end" if end is None else f"{end:g} s"
        raise UserError(f"from {start:g} s to {until} is no span of time; motions begin at 0")


def mirror(motion: Motion) -> Motion:
    """The motion as a mirror shows it: what the left arm did, the right one does; `NAME_mirrored`."""
    root, place, trust = motion.root_rotation_T33, motion.root_position_T3, motion.confidence_TJ
    sign = torch.tensor([-1.0, 1.0, 1.0])
    return dataclasses.replace(
        motion,
        name=f"{motion.name}_mirrored",
        local_TJ33=mirror_rotations(motion.local_TJ33),
        root_rotation_T33=None if root is None else root * sign[:, None] * sign,
        root_position_T3=None if place is None else place * sign,
        confidence_TJ=None if trust is None else mirror_joints(trust),
        notes=(*motion.notes, "left and right are exchanged, as asked"),
    )
