"""Keypoints in arrays: those of .npy and .npz files, and of dictionaries in pickles and PyTorch files.

AIST++ keeps `keypoints3d_optim` (T, 17, 3) in a pickle (https://google.github.io/aistplusplus_dataset), MHFormer
`reconstruction` in an .npz file (https://github.com/Vegetebird/MHFormer), and MDM a pickled dictionary in an .npy file,
whose `motion` (samples, K, 3, T) has the time last (https://github.com/GuyTevet/motion-diffusion-model).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, listed, shortened
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.keypoint_fit import NONSENSE, fitting_sets
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import rate_in, rate_of_all
from mrhubo.motion.readers.sightings import known_points
from mrhubo.motion.readers.tracks import Person, choose

POINT_KEYS = (
    "keypoints3d_optim", "keypoints_3d", "kpts_3d", "joints_3d", "positions_3d", "pose_3d", "world_landmarks",
    "pose_world_landmarks", "pose_world_3d_landmarks", "reconstruction", "joint_positions", "pred_joints", "j3d",
    "human_joints", "joints_world", "global_positions", "jpos", "smpl_joints", "keypoints", "keypoint", "kpts",
    "joints", "positions", "points", "landmarks", "pose_landmarks", "skeleton",
)  # fmt: skip
"""What files call points, the best first: those in space go before those that may be in a picture. Capitals and signs
between words do not matter: `keypoints3D` is `keypoints_3d`, `poseWorldLandmarks` is `pose_world_landmarks`.
"""
_PLAIN = {key.replace("_", ""): place for place, key in enumerate(POINT_KEYS)}
NAME_KEYS = ("names", "joint_names", "keypoint_names", "landmark_names", "keypoints_names")
CONFIDENCE_KEYS = ("confidence", "confidences", "conf", "scores", "visibility", "keypoint_scores", "presence")
LIFT = "lift them to three dimensions first, for instance with MMPose or MotionBERT"
"""What to do with points in a picture."""
_SAMPLES, _LENGTHS = "motion", "lengths"
_BODY, _BODY_KEY = "skel_body", re.compile(r"skel_body[0-9]{1,2}")
_KINECT_RATE = 30.0
"""Frames a second of NTU RGB+D's motions."""
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


def in_npz(tree: Tree, options: ReadOptions) -> Keypoints:
    """The points of an .npz file.

    Raises:
        UserError: they are no points of frames, or its names are no text.
    """
    found = _named_in(tree, options)
    named = tree.get(*NAME_KEYS)
    if named is not None and found.names is None:
        raise UserError(f"{named.named} is {named.described}; expected the names of the points")
    return found


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
    array, _ = _of_one(path, tree.array() if array is None else array, "the array", options, notes)
    point_TK3, confidence_TK = _split(path, array, "the array")
    return Keypoints(point_TK3, confidence_TK=confidence_TK, notes=notes)


def points_in(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The points of a dictionary, of a person in a dictionary of people, or of an array; None where there are none.

    Raises:
        UserError: they are no points of frames, or the person that is asked for is not there.
    """
    path = tree.path
    if not tree.is_mapping:
        shape = tree.shape()
        rows = _points_of_rows(tree, shape) if shape is not None and len(shape) == 2 else None
        if rows is not None:
            return in_array(path, tree, options, rows)
        return in_array(path, tree, options) if shape is not None and _may_be_points(shape) else None
    samples = _samples(tree, options)
    if samples is not None:
        return samples
    if point_key(tree.keys) is not None:
        return _named_in(tree, options)
    bodies = _kinect_bodies(tree, options)
    if bodies is not None:
        return bodies
    people = {name: child for name, child in tree.items() if point_key(child.keys) is not None}
    if not people:
        return None
    shapes = {name: child[_key(child)].shape() for name, child in people.items()}
    tracks = [Person(name, shape[0]) for name, shape in shapes.items() if shape is not None and len(shape) > 2]
    if not tracks:  # says what the first is
        return _named_in(next(iter(people.values())), options)
    notes: list[str] = []
    if len(tracks) < len(people):
        others = set(people) - {track.person for track in tracks}
        notes.append(f"left out, as there are no points of frames in them: {shortened(listed(others), 200)}")
    found = _named_in(people[choose(path, tracks, options, notes).person], ReadOptions())
    if found.rate is None and (told := rate_in(tree, found.notes)) is not None:
        found.rate = told[1]
    found.notes += notes
    return found


def _points_of_rows(tree: Tree, shape: tuple[int, ...]) -> np.ndarray | None:
    """Rows of three or four numbers a point as points (T, K, 3 or 4), if those make a body in the order of a set that
    is known; None of any other, and of rows as long as those of SMPL's rotations, which may make one by chance.
    """
    if 0 in shape or shape[1] in _ROTATIONS or (array := tree.array()).dtype.kind not in "fiu":
        return None
    for numbers in (3, 4):
        if shape[1] % numbers == 0:
            point_TKX = array.reshape(len(array), -1, numbers)
            fits = fitting_sets(known_points(point_TKX[:: 1 + len(array) // _SAMPLED, :, :3].astype(np.float64)))
            if fits and fits[0][0] < NONSENSE:
                return point_TKX
    return None


def _may_be_points(shape: tuple[int, ...]) -> bool:
    """Whether an array has numbers of points, in space or in a picture, along its last axis; and no matrices."""
    return len(shape) in (3, 4) and shape[-1] in (2, 3, 4) and (len(shape) == 3 or shape[-2:] != (3, 3))


def _named_in(node: Tree, options: ReadOptions) -> Keypoints:
    found = _in_node(node.path, node, options)
    names = node.get(*NAME_KEYS)
    found.names = (names.texts() or None) if names is not None else None
    return found


def _in_node(path: Path, node: Tree, options: ReadOptions) -> Keypoints:
    key, notes = _key(node), []
    whole = node[key].array()
    if whole.ndim == 2 and whole.shape[1] % 3 == 0:  # a row a frame
        whole = whole.reshape(len(whole), -1, 3)
    array, person = _of_one(path, whole, f"'{key}'", options, notes)
    point_TK3, confidence_TK = _split(path, array, f"'{key}'")
    found = Keypoints(point_TK3, confidence_TK=confidence_TK, where=f"'{key}'", notes=notes)
    given = (node.find_array(key) for key in CONFIDENCE_KEYS)
    confidence = next((array for array in given if array is not None and array.ndim), None)
    if confidence is not None:
        axis, number = person or (0, 0)
        if (
            person is not None
            and confidence.ndim > 2
            and confidence.shape[: axis + 1] == node[key].array().shape[: axis + 1]
        ):
            confidence = confidence.take(number, axis)
        found.confidence_TK = np.asarray(confidence, dtype=np.float64)
    told = rate_in(node, found.notes)
    found.rate = None if told is None else told[1]
    return found


def _key(node: Tree) -> str:
    key = point_key(node.keys)
    assert key is not None
    return key


def _samples(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """One of the motions that MDM and its kin made up, by its number; None of anything else."""
    shape = tree[_SAMPLES].shape() if _SAMPLES in tree.keys else None
    if shape is None or len(shape) != 4 or shape[2] != 3 or 0 in shape:
        return None
    lengths = tree.find_array(_LENGTHS)
    whole = np.full(shape[0], shape[3])
    frames_N = whole if lengths is None or lengths.shape != whole.shape else np.clip(np.nan_to_num(lengths), 1, whole)
    notes: list[str] = []
    people = [Person(str(number), int(frames)) for number, frames in enumerate(frames_N)]
    chosen = choose(tree.path, people, options, notes)
    point_KXT = tree[_SAMPLES].array()[int(chosen.person), :, :, : chosen.length]
    point_TK3 = point_KXT.transpose(2, 0, 1).astype(np.float64)
    return Keypoints(point_TK3, where=f"'{_SAMPLES}', sample {chosen.person}", notes=notes)


def _of_one(
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


def _kinect_bodies(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The points of one of the people in what NTU RGB+D's own script makes of a .skeleton file: `skel_body0` (T, 25, 3)
    and others, all 0 where there is nobody (https://github.com/shahroudy/NTURGB-D, Python/txt2npy.py); None of anything
    else.
    """
    bodies = {name.removeprefix(_BODY): child for name, child in tree.items() if _BODY_KEY.fullmatch(name)}
    arrays = {name: child.array() for name, child in bodies.items() if len(child.shape() or ()) == 3}
    people = [Person(name, int((array != 0).any(-1).any(-1).sum())) for name, array in arrays.items()]
    people = [person for person in people if person.length]
    if not people:
        return None
    notes: list[str] = []
    chosen = choose(tree.path, people, options, notes).person
    point_TK3, _ = _split(tree.path, arrays[chosen], f"'{_BODY}{chosen}'")
    return Keypoints(point_TK3, rate=kinect_rate(options, notes), where=f"'{_BODY}{chosen}'", notes=notes)


def kinect_rate(options: ReadOptions, notes: list[str]) -> float:
    """The frame rate of one of NTU RGB+D's motions, of which files do not tell; the notes say where it is from."""
    return rate_of_all(_KINECT_RATE, "NTU RGB+D says of all", options, notes)


def _split(path: Path, array: np.ndarray, where: str) -> tuple[np.ndarray, np.ndarray | None]:
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
