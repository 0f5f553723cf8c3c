"""Motions in a single array whose rows are known by their length: those of Motion-X, of TalkSHOW, of PHUMA, SMPL's
`body_pose`, and SMPL's pose with the shape.

Legend: T frames, X numbers of a row.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.assemble import MAX_ROOT_TURN
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate, rate_of_all
from mrhubo.motion.readers.rotations import Form, to_matrices
from mrhubo.motion.readers.tracks import Kind, SmplArrays, motion_of
from mrhubo.motion.readers.world import ANY_WORLD, CAMERAS, find_up

_MOTION_X = 322
_MOTION_X_RATE = 30.0
_TALKSHOW = 265
_TALKSHOW_RATE = 30.0
_PHUMA = (69, 73, 79)
"""Without more, with how much each foot touches the ground, with the body's shape."""
_CONTACTS = 73
_WITH_SHAPE = 85
_BODY, _WITH_HANDS = Form(21, False), Form(23, False)
_STIFF = tuple(joint - 1 for joint in (3, 6, 9, 12, 13, 14, 15))
"""Joints of spine, neck, collars and head, which turn less than those of limbs."""
_CLEARLY = 1.8
"""How much more the stiff joints turn as PHUMA's than as those of `body_pose`, at most in PHUMA's rows. Of 464 clips of
CMU's written as PHUMA's, 99 in 100 have up to 1.2; of the same as `body_pose`, 99 in 100 have 2.1 or more."""
STIFF_TURN = 0.8
"""How much [rad] the stiff joints turn at most, on the mean: of numbers drawn by chance, 1.6."""
_NEARLY_STILL = 0.02
"""Turns [rad] that say nothing."""
_PELVIS_M = (0.2, 2.2)
"""How high a pelvis is above the floor, with room for SMPL-X's origin above it."""
_UPRIGHT = 0.5
"""Cosine between the body's own up axis, on the mean, and the world's."""


def read_rows(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads SMPL's or SMPL-X's parameters from rows of 322, 265, 69, 73, 79 or 85 numbers, (T, X) or (1, T, X); None
    of anything else.

    Motion-X's rows are the root's rotation (3), the body's (63), hands, jaw, face, then at 309 the place of the root
    (3) and the body's shape (10); it says of all its motions that they have 30 frames a second
    (https://github.com/IDEA-Research/Motion-X). TalkSHOW's are jaw and eyes (9), the root's rotation (3), the body's
    (63), hands and face; its motions have 30 frames a second (https://github.com/yhw-yhw/TalkSHOW, scripts/demo.py).
    PHUMA's are the place of the root (3), its rotation (3) and the body's (63), then perhaps more
    (https://github.com/DAVIAN-Robotics/PHUMA). SMPL's `body_pose`, 23 joints without the root, is as wide, and with the
    shape as wide as PHUMA's with it; which it is, is told by what is in it. Rows of 85 are SMPL's pose (72), place and
    shape, as MotionStreamer's recovered ones, or a camera (3), pose and shape, as HMR's.

    Raises:
        UserError: the numbers are no motion, or may be of either kind; or the frame rate is not known.
    """
    rows_TX = rows_in(tree, (_MOTION_X, _TALKSHOW, _WITH_SHAPE, *_PHUMA))
    if rows_TX is None:
        return None
    width, notes = rows_TX.shape[1], options.of_one()
    if width == _MOTION_X:
        arrays = SmplArrays("rows", rows_TX[:, 3:66], _BODY, 0, rows_TX[:, :3], rows_TX[:, 309:312], rows_TX[:, 312:])
        rate = rate_of_all(_MOTION_X_RATE, "Motion-X says of all its motions", options, notes)
        return motion_of(tree.path, arrays, Kind("Motion-X rows (T, 322)", "smplx", ANY_WORLD), rate, notes)
    if width == _TALKSHOW:
        if not stiff_turn(rows_TX[:, 12:75].astype(np.float64)) < STIFF_TURN:  # any features may have as many numbers
            return None
        arrays = SmplArrays("rows", rows_TX[:, 12:75], _BODY, 0, rows_TX[:, 9:12])
        rate = rate_of_all(_TALKSHOW_RATE, "TalkSHOW's motions have", options, notes)
        return motion_of(tree.path, arrays, Kind("TalkSHOW's rows (T, 265)", "smplx", ANY_WORLD), rate, notes)
    if width == _WITH_SHAPE:
        pose_at = _pose_at(rows_TX)
        if pose_at is None:  # any features may have as many numbers
            return None
        place_T3 = rows_TX[:, 72:75] if pose_at == 0 else None
        arrays = SmplArrays(
            "rows", rows_TX[:, pose_at : pose_at + 72], Form(24, False), 1, None, place_T3, rows_TX[:, 75:]
        )
        kind = Kind("rows (T, 85) of SMPL's pose and shape", "smpl", ANY_WORLD if pose_at == 0 else CAMERAS)
        return motion_of(tree.path, arrays, kind, asked_rate(tree.path, options), notes)
    betas = rows_TX[:, 69:] if width == max(_PHUMA) else None
    if width == _CONTACTS or _is_phuma(tree, rows_TX):
        arrays = SmplArrays("rows", rows_TX[:, 6:69], _BODY, 0, rows_TX[:, 3:6], rows_TX[:, :3], betas)
        kind = Kind(f"PHUMA rows (T, {width})", "smplx", ANY_WORLD)
    else:
        arrays = SmplArrays("rows", rows_TX[:, :69], _WITH_HANDS, 0, betas=betas)
        kind = Kind(f"rows (T, {width}) of SMPL's body_pose", "smpl", ANY_WORLD)
        notes.append(
            "taken for SMPL's body_pose, without a root: as PHUMA's rows, which are as wide, the first numbers were no"
            " place of a pelvis, and spine and neck turned as arms and legs do"
        )
    return motion_of(tree.path, arrays, kind, asked_rate(tree.path, options), notes)


def rows_in(tree: Tree, widths: Collection[int]) -> np.ndarray | None:
    """The rows (T, X) of an array (T, X) or (1, T, X) that are as wide as one of some widths; None of anything else."""
    shape = tree.shape()
    if shape is not None and len(shape) == 3 and shape[0] == 1:
        shape = shape[1:]
    if shape is None or len(shape) != 2 or not shape[0] or shape[1] not in widths:
        return None
    return tree.array().reshape(shape)


def _is_phuma(tree: Tree, rows_TX: np.ndarray) -> bool:
    """Whether rows (T, 69 or more) are PHUMA's, and no `body_pose`.

    Raises:
        UserError: they may be either.
    """
    row_TX = rows_TX[:, :69].astype(np.float64)
    more = (stiff_turn(row_TX[:, 6:]) + _NEARLY_STILL) / (stiff_turn(row_TX[:, :63]) + _NEARLY_STILL)
    stands = _stands(row_TX[:, :3], row_TX[:, 3:6])
    if not np.isfinite(more) or more < (_CLEARLY if stands else 1.0):  # who reads them says what is not finite
        return True
    if more > _CLEARLY and not stands:
        return False
    raise UserError(
        f"{tree.path}: has rows of {rows_TX.shape[1]} numbers, which may be PHUMA's (place, root, 21 joints) or SMPL's"
        " body_pose (23 joints, no root), and its numbers fit neither clearly; save an .npz with 'transl',"
        " 'global_orient' and 'body_pose' (frames, 63), or with 'body_pose' (frames, 69) alone"
    )


def _pose_at(rows_TX: np.ndarray) -> int | None:
    """Where in rows (T, 85) the pose begins: at once, or after a camera; None where neither is clear."""
    first, second = (stiff_turn(rows_TX[:, start : start + 63].astype(np.float64)) + _NEARLY_STILL for start in (3, 6))
    if not min(first, second) < STIFF_TURN or max(first, second) < _CLEARLY * min(first, second):
        return None
    return 0 if first < second else 3


def stiff_turn(body_TX: np.ndarray) -> float:
    """How much the joints that are stiff turn [rad], on the mean, in rows (T, 63) of the body's 21 joints."""
    joint_TJ3 = body_TX.reshape(len(body_TX), -1, 3)
    return float(np.linalg.norm(joint_TJ3[:, _STIFF], axis=-1).mean())


def _stands(place_T3: np.ndarray, root_T3: np.ndarray) -> bool:
    """Whether a pelvis is as high above the floor as that of somebody who is upright, in any world."""
    rotation_T133 = to_matrices(root_T3, Form(1, False), MAX_ROOT_TURN)
    if rotation_T133 is None or not np.isfinite(place_T3).all():
        return False
    up_T3 = rotation_T133[:, 0, :, 1]
    _, turn_33 = find_up(up_T3, ANY_WORLD)
    low, high = _PELVIS_M
    height = float(np.median(place_T3 @ turn_33[1]))
    return low <= height <= high and float((up_T3 @ turn_33[1]).mean()) > _UPRIGHT
