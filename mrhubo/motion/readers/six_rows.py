"""Rows of a place and rotations of six numbers, as models that make dances of music read and write them.

FineDance's are the place of the root (3) and the first two rows of the matrices of SMPL-X's 52 joints without the face,
the root first; or the same after how much each heel and toe touches the floor (4). EDGE's are so, of SMPL's 24 joints.
All their motions have 30 frames a second (https://github.com/li-ronghui/FineDance, data/code/pre_motion.py;
https://github.com/Stanford-TML/EDGE, dataset/dance_dataset.py).

Legend: T frames, J joints, X numbers of a row.
"""

from __future__ import annotations

import numpy as np

from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.other_rotations import from_rows
from mrhubo.motion.readers.rate import rate_of_all
from mrhubo.motion.readers.rotations import Form
from mrhubo.motion.readers.rows import rows_in
from mrhubo.motion.readers.tracks import Kind, SmplArrays, motion_of
from mrhubo.motion.readers.world import ANY_WORLD

_KINDS = {
    315: ("FineDance's", 0, 52, "smplx"),
    319: ("FineDance's", 4, 52, "smplx"),
    151: ("EDGE's", 4, 24, "smpl"),
}
"""By the width of a row: whose it is, numbers before the place, joints, and the body model."""
_RATE = 30.0
_CROOKED = 0.05
"""How far lengths of rows are from 1, and their products from 0, of numbers that are rows of rotations."""


def read_six_rows(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads rows (T, X) or (1, T, X); None of anything else.

    Raises:
        NoMotion: the numbers are no rotations, as those of rows that were normalised.
        UserError: they are no motion.
    """
    row_TX = rows_in(tree, _KINDS)
    if row_TX is None:
        return None
    width, row_TX = row_TX.shape[1], row_TX.astype(np.float64)
    who, before, joints, family = _KINDS[width]
    place_T3, six_TJ6 = row_TX[:, before : before + 3], row_TX[:, before + 3 :].reshape(len(row_TX), joints, 6)
    if not are_rotations(six_TJ6):
        raise NoMotion(
            f"{tree.path}: has rows of {width} numbers, as {who} have, whose rotations are none; if they are"
            " normalised, turn them back first"
        )
    notes = options.of_one()
    rate = rate_of_all(_RATE, f"all of {who} motions have", options, notes)
    arrays = SmplArrays("rows", from_rows(six_TJ6), Form(joints, True), 1, None, place_T3)
    return motion_of(tree.path, arrays, Kind(f"{who} rows (T, {width})", family, ANY_WORLD), rate, notes)


def are_rotations(six_TJ6: np.ndarray) -> bool:
    """Whether numbers are two rows of rotations each, but for a few frames."""
    first_TJ3, second_TJ3 = six_TJ6[..., :3], six_TJ6[..., 3:]
    lengths_TJ = np.stack([np.linalg.norm(row_TJ3, axis=-1) for row_TJ3 in (first_TJ3, second_TJ3)])
    products_TJ = np.abs((first_TJ3 * second_TJ3).sum(-1))
    return bool((np.abs(lengths_TJ - 1) < _CROOKED).mean() > 0.9 and (products_TJ < _CROOKED).mean() > 0.9)
