"""A part of a motion, and a motion with left and right exchanged.

Legend: T frames, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import numpy as np

from mrhubo.body.joints import MIRROR
from mrhubo.motion.motion import Motion
from mrhubo.robot_motion.span import frames_between


def trim(motion: Motion, start: float = 0.0, end: float | None = None) -> Motion:
    """The frames from `start` to `end` seconds, both in; None: to the motion's end.

    Raises:
        UserError: the times are no such span, or no frame lies between them.
    """
    rows = frames_between(motion.name, len(motion), motion.frame_rate, start, end)
    arrays = vars(motion.arrays)
    return motion.changed(**{name: array[rows] for name, array in arrays.items() if array is not None})


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
