"""Keypoints in dictionaries of arrays: those of .npz files, pickles and PyTorch files.

AIST++ keeps `keypoints3d_optim` (T, 17, 3) in a pickle (https://google.github.io/aistplusplus_dataset), MHFormer
`reconstruction` in an .npz file (https://github.com/Vegetebird/MHFormer), and MDM a pickled dictionary in an .npy file,
whose `motion` (samples, K, 3, T) has the time last (https://github.com/GuyTevet/motion-diffusion-model).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, listed, shortened
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.keypoint_arrays import (
    CONFIDENCE_KEYS,
    NAME_KEYS,
    Keypoints,
    in_array,
    is_known_body,
    may_be_points,
    of_one_person,
    point_key,
    points_of_rows,
    split_points,
)
from mrhubo.motion.readers.keypoint_joints import names_beside, points_beside_names, points_by_joint
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import frames_a_second, rate_of_all
from mrhubo.motion.readers.tracks import Person, choose

_SAMPLES, _LENGTHS = "motion", "lengths"
_BODY, _BODY_KEY = "skel_body", re.compile(r"skel_body[0-9]{1,2}")
_KINECT_RATE = 30.0
"""Frames a second of NTU RGB+D's motions."""
_DEEPEST, _MOST_CLIPS, _FEWEST_POINTS = 2, 10_000, 12
"""Dictionaries in dictionaries of clips, clips in them, and points of a body."""
_FEW = 20
"""Entries of a dictionary beside one array, at most."""


def in_npz(tree: Tree, options: ReadOptions) -> Keypoints:
    """The points of an .npz file.

    Raises:
        UserError: they are no points of frames, or its names are no text.
    """
    clip = _clip(tree, options) if tree[_key(tree)].is_mapping else None
    found = _named_in(tree, options) if clip is None else clip
    named = tree.get(*NAME_KEYS)
    if named is not None and found.names is None:
        raise UserError(f"{named.named} is {named.described}; expected the names of the points")
    return found


def points_in(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The points of a dictionary, of a person in a dictionary of people, or of an array; None where there are none.

    Raises:
        UserError: they are no points of frames, or the person that is asked for is not there.
    """
    path = tree.path
    if not tree.is_mapping:
        shape = tree.shape()
        rows = points_of_rows(tree, shape) if shape is not None and len(shape) == 2 else None
        if rows is not None:
            return in_array(path, tree, options, rows)
        return in_array(path, tree, options) if shape is not None and may_be_points(shape) else None
    found = _samples(tree, options) or points_by_joint(tree, options) or _alone(tree, options)
    if found is not None:
        return found
    if point_key(tree.keys) is not None and not tree[_key(tree)].is_mapping:
        return _named_in(tree, options)
    found = _kinect_bodies(tree, options) or points_beside_names(tree, options)
    if found is not None:
        return found
    people = {name: child for name, child in tree.items() if point_key(child.keys) is not None}
    if not people:
        return _clip(tree, options)
    shapes = {name: child[_key(child)].shape() for name, child in people.items()}
    tracks = [Person(name, shape[0]) for name, shape in shapes.items() if shape is not None and len(shape) > 2]
    if not tracks:  # says what the first is
        return _named_in(next(iter(people.values())), options)
    notes: list[str] = []
    if len(tracks) < len(people):
        others = set(people) - {track.person for track in tracks}
        notes.append(f"left out, as there are no points of frames in them: {shortened(listed(others), 200)}")
    found = _named_in(people[choose(path, tracks, options, notes).person], ReadOptions())
    if found.rate is None:
        found.rate = frames_a_second(tree, found.notes)
    found.notes += notes
    return found


def _clip(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """One of the motions in a dictionary of arrays of points (T, K, 3), or of such dictionaries, as VideoPose3D keeps
    Human3.6M's, by subject and action (https://github.com/facebookresearch/VideoPose3D, `positions_3d`); None where
    anything else is in it.
    """
    clips: dict[str, Tree] = {}
    left = [("", tree)]
    while left and len(clips) <= _MOST_CLIPS:
        name, node = left.pop(0)
        for key, child in node.items():
            called = f"{name}/{key}" if name else key
            shape = None if child.is_mapping else child.shape()
            if child.is_mapping and called.count("/") < _DEEPEST:
                left.append((called, child))
            elif shape is not None and len(shape) == 3 and shape[0] and shape[2] == 3 and shape[1] >= _FEWEST_POINTS:
                clips[called] = child
            else:
                return None
    if not clips:
        return None
    notes: list[str] = []
    frames = {name: (node.shape() or (0,))[0] for name, node in clips.items()}
    chosen = choose(tree.path, [Person(name, count) for name, count in frames.items()], options, notes).person
    found = in_array(tree.path, clips[chosen], ReadOptions())
    found.where, found.notes = f"'{clips[chosen].where}'", notes + found.notes
    return found


def _named_in(node: Tree, options: ReadOptions) -> Keypoints:
    found = _in_node(node.path, node, options)
    names = node.get(*NAME_KEYS)
    found.names = (names.texts() or None) if names is not None else names_beside(node)
    return found


def _in_node(path: Path, node: Tree, options: ReadOptions) -> Keypoints:
    key, notes = _key(node), []
    whole = node[key].array()
    if whole.ndim == 2 and whole.shape[1] % 3 == 0:  # a row a frame
        whole = whole.reshape(len(whole), -1, 3)
    names = node.get(*NAME_KEYS)
    if names is not None:
        whole = _time_first(whole, len(names.texts()))
    array, person = of_one_person(path, whole, f"'{key}'", options, notes)
    point_TK3, confidence_TK = split_points(path, array, f"'{key}'")
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
    found.rate = frames_a_second(node, found.notes)
    return found


def _time_first(array: np.ndarray, points: int) -> np.ndarray:
    """The same with the axis of the frames first, where it is last, as MATLAB's users have it: (K, 3, T), (3, K, T)."""
    if array.ndim == 3 and array.shape[2] not in (3, 4):
        if array.shape[:2] == (points, 3):
            return array.transpose(2, 0, 1)
        if array.shape[:2] == (3, points):
            return array.transpose(2, 1, 0)
    return array


def _alone(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The points of the only array in a dictionary, whatever it is called, if its last axis is that of the frames and
    they make a body in the order of a set that is known: UTD-MHAD's `d_skel` (20, 3, T)
    (https://personal.utdallas.edu/~kehtar/UTD-MHAD.html); None of any other.
    """
    shapes = {} if len(tree) > _FEW else {name: node.shape() for name, node in tree.items() if not node.is_mapping}
    arrays = [name for name, shape in shapes.items() if shape is not None and len(shape) > 1]
    shape = shapes[arrays[0]] if len(arrays) == 1 else None
    if shape is None or len(shape) != 3 or 3 not in shape[:2] or shape[2] in (0, 3, 4):
        return None
    array = tree[arrays[0]].array()
    if array.dtype.kind not in "fiu":
        return None
    point_TK3 = _time_first(array, shape[0] if shape[1] == 3 else shape[1]).astype(np.float64)
    if not is_known_body(point_TK3):
        return None
    rate = frames_a_second(tree, notes := options.of_one())
    return Keypoints(point_TK3, rate=rate, where=f"'{arrays[0]}'", notes=notes)


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
    point_TK3, _ = split_points(tree.path, arrays[chosen], f"'{_BODY}{chosen}'")
    return Keypoints(point_TK3, rate=kinect_rate(options, notes), where=f"'{_BODY}{chosen}'", notes=notes)


def kinect_rate(options: ReadOptions, notes: list[str]) -> float:
    """The frame rate of one of NTU RGB+D's motions, of which files do not tell; the notes say where it is from."""
    return rate_of_all(_KINECT_RATE, "NTU RGB+D says of all", options, notes)
