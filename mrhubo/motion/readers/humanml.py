"""HumanML3D's features, which models that make motions of texts answer with: rows (T, 263) of an .npy file.

A row has how fast the root turns about the vertical axis (half the angle, as quaternions have it) and goes along the
floor, as its heading sees it; how high it is; where the other 21 joints of SMPL's body are, as seen from below the root
in its heading; and more, that is not read (https://github.com/EricGuo5513/HumanML3D, motion_representation.ipynb, whose
`recover_from_ric` gives the joints as well). World: y up [m].

Legend: T frames, 22 joints.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.keypoints import fits_a_body, motion_of_points
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import rate_of_all

_WIDTH = 263
_PLACES = slice(4, 67)
_RATE = 20.0
_SET = "SMPL's body"


def read_features(tree: Tree, options: ReadOptions) -> Motion | None:
    """Reads rows (T, 263); None of anything else.

    Raises:
        NoMotion: the joints make no body, as rows do that were normalised.
        UserError: there are no finite numbers.
    """
    shape = tree.shape()
    if shape is None or len(shape) != 2 or shape[1] != _WIDTH or not shape[0]:
        return None
    point_TJ3 = joints_of(tree.array().astype(np.float64))
    if not np.isfinite(point_TJ3).all() or not fits_a_body(point_TJ3, _SET):
        raise NoMotion(
            f"{tree.path}: has rows of {_WIDTH} numbers, as HumanML3D's features have, but they make no body; if they"
            " are normalised, multiply them by its Std.npy and add its Mean.npy"
        )
    notes = options.of_one()
    rate = rate_of_all(_RATE, "HumanML3D says of all its motions", options, notes)
    found = Keypoints(point_TJ3, list(SETS[_SET]), None, rate, f"of HumanML3D's features (T, {_WIDTH})", notes)
    return motion_of_points(tree.path, found, options)


def joints_of(row_TX: np.ndarray) -> np.ndarray:
    """Places (T, 22, 3) [m] of joints that rows (T, 263) tell."""
    # what a row tells of speeds leads to the next row
    before_TX = np.concatenate([np.zeros_like(row_TX[:1]), row_TX[:-1]])
    heading_T = np.cumsum(before_TX[:, 0])
    turn_T3 = np.zeros((len(row_TX), 3))
    turn_T3[:, 1] = -2 * heading_T
    turn_T33 = axis_angle_to_matrix(turn_T3)
    step_T3 = np.zeros_like(turn_T3)
    step_T3[:, [0, 2]] = before_TX[:, 1:3]
    root_T3 = np.cumsum((turn_T33 @ step_T3[..., None])[..., 0], axis=0)
    place_TJ3 = row_TX[:, _PLACES].reshape(len(row_TX), -1, 3) @ turn_T33.swapaxes(-1, -2) + root_T3[:, None]
    root_T3[:, 1] = row_TX[:, 3]
    return np.concatenate([root_T3[:, None], place_TJ3], axis=1)
