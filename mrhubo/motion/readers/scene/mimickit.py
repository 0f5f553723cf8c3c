"""Motions of MimicKit's humanoid, as its `humanoid_walk.pkl`.

A pickle of a dictionary: `fps`, `loop_mode`, `frames` (T, 34): where the root is [m] and how it is turned; then chest,
neck, right shoulder, right elbow and the same of the left side, right hip, right knee, right ankle and the same of the
left side, each in the axes of the part before: knees and elbows an angle [rad], all else axis times angle [rad]
(https://github.com/xbpeng/MimicKit, README.md, "Motion Data"; joints in data/assets/humanoid/humanoid.xml). Axes of all
parts at rest, which is a T-pose: x forward, y left, z up.

Legend: T frames, N joints.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.assemble import MAX_FRAMES
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.scene.turned import Skeleton, turned_motion

_WIDTH = 34
_SMPL = 75
"""Numbers of a row of SMPL's humanoid, which `mrhubo.motion.readers.simulated` reads."""
_FEWEST = 7
"""A root's place and turn, and something that moves."""
_LARGEST = 4 * np.pi
"""No joint is turned as far [rad]; degrees are."""
_ARM, _LEG = ("upper_arm", "lower_arm", "hand"), ("thigh", "shin", "foot")
_ACROSS = {"lower_arm": (0.0, 0.0, 1.0), "shin": (0.0, 1.0, 0.0)}
"""About what elbows and knees turn."""


def _parts() -> list[tuple[str, str, tuple[float, float, float]]]:
    """What moves, in the order of a row: name, what it hangs on, and where [m]."""
    parts = [("pelvis", "", (0.0, 0.0, 0.0)), ("torso", "pelvis", (0.0, 0.0, 0.236151))]
    parts.append(("head", "torso", (0.0, 0.0, 0.223894)))
    for limb, carrier, place, bones in (
        (_ARM, "torso", (-0.02405, 0.18311, 0.2435), ((0.0, 0.274788, 0.0), (0.0, 0.258947, 0.0))),
        (_LEG, "pelvis", (0.0, 0.084887, 0.0), ((0.0, 0.0, -0.421546), (0.0, 0.0, -0.40987))),
    ):
        for side, sign in (("right", -1.0), ("left", 1.0)):
            above = carrier
            for name, (x, y, z) in zip(limb, (place, *bones), strict=True):
                parts.append((f"{side}_{name}", above, (x, sign * y, z)))
                above = f"{side}_{name}"
    return parts


_PARTS = _parts()
_NAMES = [name for name, _, _ in _PARTS]
_SKELETON = Skeleton(
    _NAMES,
    [_NAMES.index(above) if above else -1 for _, above, _ in _PARTS],
    np.array([place for _, _, place in _PARTS]),
    "its T-pose",
)


def frames_of(tree: Tree) -> np.ndarray | None:
    """MimicKit's rows (T, X); None of anything else.

    Raises:
        UserError: they are too many, or hold NaN or infinite numbers.
    """
    if not {"fps", "frames", "loop_mode"} <= set(tree.keys):
        return None
    row_TX = tree.find_array("frames")
    if row_TX is None or row_TX.ndim != 2 or row_TX.shape[1] < _FEWEST:
        return None
    if len(row_TX) > MAX_FRAMES:
        raise UserError(f"{tree.path}: 'frames' has {len(row_TX):,} rows; at most {MAX_FRAMES:,} are read")
    if not np.isfinite(row_TX).all():
        raise UserError(f"{tree.path}: 'frames' holds NaN or infinite numbers")
    return row_TX.astype(np.float64)


def read_mimickit(tree: Tree, options: ReadOptions, find_rate: Callable[[list[str]], float]) -> Motion | None:
    """Reads such a motion; None of anything else, and of SMPL's humanoid.

    Args:
        tree: the file.
        options: may ask for a person, of whom there is one only.
        find_rate: gives the frame rate, and may add to the notes.

    Raises:
        NoMotion: its rows are another character's.
        UserError: the numbers are no motion, or the frame rate is not known.
    """
    row_TX = frames_of(tree)
    if row_TX is None or row_TX.shape[1] == _SMPL:
        return None
    if row_TX.shape[1] != _WIDTH:
        raise NoMotion(
            f"{tree.path}: has 'frames' as MimicKit's motions have, but with rows of {row_TX.shape[1]} numbers; those"
            f" of its humanoid have {_WIDTH}, of SMPL's {_SMPL}, and other characters, as robots and dogs, are not read"
        )
    if np.abs(row_TX[:, 3:]).max() > _LARGEST:
        raise UserError(f"{tree.path}: 'frames' has angles beyond {_LARGEST:.1f} rad (degrees?)")
    local_TN33, column = np.tile(np.eye(3), (len(row_TX), len(_NAMES), 1, 1)), 3
    for place, name in enumerate(_NAMES):
        part = name.partition("_")[2]
        if part == _ARM[-1]:  # hands do not turn
            continue
        axis, width = _ACROSS.get(part), 1 if part in _ACROSS else 3
        turn_TX = row_TX[:, column : column + width]
        local_TN33[:, place] = axis_angle_to_matrix(turn_TX if axis is None else turn_TX * axis)
        column += width
    notes: list[str] = []
    rate = find_rate(notes)
    return turned_motion(
        tree.path, _SKELETON, local_TN33, row_TX[:, :3], rate, "motion of MimicKit's humanoid", options, notes
    )
