"""Keypoints in arrays, of one person or of some; what dictionaries call them is said beside it, in
`mrhubo.motion.readers.keypoint_dictionaries`.

Legend: T frames, K keypoints.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrhubo.files.tree import Tree
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.keypoint_fit import NONSENSE, fitting_sets
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.sightings import known_points
from mrhubo.motion.readers.tracks import Person, choose

POINT_KEYS = (
    "keypoints3d_optim", "keypoints_3d", "kpts_3d", "joints_3d", "positions_3d", "pose_3d", "world_landmarks",
    "pose_world_landmarks", "pose_world_3d_landmarks", "reconstruction", "joint_positions", "pred_joints", "j3d",
    "human_joints", "joints_world", "global_positions", "jpos", "smpl_joints", "pred_xyz_jts", "keypoints_xyz",
    "pred_joints_3d", "joint_locations", "world_positions", "global_joints", "joints_positions",
    "annotation_3d", "keypoints", "keypoint", "kpts",
    "joints", "positions", "points", "landmarks", "pose_landmarks", "skeleton",
)  # fmt: skip
"""What files call points, the best first: those in space go before those that may be in a picture. Capitals and signs
between words do not matter: `keypoints3D` is `keypoints_3d`, `poseWorldLandmarks` is `pose_world_landmarks`.
"""
_PLAIN = {key.replace("_", ""): place for place, key in enumerate(POINT_KEYS)}
NAME_KEYS = ("names", "joint_names", "keypoint_names", "landmark_names", "keypoints_names", "jointNames",
             "keypointNames", "landmarkNames")  # fmt: skip
CONFIDENCE_KEYS = ("confidence", "confidences", "conf", "scores", "visibility", "keypoint_scores", "presence")
LIFT = "lift them to three dimensions first, for instance with MMPose or MotionBERT"
"""What to do with points in a picture."""
_ROTATIONS = (63, 66, 69, 72, 156, 159, 165)
"""Numbers of a row of SMPL's rotations."""
_SAMPLED = 256
"""Frames that are looked at."""
_MOST_PEOPLE = 20
"""In one array."""


@dataclass
class Keypoints:
    """Points, as they are in a file."""

    point_TK3: np.ndarray
    """NaN where a point is missing; float64."""
    names: list[str] | None = None
    confidence_TK: np.ndarray | None = None
    rate: float | None = None
    where: str = "the array"
    notes: list[str] = field(default_factory=list)


def point_key(keys: Iterable[str]) -> str | None:
    """The key under which a dictionary has points in space, or else such as may be; None where it has neither."""
    plain = {"".join(filter(str.isalnum, key.lower())): key for key in keys}
    return min(((_PLAIN[bare], key) for bare, key in plain.items() if bare in _PLAIN), default=(0, None))[1]


def in_array(path: Path, tree: Tree, options: ReadOptions, array: np.ndarray | None = None) -> Keypoints:
    """The points that a node is itself, of one of the people in it.

    Args:
        path: the file, for sentences.
        tree: the node.
        options: person.
        array: of the node, where it is laid out in another way.

    Raises:
        NoMotion: it is no points of frames; says what it is.
    """
    notes: list[str] = []
    array, _ = of_one_person(path, tree.array() if array is None else array, "the array", options, notes)
    point_TK3, confidence_TK = split_points(path, array, "the array")
    return Keypoints(point_TK3, confidence_TK=confidence_TK, notes=notes)


def points_of_rows(tree: Tree, shape: tuple[int, ...]) -> np.ndarray | None:
    """Rows of three or four numbers a point as points (T, K, 3 or 4), if those make a body in the order of a set that
    is known; None of any other, and of rows as long as those of SMPL's rotations, which may make one by chance.
    """
    if 0 in shape or shape[1] in _ROTATIONS or (array := tree.array()).dtype.kind not in "fiu":
        return None
    for numbers in (3, 4):
        if shape[1] % numbers == 0:
            point_TKX = array.reshape(len(array), -1, numbers)
            if is_known_body(point_TKX[..., :3]):
                return point_TKX
    return None


def is_known_body(point_TK3: np.ndarray) -> bool:
    """Whether points make a body in the order of a set that is known."""
    fits = fitting_sets(known_points(point_TK3[:: 1 + len(point_TK3) // _SAMPLED].astype(np.float64)))
    return bool(fits) and fits[0][0] < NONSENSE


def may_be_points(shape: tuple[int, ...]) -> bool:
    """Whether an array has numbers of points, in space or in a picture, along its last axis; and no matrices."""
    return len(shape) in (3, 4) and shape[-1] in (2, 3, 4) and (len(shape) == 3 or shape[-2:] != (3, 3))


def of_one_person(
    path: Path, array: np.ndarray, where: str, options: ReadOptions, notes: list[str]
) -> tuple[np.ndarray, tuple[int, int] | None]:
    """The points of one of the people in an array (people, T, K, 3) or (T, people, K, 3), and along which axis they are
    and where; the array itself, where it has no such axis. There are more frames than people.
    """
    if array.ndim != 4 or array.shape[3] not in (3, 4) or 1 in array.shape[:2] or array.dtype.kind not in "fiu":
        notes += options.of_one()
        return array, None
    axis = int(np.argmin(array.shape[:2]))
    if not 0 < array.shape[axis] < min(array.shape[1 - axis], _MOST_PEOPLE) or 0 in array.shape:
        return array, None
    seen_TP = (np.isfinite(array).all(-1) & (array[..., :3] != 0).any(-1)).any(-1)
    people = [Person(str(number), int(seen)) for number, seen in enumerate(seen_TP.sum(1 - axis)) if seen]
    number = int(choose(path, people, options, notes).person)
    notes.append(f"{where} has shape {array.shape}: taken as those of {array.shape[axis]} people")
    return array.take(number, axis), (axis, number)


def split_points(path: Path, array: np.ndarray, where: str) -> tuple[np.ndarray, np.ndarray | None]:
    """Points (T, K, 3), and the confidence (T, K) that stands beside them; an axis of one person may be there too.

    Raises:
        NoMotion: they are none.
    """
    shape = array.shape
    if array.ndim == 4 and 1 in shape[:2]:
        array = array[0] if shape[0] == 1 else array[:, 0]
    if array.ndim == 4 and shape[3] in (3, 4):
        raise NoMotion(
            f"{path}: {where} has shape {shape}, as points of several people in one array have; save one person's,"
            " (frames, points, 3)"
        )
    if array.ndim == 3 and array.shape[2] == 2:
        raise NoMotion(f"{path}: {where} has shape {shape}, as points in a picture have (x and y); {LIFT}")
    if array.ndim != 3 or array.shape[2] not in (3, 4) or 0 in array.shape or array.dtype.kind not in "fiu":
        raise NoMotion(f"{path}: {where} has shape {shape}; expected (frames, points, 3) or (frames, points, 4)")
    array = array.astype(np.float64)
    return array[..., :3], array[..., 3] if array.shape[2] == 4 else None
