"""Features that models which make motions of texts answer with: rows of an .npy file, of HumanML3D (263 numbers), of
KIT-ML as HumanML3D's authors have it (251), and of SnapMoGen (296).

A row has how fast the root turns about the vertical axis and goes along the floor, as its heading sees it; how high it
is; where joints are, as seen from below the root in its heading; and more, that is not read. HumanML3D's and KIT-ML's
tell half the angle, and places of all joints but the root (https://github.com/EricGuo5513/HumanML3D,
motion_representation.ipynb, whose `recover_from_ric` gives the joints as well); SnapMoGen's the whole angle, and places
of all joints after their rotations (https://github.com/snap-research/SnapMoGen, utils/motion_process_bvh.py). World:
y up.

Legend: T frames, J joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import OTHER_SIDE
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_fit import NONSENSE, misfit
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.keypoints import motion_of_points, way_forward
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import rate_of_all
from mrhubo.motion.readers.rows import rows_in

_ARM, _LEG = ("collar", "shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "foot")
_SNAPMOGEN = (
    "pelvis", "spine1", "spine2", "spine3", "neck", "-", "-",
    *(f"left_{joint}" for joint in _ARM), *(f"right_{joint}" for joint in _ARM),
    "-", *(f"left_{joint}" for joint in _LEG), *(f"right_{joint}" for joint in _LEG),
)  # fmt: skip
"""Chains of its skeleton, (0 to 6), (3, 7 to 10), (3, 11 to 14), (0, 15, 16 to 19) and (15, 20 to 23); which of two is
the left one is not told."""


@dataclass(frozen=True)
class _Kind:
    who: str
    joints: tuple[str, ...]
    """Our names, in the order of the file's; "-" is one that is not used."""
    rate: float
    places: slice
    """Numbers that tell places of joints."""
    turns: float
    """How far the root turns [rad] where a row's first number is 1."""
    sides: bool = True
    """Whether it is known which joints are the left ones."""


_KINDS = {
    263: _Kind("HumanML3D", SETS["SMPL's body"], 20.0, slice(4, 67), 2.0),
    251: _Kind("KIT-ML", SETS["KIT-ML"], 12.5, slice(4, 64), 2.0),
    296: _Kind("SnapMoGen", _SNAPMOGEN, 30.0, slice(148, 220), 1.0, sides=False),
}
"""By the width of a row."""


def read_features(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads rows (T, 263), (T, 251) or (T, 296), or the same after an axis of one; None of anything else.

    Raises:
        NoMotion: the joints make no body, as rows do that were normalised.
        UserError: there are no finite numbers.
    """
    row_TX = rows_in(tree, _KINDS)
    if row_TX is None:
        return None
    width = row_TX.shape[1]
    kind = _KINDS[width]
    point_TJ3 = joints_of(row_TX.astype(np.float64))
    points = {name: point_TJ3[:, place] for place, name in enumerate(kind.joints) if name != "-"}
    if not np.isfinite(point_TJ3).all() or not misfit(points) < NONSENSE:
        raise NoMotion(
            f"{tree.path}: has rows of {width} numbers, as {kind.who}'s features have, but they make no body; if they"
            " are normalised, multiply them by its Std.npy and add its Mean.npy"
        )
    if not kind.sides and way_forward(points) < 0:
        points = {OTHER_SIDE.get(name, name): point_T3 for name, point_T3 in points.items()}
    notes = options.of_one()
    rate = rate_of_all(kind.rate, f"{kind.who} says of all its motions", options, notes)
    point_TK3 = np.stack(list(points.values()), axis=1)
    found = Keypoints(point_TK3, list(points), None, rate, f"of {kind.who}'s features (T, {width})", notes)
    return motion_of_points(tree.path, found, options)


def joints_of(row_TX: np.ndarray) -> np.ndarray:
    """Places (T, J, 3) of joints that rows tell, in the file's unit; of HumanML3D's, (T, 22, 3) [m]."""
    kind = _KINDS[row_TX.shape[1]]
    # what a row tells of speeds leads to the next row
    before_TX = np.concatenate([np.zeros_like(row_TX[:1]), row_TX[:-1]])
    turn_T3 = np.zeros((len(row_TX), 3))
    turn_T3[:, 1] = -kind.turns * np.cumsum(before_TX[:, 0])
    turn_T33 = axis_angle_to_matrix(turn_T3)
    step_T3 = np.zeros_like(turn_T3)
    step_T3[:, [0, 2]] = before_TX[:, 1:3]
    root_T3 = np.cumsum((turn_T33 @ step_T3[..., None])[..., 0], axis=0)
    place_TJ3 = row_TX[:, kind.places].reshape(len(row_TX), -1, 3) @ turn_T33.swapaxes(-1, -2) + root_T3[:, None]
    if place_TJ3.shape[1] == len(kind.joints):
        return place_TJ3
    root_T3[:, 1] = row_TX[:, 3]
    return np.concatenate([root_T3[:, None], place_TJ3], axis=1)
