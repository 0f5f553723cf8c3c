"""A motion of what was read from a file of SMPL's family.

Legend: T frames, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.body.arm_axes import elbow_tilt, untilt_arms
from mrhubo.body.joints import JOINT_NAMES, OFFSETS_J3, PARENTS
from mrhubo.body.level_feet import Feet, rolled_up, standing_up, turn_feet
from mrhubo.body.rest_directions import FAMILIES, from_family
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.units import find_unit
from mrhubo.motion.readers.world import find_world

BLOCK = 65_536
"""Frames that are read and converted at a time."""
MAX_FRAMES = 2_000_000
"""Longest motion that is read (four and a half hours at 120 frames a second, 1.5 GB as matrices)."""
MAX_ROOT_TURN = 8 * math.pi
"""No root's axis-angle number is that large [rad]: a person may turn round some times; degrees are larger."""
LARGEST_BETA = 1e6
"""No number of a body's shape is that large."""
_SEEN = 500
"""About how many frames tell which way is up."""
_LOOKS = 30.0
"""How often a second it is looked whether feet stand: more often, those that swing would seem to."""
_UPRIGHT_M = 0.6
"""How far an ankle is under the pelvis of who stands [m], and not sits or lies."""
_FEET = (JOINT_NAMES.index("left_foot"), JOINT_NAMES.index("right_foot"))
"""Where toes begin, of all joints."""
_FEWEST_STEPS, _MOST_STEPS = 10, 2_000
"""Frames that tell whether feet slide."""
_SLIDES, _STEADIER = 0.1, 0.6
"""Speed [m/s] of the lower foot, in half of the frames, of who slides; and by what that is smaller of who does not."""
_LEVEL = math.radians(1.0)
"""Tilts of elbows' axes up to this stay: an angle that says nothing."""


def to_our_rest(motion: Motion) -> Motion:
    """The motion, whose rotations refer to its family's rest pose, with those that refer to ours.

    Elbows of a body that was fitted are no hinges; those of a converted skeleton are, about whatever axis it has. A
    motion without a family may be of such a one, whose feet may be rolled where they stand.
    """
    if motion.family:
        local_TJ33 = motion.arrays.local_TJ33
        for start in range(0, len(motion), BLOCK):
            rows = slice(start, start + BLOCK)
            local_TJ33[rows] = from_family(local_TJ33[rows], motion.family)
        return motion
    tilt = elbow_tilt(motion.arrays.local_TJ33)
    if tilt is None or abs(tilt) <= _LEVEL:
        return motion
    local_TJ33 = untilt_arms(motion.arrays.local_TJ33, tilt)
    notes = [f"the elbows' axes are tilted by {math.degrees(tilt):.0f} degrees from SMPL's: taken out"]
    root_T33 = motion.arrays.root_rotation_T33
    feet = None if root_T33 is None else standing_feet(root_T33, local_TJ33, motion.frame_rate)
    if feet is not None and (up := rolled_up(feet)) is not None:
        left, right = (math.degrees(math.acos(up_3[1])) for up_3 in up)
        notes.append(
            f"the feet stand rolled, the left one by {left:.0f} and the right one by {right:.0f} degrees: taken out"
        )
        local_TJ33 = turn_feet(local_TJ33, up)
    return motion.changed(local_TJ33=local_TJ33, notes=(*motion.notes, *notes))


def standing_feet(root_T33: np.ndarray, local_TJ33: np.ndarray, frame_rate: float) -> Feet:
    """The world's up in the frame of each foot, in some frames (X, 3) in which somebody upright stands on it.

    Args:
        root_T33: rotations (T, 3, 3) of the pelvis in the world, y up.
        local_TJ33: local rotations (T, 21, 3, 3).
        frame_rate: frames per second.
    """
    few = slice(None, None, max(1, round(frame_rate / _LOOKS)))
    return standing_up(root_T33[few], local_TJ33[few], _UPRIGHT_M)


def in_metres(motion: Motion, where: str, beyond: float = 0.0) -> Motion:
    """The motion, whose y axis is up, with places in metres, and a note where the file's were not.

    Args:
        motion: as the file has it.
        where: what the file calls places, for the beginning of a sentence.
        beyond: as of `find_unit`.
    """
    place_T3 = motion.arrays.root_position_T3
    unit = None if place_T3 is None else find_unit(place_T3, motion.frame_rate, beyond)
    if place_T3 is None or unit is None or _steps_in_metres(motion, unit[1]):
        return motion
    note = f"{where} is in {unit[0]}, by how fast or how high the root is: told in metres"
    return motion.changed(root_position_T3=place_T3 * np.float32(unit[1]), notes=(*motion.notes, note))


def _steps_in_metres(motion: Motion, unit: float) -> bool:
    """Whether the lower foot of somebody who walks keeps still if places are in metres, and slides if they are in a
    smaller unit [m]: who walks high above a floor at 0 is told from who stands on it.
    """
    root_T33, place_T3 = motion.arrays.root_rotation_T33, motion.arrays.root_position_T3
    if root_T33 is None or place_T3 is None or len(motion) < _FEWEST_STEPS:
        return False
    few = slice(0, _MOST_STEPS)
    foot_TF3 = _joints(root_T33[few], motion.arrays.local_TJ33[few])[:, _FEET]
    lower_T = foot_TF3[:-1, :, 1].argmin(axis=1)
    seen_T3 = np.diff(foot_TF3, axis=0)[np.arange(len(lower_T)), lower_T]
    step_T3 = np.diff(place_T3[few], axis=0)
    as_metres, as_unit = (
        float(np.median(np.linalg.norm((seen_T3 + metres * step_T3)[:, [0, 2]], axis=1))) * motion.frame_rate
        for metres in (1.0, unit)
    )
    return as_unit > _SLIDES and as_metres < _STEADIER * as_unit


def upright(motion: Motion, worlds: tuple[str, ...], rest: str) -> Motion:
    """The motion, whose root is as the file has it, in a world whose y axis is up; its source says which way was up.

    Args:
        motion: its root's place is left out where its rotation is not known, as nothing tells the up axis.
        worlds: those of `mrhubo.motion.readers.world` that the file's may be.
        rest: what its rotations refer to, for the end of its source.
    """
    rotation_T33, position_T3 = motion.arrays.root_rotation_T33, motion.arrays.root_position_T3
    if rotation_T33 is None:
        return motion.changed(root_position_T3=None, source=f"{motion.source}; {rest}")
    joints_TK3 = None
    if position_T3 is not None:
        few = slice(None, None, 1 + len(motion) // _SEEN)
        joints_TK3 = _joints(rotation_T33[few], motion.arrays.local_TJ33[few]) + position_T3[few, None]
    known = [FAMILIES[motion.family].pelvis] if motion.family else [family.pelvis for family in FAMILIES.values()]
    origins = (*known, *([] if motion.family else [(0.0, 0.0, 0.0)]))
    up, turn_33, why = find_world(rotation_T33[:, :, 1], position_T3, worlds, joints_TK3, origins)
    return motion.changed(
        root_rotation_T33=turn_33 @ rotation_T33,
        root_position_T3=None if position_T3 is None else position_T3 @ turn_33.T,
        source=f"{motion.source}, {up}; {rest}",
        notes=(*motion.notes, why) if why else motion.notes,
    )


def _joints(root_T33: np.ndarray, local_TJ33: np.ndarray) -> np.ndarray:
    """Places (T, 22, 3) [m] of the joints of our skeleton from the pelvis, in the root's world."""
    rotations, places = [root_T33], [np.zeros((len(root_T33), 3), root_T33.dtype)]
    for joint, offset_3 in enumerate(OFFSETS_J3, start=1):
        carrier_T33 = rotations[PARENTS[joint]]
        places.append(places[PARENTS[joint]] + carrier_T33 @ offset_3)
        rotations.append(carrier_T33 @ local_TJ33[:, joint - 1])
    return np.stack(places, axis=1)
