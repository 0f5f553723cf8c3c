"""A motion of what was read from a file of SMPL's family.

Legend: T frames, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import math
from dataclasses import replace

from mrhubo.body.arm_axes import elbow_tilt, untilt_arms
from mrhubo.body.rest_directions import from_family
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.world import find_up

BLOCK = 65_536
"""Frames that are read and converted at a time."""
_LEVEL = math.radians(1.0)
"""Tilts of elbows' axes up to this stay: an angle that says nothing."""


def to_our_rest(motion: Motion) -> Motion:
    """The motion, whose rotations refer to its family's rest pose, with those that refer to ours.

    Elbows of a body that was fitted are no hinges; those of a converted skeleton are, about whatever axis it has. A
    motion without a family may be of such a one.
    """
    if motion.family:
        for part in motion.local_TJ33.split(BLOCK):
            part.copy_(from_family(part, motion.family))
        return motion
    tilt = elbow_tilt(motion.local_TJ33)
    if tilt is None or abs(tilt) <= _LEVEL:
        return motion
    note = f"the elbows' axes are tilted by {math.degrees(tilt):.0f} degrees from SMPL's: taken out"
    return replace(motion, local_TJ33=untilt_arms(motion.local_TJ33, tilt), notes=(*motion.notes, note))


def upright(motion: Motion, worlds: tuple[str, ...]) -> tuple[Motion, str]:
    """The motion, whose root is as the file has it, in a world whose y axis is up, and which way was up, in words.

    Args:
        motion: its root's place is left out where its rotation is not known, as nothing tells the up axis.
        worlds: those of `mrhubo.motion.readers.world` that the file's may be.
    """
    rotation_T33, position_T3 = motion.root_rotation_T33, motion.root_position_T3
    if rotation_T33 is None:
        return replace(motion, root_position_T3=None), ""
    up, turn_33 = find_up(rotation_T33[:, :, 1], worlds)
    turned = replace(
        motion,
        root_rotation_T33=turn_33 @ rotation_T33,
        root_position_T3=None if position_T3 is None else position_T3 @ turn_33.T,
    )
    return turned, f", {up}"
