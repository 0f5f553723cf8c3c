"""Nymeria's `xdata.npz`: how Xsens' 23 segments are turned, and where each begins.

`segment_qWXYZ` (T, 92), quaternions, and `segment_tXYZ` (T, 69) [m], a row a frame; `framerate`
(https://github.com/facebookresearch/nymeria_dataset, nymeria/body_motion_provider.py). World: z up. All segments are
turned as the world is where somebody stands in a T-pose and looks along x (Xsens MVN User Manual, segments' axes).

Legend: T frames, S = 23 segments.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import Tree
from mrhubo.motion.far_places import FARTHEST
from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.assemble import MAX_FRAMES
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.other_rotations import from_quaternions

_TURNS, _PLACES = "segment_qWXYZ", "segment_tXYZ"
_ARM = ("collar", "shoulder", "elbow", "wrist")
_LEG = ("hip", "knee", "ankle", "foot")
_SEGMENTS = (
    "pelvis", "-", "-", "-", "spine3", "neck", "head",
    *(f"{side}_{joint}" for joints in (_ARM, _LEG) for side in ("right", "left") for joint in joints),
)  # fmt: skip
"""Our joint where each begins."""
_TURNED = (
    "pelvis",
    "spine3",
    "neck",
    "head",
    *(f"{side}_{end}" for side in ("left", "right") for end in ("wrist", "ankle")),
)
_HUMAN_33 = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From axes x forward, y left, z up to ours: x left, y up, z forward."""


def read_nymeria(tree: Tree, find_rate: Callable[[list[str]], float]) -> Motion | None:
    """Reads such a file; None of anything else.

    Raises:
        UserError: the numbers are no motion, or the frame rate is not known.
    """
    turn, place = tree.get(_TURNS), tree.get(_PLACES)
    shape = None if place is None else place.shape()
    count = len(_SEGMENTS)
    if turn is None or place is None or shape is None or shape not in ((shape[0], 3 * count), (shape[0], count, 3)):
        return None
    frames = shape[0]
    if turn.shape() not in ((frames, 4 * count), (frames, count, 4)) or not 0 < frames <= MAX_FRAMES:
        return None
    place_TS3 = place.array().astype(np.float64).reshape(frames, count, 3)
    if not (np.abs(np.nan_to_num(place_TS3, nan=np.inf)) < FARTHEST).all():
        raise UserError(f"{tree.path}: '{_PLACES}' holds NaN, infinite numbers, or some beyond {FARTHEST:g} m")
    turn_TS33 = from_quaternions(turn.array().astype(np.float64).reshape(frames, count, 4))
    at = {joint: segment for segment, joint in enumerate(_SEGMENTS) if joint != "-"}
    points = {joint: place_TS3[:, segment] @ _HUMAN_33.T for joint, segment in at.items()}
    del points["pelvis"], points["spine3"], points["neck"], points["head"]  # elsewhere than ours, which turns tell
    turns = {joint: _HUMAN_33 @ turn_TS33[:, at[joint]] @ _HUMAN_33.T for joint in _TURNED}
    notes: list[str] = []
    rate = find_rate(notes)
    source = f"Nymeria's segments of Xsens, '{_TURNS}', z up"
    return motion_from_points(BodyPoints(points, turns), motion_name(tree.path), rate, source, tuple(notes))
