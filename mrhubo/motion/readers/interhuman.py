"""Rows of two people's joints: InterHuman's data, and what InterGen and its kin make of it.

A row of the data is a person's: 62 joints, SMPL's 22 first, then rotations of 51 joints, 492 numbers, with z up. A row
of the models is 22 joints, how fast each goes, rotations, and which feet stand, 262 numbers; both people's are 524, or
an axis of two. All have 30 frames a second (https://github.com/tr3e/InterGen, utils/preprocess.py and utils/utils.py).
Where joints are is read; the rotations refer to a skeleton that is not told.

Legend: T frames, P people, X numbers of a row.
"""

from __future__ import annotations

import numpy as np

from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.keypoints import fits_a_body, motion_of_points
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import rate_of_all
from mrhubo.motion.readers.tracks import Person, choose

_ONE, _BOTH = (492, 262), 524
_JOINTS = 22
_RATE = 30.0
_SET = "SMPL's body"


def read_interhuman(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads one of the people in rows (T, X), (P, T, X) or (T, P, X); None of anything else.

    Raises:
        NoMotion: the joints make no body, as those of rows that were normalised.
        UserError: there is nobody of the name that is asked for.
    """
    shape = tree.shape()
    if shape is None or len(shape) not in (2, 3) or 0 in shape or shape[-1] not in (*_ONE, _BOTH):
        return None
    row_PTX = _people_first(tree.array())
    if row_PTX is None:
        return None
    notes = options.of_one() if len(row_PTX) == 1 else []
    number = 0
    if len(row_PTX) > 1:
        people = [Person(str(person), row_PTX.shape[1]) for person in range(len(row_PTX))]
        number = int(choose(tree.path, people, options, notes).person)
    point_TJ3 = row_PTX[number, :, : 3 * _JOINTS].reshape(row_PTX.shape[1], _JOINTS, 3).astype(np.float64)
    if not np.isfinite(point_TJ3).all() or not fits_a_body(point_TJ3, _SET):
        raise NoMotion(
            f"{tree.path}: has rows of {shape[-1]} numbers, as InterHuman's and InterGen's have, but they make no body;"
            " if they are normalised, turn them back by InterGen's global_std.npy and global_mean.npy"
        )
    rate = rate_of_all(_RATE, "all of InterHuman's motions have", options, notes)
    found = Keypoints(point_TJ3, list(SETS[_SET]), None, rate, f"of InterHuman's rows (T, {shape[-1]})", notes)
    return motion_of_points(tree.path, found, options)


def _people_first(row_X: np.ndarray) -> np.ndarray | None:
    """Rows (P, T, X) of one person or two; None of anything else."""
    if row_X.shape[-1] == _BOTH:
        if row_X.ndim == 3 and row_X.shape[0] != 1:
            return None
        both_TX = row_X.reshape(-1, 2, _BOTH // 2)
        return both_TX.swapaxes(0, 1)
    if row_X.ndim == 2:
        return row_X[None]
    if row_X.shape[0] in (1, 2):
        return row_X
    return row_X.swapaxes(0, 1) if row_X.shape[1] in (1, 2) else None
