"""Keypoints in arrays: those of .npy and .npz files, and of dictionaries in pickles and PyTorch files.

AIST++ keeps `keypoints3d_optim` (T, 17, 3) in a pickle (https://google.github.io/aistplusplus_dataset), MHFormer
`reconstruction` in an .npz file (https://github.com/Vegetebird/MHFormer), and MDM a pickled dictionary in an .npy file,
whose `motion` (samples, K, 3, T) has the time last (https://github.com/GuyTevet/motion-diffusion-model).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrhubo.errors import listed, shortened
from mrhubo.files.npz import open_npz
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import rate_in
from mrhubo.motion.readers.tracks import Person, choose

POINT_KEYS = (
    "keypoints", "keypoints_3d", "keypoints3d_optim", "keypoints3d", "kpts", "kpts_3d", "kpts3d", "joints",
    "joints_3d", "joints3d", "joints3D", "positions", "positions_3d", "points", "world_landmarks",
    "pose_world_landmarks", "landmarks", "pose_landmarks", "reconstruction", "joint_positions", "jointPositions",
    "pred_joints", "j3d", "skeleton",
)  # fmt: skip
"""What files call points, the best first."""
NAME_KEYS = ("names", "joint_names", "keypoint_names", "landmark_names", "keypoints_names")
CONFIDENCE_KEYS = ("confidence", "confidences", "conf", "scores", "visibility", "keypoint_scores", "presence")
LIFT = "lift them to three dimensions first, for instance with MMPose or MotionBERT"
"""What to do with points in a picture."""
_MAX_NAMES = 1_000_000
_SAMPLES, _LENGTHS = "motion", "lengths"


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


def in_npz(path: Path, tree: Tree) -> Keypoints:
    """The points of an .npz file.

    Raises:
        UserError: they are no points of frames, or its names are no text.
    """
    found = _in_node(path, tree)
    found.names = _names(path)
    return found


def in_array(path: Path, tree: Tree) -> Keypoints:
    """The points that a node is itself.

    Raises:
        NoMotion: it is no points of frames; says what it is.
    """
    point_TK3, confidence_TK = _split(path, tree.array(), "the array")
    return Keypoints(point_TK3, confidence_TK=confidence_TK)


def points_in(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The points of a dictionary, of a person in a dictionary of people, or of an array; None where there are none.

    Raises:
        UserError: they are no points of frames, or the person that is asked for is not there.
    """
    path = tree.path
    if not tree.is_mapping:
        shape = tree.shape()
        return in_array(path, tree) if shape is not None and _may_be_points(shape) else None
    samples = _samples(tree, options)
    if samples is not None:
        return samples
    if set(POINT_KEYS) & set(tree.keys):
        return _named_in(tree)
    people = {name: child for name, child in tree.items() if set(POINT_KEYS) & set(child.keys)}
    if not people:
        return None
    shapes = {name: child[_key(child)].shape() for name, child in people.items()}
    tracks = [Person(name, shape[0]) for name, shape in shapes.items() if shape is not None and len(shape) > 2]
    if not tracks:  # says what the first is
        return _named_in(next(iter(people.values())))
    notes: list[str] = []
    if len(tracks) < len(people):
        others = set(people) - {track.person for track in tracks}
        notes.append(f"left out, as there are no points of frames in them: {shortened(listed(others), 200)}")
    found = _named_in(people[choose(path, tracks, options, notes).person])
    if found.rate is None and (told := rate_in(tree, found.notes)) is not None:
        found.rate = told[1]
    found.notes += notes
    return found


def _may_be_points(shape: tuple[int, ...]) -> bool:
    """Whether an array has numbers of points, in space or in a picture, along its last axis; and no matrices."""
    return len(shape) in (3, 4) and shape[-1] in (2, 3, 4) and (len(shape) == 3 or shape[-2:] != (3, 3))


def _named_in(node: Tree) -> Keypoints:
    found = _in_node(node.path, node)
    names = node.get(*NAME_KEYS)
    found.names = (names.texts() or None) if names is not None else None
    return found


def _in_node(path: Path, node: Tree) -> Keypoints:
    key = _key(node)
    point_TK3, confidence_TK = _split(path, node[key].array(), f"'{key}'")
    found = Keypoints(point_TK3, confidence_TK=confidence_TK, where=f"'{key}'")
    given = (node.find_array(key) for key in CONFIDENCE_KEYS)
    confidence = next((array for array in given if array is not None and array.ndim), None)
    if confidence is not None:
        found.confidence_TK = np.asarray(confidence, dtype=np.float64)
    told = rate_in(node, found.notes)
    found.rate = None if told is None else told[1]
    return found


def _key(node: Tree) -> str:
    return next(key for key in POINT_KEYS if key in node.keys)


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


def _names(path: Path) -> list[str] | None:
    """The names in an .npz file, an array of text; None where there are none.

    Raises:
        UserError: there are some, and they are no text (pickled objects, as NumPy makes of lists of any length).
    """
    with open_npz(path) as file:
        key = next((key for key in NAME_KEYS if key in file.keys), None)
        return None if key is None else [str(name) for name in file.read(key, kinds="U", max_bytes=_MAX_NAMES).ravel()]


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
