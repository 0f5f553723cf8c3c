"""Frames that repeat the one before to the last digit while the person moves: a motion of 30 frames a second that was
stored at 120, or one whose recorder lost frames and stored the last one again. A robot would stop and go with them. So
they go from the frame before to the next one that is new.

Who stands still repeats frames too. There the next one is as good as the same, and all stays as it is.

Legend: T frames, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.masks import stretches
from mrhubo.motion.gaps import fill_numbers, fill_rotations
from mrhubo.motion.motion import Motion

LONGEST_S = 0.15
"""For longer [s] somebody stood still, or is a figure that was drawn so."""
_MOVED = 0.01
"""What differs by so much from one frame to the next has moved: numbers of rotations, half a degree, and metres."""
_BLOCK = 65_536
"""Frames that are compared at a time."""


def fill_repeats(motion: Motion) -> Motion:
    """The motion with frames in between in place of repeated ones, and a note; itself, if none are repeated."""
    arrays = motion.arrays
    told = [arrays.local_TJ33, arrays.root_rotation_T33, arrays.root_position_T3]
    parts = [part.reshape(len(motion), -1) for part in told if part is not None]
    if len(motion) < 3:
        return motion
    known_T = np.ones(len(motion), dtype=bool)
    for start in range(1, len(motion), _BLOCK):
        rows, before = slice(start, start + _BLOCK), slice(start - 1, min(start + _BLOCK, len(motion)) - 1)
        known_T[rows] = np.any([(part[rows] != part[before]).any(axis=1) for part in parts], axis=0)
    for run in stretches(~known_T):
        moves = run.stop < len(motion) and any(_moves(part[run.start - 1], part[run.stop]) for part in parts)
        if not moves or (run.stop - run.start) / motion.frame_rate > LONGEST_S:
            known_T[run] = True
    if known_T.all():
        return motion
    local_TJ33, root_T33, place_T3 = arrays.local_TJ33.copy(), arrays.root_rotation_T33, arrays.root_position_T3
    for joint in range(local_TJ33.shape[1]):
        local_TJ33[:, joint] = fill_rotations(local_TJ33[:, joint], known_T)
    return motion.changed(
        local_TJ33=local_TJ33,
        root_rotation_T33=None if root_T33 is None else fill_rotations(root_T33, known_T),
        root_position_T3=None if place_T3 is None else fill_numbers(place_T3, known_T),
        notes=(*motion.notes, f"{int((~known_T).sum())} frames repeat the one before while the person moves: they now "
               "go from one to the next"),
    )  # fmt: skip


def _moves(one_X: np.ndarray, other_X: np.ndarray) -> bool:
    return bool((np.abs(other_X - one_X) > _MOVED).any())
