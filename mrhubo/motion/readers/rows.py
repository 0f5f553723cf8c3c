"""Motions in a single array whose rows are known by their length: those of Motion-X and of PHUMA."""

from __future__ import annotations

from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate
from mrhubo.motion.readers.rotations import Form
from mrhubo.motion.readers.tracks import Kind, SmplArrays, motion_of
from mrhubo.motion.readers.world import ANY_WORLD

_MOTION_X = 322
_MOTION_X_RATE = 30.0
_PHUMA = (69, 73, 79)
"""Without more, with how much each foot touches the ground, with the body's shape."""
_BODY = Form(21, False)


def read_rows(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads SMPL-X's parameters from an array (T, 322) or (T, 69); None of anything else.

    Motion-X's rows are the root's rotation (3), the body's (63), hands, jaw, face, then at 309 the place of the root
    (3) and the body's shape (10); it says of all its motions that they have 30 frames a second
    (https://github.com/IDEA-Research/Motion-X). PHUMA's are the place of the root (3), its rotation (3) and the body's
    (63), then perhaps more (https://github.com/DAVIAN-Robotics/PHUMA).

    Raises:
        UserError: the numbers are no motion, or the frame rate is not known.
    """
    shape = tree.shape()
    if shape is None or len(shape) != 2 or not shape[0]:
        return None
    rows_TX, notes = tree.array(), []
    if shape[1] == _MOTION_X:
        arrays = SmplArrays("rows", rows_TX[:, 3:66], _BODY, 0, rows_TX[:, :3], rows_TX[:, 309:312], rows_TX[:, 312:])
        rate = _MOTION_X_RATE if options.rate is None else float(options.rate)
        if options.rate is None:
            notes.append(f"{rate:g} frames a second, as Motion-X says of all its motions; --rate says otherwise")
        return motion_of(tree.path, arrays, Kind("Motion-X rows (T, 322)", "smplx", ANY_WORLD), rate, notes)
    if shape[1] in _PHUMA:
        betas = rows_TX[:, 69:] if shape[1] == max(_PHUMA) else None
        arrays = SmplArrays("rows", rows_TX[:, 6:69], _BODY, 0, rows_TX[:, 3:6], rows_TX[:, :3], betas)
        kind = Kind(f"PHUMA rows (T, {shape[1]})", "smplx", ANY_WORLD)
        return motion_of(tree.path, arrays, kind, asked_rate(tree.path, options), notes)
    return None
