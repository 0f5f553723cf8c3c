"""A part of a motion, and a motion with left and right exchanged.

Legend: T frames, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.body.joints import MIRROR
from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion

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
    arrays = vars(motion.arrays)
    return motion.changed(**{name: array[first : last + 1] for name, array in arrays.items() if array is not None})


def check_span(start: float, end: float | None) -> None:
    """Refuses seconds between which no motion can be."""
    if not math.isfinite(start) or start < 0 or (end is not None and not start <= end < math.inf):
        until = "its end" if end is None else f"{end:g} s"
        raise UserError(f"from {start:g} s to {until} is no span of time; motions begin at 0")


def mirror(motion: Motion) -> Motion:
    """The motion as a mirror shows it: what the left arm did, the right one does; `NAME_mirrored`."""
    arrays = motion.arrays
    root, place, trust = arrays.root_rotation_T33, arrays.root_position_T3, arrays.confidence_TJ
    sign = np.array([-1.0, 1.0, 1.0], np.float32)
    return motion.changed(
        name=f"{motion.name}_mirrored",
        local_TJ33=arrays.local_TJ33[:, MIRROR] * sign[:, None] * sign,
        root_rotation_T33=None if root is None else root * sign[:, None] * sign,
        root_position_T3=None if place is None else place * sign,
        confidence_TJ=None if trust is None else trust[:, MIRROR],
        contact_T4=None if arrays.contact_T4 is None else arrays.contact_T4[:, [2, 3, 0, 1]],
        notes=(*motion.notes, "left and right are exchanged, as asked"),
    )
