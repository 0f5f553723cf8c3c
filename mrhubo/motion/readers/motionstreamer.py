"""MotionStreamer's and MotionMillion's features, which models that make motions of texts answer with: rows (T, 272).

A row has how the root goes along the floor (2) and how the heading turns (6), both since the row before and as that
heading sees it; where SMPL's 22 joints are from above the heading (66), how fast they go (66), and how they turn (132),
the root in the heading, the others in their parents. Turns are the first two rows of matrices (6). 30 frames a second
(https://github.com/Li-xingXiao/272-dim-Motion-Representation). World: y up [m].

Legend: T frames, J = 22 joints.
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
from mrhubo.motion.readers.six_rows import are_rotations
from mrhubo.motion.readers.tracks import Kind, SmplArrays, motion_of
from mrhubo.motion.readers.world import Y_UP

_WIDTH, _JOINTS = 272, 22
_STEP, _HEADING, _HEIGHT, _TURNS = slice(0, 2), slice(2, 8), 9, slice(140, 272)
_RATE = 30.0


def read_streamed(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads rows (T, 272) or (1, T, 272); None of anything else.

    Raises:
        NoMotion: the numbers are no rotations, as those of rows that were normalised.
        UserError: they are no motion.
    """
    row_TX = rows_in(tree, (_WIDTH,))
    if row_TX is None:
        return None
    row_TX = row_TX.astype(np.float64)
    six_TJ6, heading_T6 = row_TX[:, _TURNS].reshape(len(row_TX), _JOINTS, 6), row_TX[:, _HEADING]
    if not are_rotations(six_TJ6) or not are_rotations(heading_T6[:, None]):
        raise NoMotion(
            f"{tree.path}: has rows of {_WIDTH} numbers, as MotionStreamer's have, whose rotations are none; if they"
            " are normalised, multiply them by its Std.npy and add its Mean.npy"
        )
    turn_TJ33, to_world_T33 = from_rows(six_TJ6), _headings(from_rows(heading_T6)).mT
    turn_TJ33[:, 0] = to_world_T33 @ turn_TJ33[:, 0]
    step_T3 = np.zeros((len(row_TX), 3))
    step_T3[:, [0, 2]] = row_TX[:, _STEP]
    step_T3[1:] = (to_world_T33[:-1] @ step_T3[1:, :, None])[..., 0]
    place_T3 = np.cumsum(step_T3, axis=0)
    place_T3[:, 1] = row_TX[:, _HEIGHT]
    notes = options.of_one()
    rate = rate_of_all(_RATE, "all of MotionStreamer's motions have", options, notes)
    arrays = SmplArrays("rows", turn_TJ33, Form(_JOINTS, True), 1, None, place_T3)
    return motion_of(tree.path, arrays, Kind(f"MotionStreamer's rows (T, {_WIDTH})", "smpl", Y_UP), rate, notes)


def _headings(since_T33: np.ndarray) -> np.ndarray:
    """How the world is turned to each heading (T, 3, 3), of how it turns since the frame before."""
    found = [since_T33[0]]
    for since_33 in since_T33[1:]:
        found.append(since_33 @ found[-1])
    return np.stack(found)
