"""SMPL's rotations in an array without a name, as who saves just the poses has them: `np.save("poses.npy", poses)`.

Legend: T frames, K joints.
"""

from __future__ import annotations

import numpy as np

from mrhubo.body.joints import PARENTS
from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.family import family_of
from mrhubo.motion.readers.keypoint_fit import NONSENSE, fitting_sets
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate
from mrhubo.motion.readers.rotations import Form, are_crooked, find_form
from mrhubo.motion.readers.rows import STIFF_TURN, stiff_turn
from mrhubo.motion.readers.tracks import Kind, SmplArrays, motion_of
from mrhubo.motion.readers.world import ANY_WORLD

_JOINTS = (22, 24, 52, 55)
"""Of the body, SMPL, SMPL-H and SMPL-X, the root first."""
_SAMPLES = 200
"""Frames that are looked at."""
_UNSTEADY = 0.8
"""How much numbers change from frame to frame at most, as a share of how much they do at all: by chance, 1.4."""
_RIGID = 0.15
"""How much a bone's length varies at most, as a share of it, of points that somebody estimated."""


def read_bare_poses(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads axis-angle (T, 3 K) or (T, K, 3), or matrices (T, 9 K) or (T, K, 3, 3), of 22, 24, 52 or 55 joints, the
    root first, in the order of SMPL's family, in which they are the same; None of anything else, points among them.

    Raises:
        UserError: the numbers are no motion, or the frame rate is not given.
    """
    shape = tree.shape()
    if shape is None or len(shape) < 2:
        return None
    if len(shape) > 2 and shape[0] == 1:
        shape = shape[1:]
    frames, form = shape[0], find_form(shape, _JOINTS)
    if form is None or not frames:
        return None
    rows_TX = tree.array().reshape(frames, form.width)
    few_TX = rows_TX[:: 1 + frames // _SAMPLES].astype(np.float64)
    steady = form.matrices or _is_steady(rows_TX[frames // 2 :][:_SAMPLES])
    if not steady or not _are_rotations(few_TX, form, len(shape) == 2):
        return None
    notes = options.of_one()
    numbers = "matrices" if form.matrices else "axis-angle"
    kind = Kind(f"{numbers} of {form.joints} joints, without a name", family_of("", form.joints, (), None), ANY_WORLD)
    arrays = SmplArrays("rows", rows_TX, form, 1)
    return motion_of(tree.path, arrays, kind, asked_rate(tree.path, options), notes)


def _are_rotations(rows_TX: np.ndarray, form: Form, flat: bool) -> bool:
    """Whether numbers are rotations: of matrices all, of axis-angle those of joints that hardly turn are small; and
    they are no points of a body.
    """
    value_TKX = rows_TX.reshape(len(rows_TX), form.joints, form.numbers)
    if form.matrices:
        return not are_crooked(value_TKX.reshape(*value_TKX.shape[:2], 3, 3)).any()
    body_TJ3 = value_TKX[:, 1:22]
    if not body_TJ3.any():  # nothing but 0 may be anything
        return False
    if not stiff_turn(body_TJ3) < STIFF_TURN:  # nor where something is not finite
        return False
    misfits = [misfit for misfit, _ in fitting_sets(value_TKX)]
    if min(misfits, default=np.inf) < NONSENSE:
        return False
    if flat or np.isinf(misfits).all():
        return True
    length_TJ = np.linalg.norm(body_TJ3 - value_TKX[:, PARENTS[1:22]], axis=-1)
    varies_J = length_TJ.std(axis=0) / np.maximum(length_TJ.mean(axis=0), 1e-6)
    return float(np.median(varies_J)) > _RIGID


def _is_steady(rows_TX: np.ndarray) -> bool:
    """Whether numbers follow each other as those of a motion, and not as those of chance."""
    spread = np.abs(rows_TX - rows_TX.mean(axis=0)).mean()
    return len(rows_TX) < 2 or not np.abs(np.diff(rows_TX, axis=0)).mean() > _UNSTEADY * spread
