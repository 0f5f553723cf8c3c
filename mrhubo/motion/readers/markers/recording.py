"""Recordings of Qualisys Track Manager in MATLAB's files: a structure that is called as the file was.

It has the skeletons that were solved, each with `SegmentLabels` (S) and `PositionData` (3, S, T), and of the markers
`Trajectories.Labeled.Labels` (K) and `Data` (K, 4, T), whose fourth number tells how exactly a marker was seen (QTM
User Manual, "Export to MAT format", https://docs.qualisys.com). Skeletons are taken where there are any.

Legend: T frames, K markers, S segments.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_joints import is_body
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.markers.convert import motion_of_labelled
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED, by_names
from mrhubo.motion.readers.rate import number_told
from mrhubo.motion.readers.tracks import Person, choose_or_only

_SKELETONS, _TRAJECTORIES, _RATE = "Skeletons", "Trajectories", "FrameRate"
_MOST = 100
"""Recordings in a file, and skeletons in a recording."""


@dataclass(frozen=True)
class _Skeleton(Person):
    names: Sequence[str]
    place_TS3: np.ndarray


def read_recording(tree: Tree, options: ReadOptions) -> Motion | None:
    """The motion of somebody in a recording; None of any other file.

    Raises:
        NoMotion: it has nobody whose markers or segments are known.
        UserError: there is nobody of the name that is asked for, or the rate is not known.
    """
    recordings = [node for node in _entries(tree) if node.is_mapping and _is_recording(node.keys)]
    if not recordings:
        return None
    node, notes = recordings[0], list[str]()
    if len(recordings) > 1:
        notes.append(f"there are {len(recordings)} recordings in the file; the first is taken, '{node.where}'")
    rate = number_told(node[_RATE])
    skeletons = list(_skeletons(node))
    if skeletons:
        chosen = choose_or_only(tree.path, skeletons, options, notes)
        if not is_body(chosen.place_TS3, chosen.names):
            raise NoMotion(
                f"{tree.path}: '{chosen.person}' has limbs that do not keep their lengths, or are no person's; were its"
                " segments exported as their parents see them? export them in global coordinates, or as FBX"
            )
        found = Keypoints(chosen.place_TS3, list(chosen.names), None, rate, f"skeleton '{chosen.person}'", notes)
        return motion_of_points(tree.path, found, options)
    labelled = _labelled(node)
    if labelled is None:
        raise NoMotion(
            f"{tree.path}: is a recording of Qualisys Track Manager without skeletons and without markers that have"
            " labels; label them, and export them again"
        )
    names, place_TK3 = labelled
    found = Keypoints(place_TK3, list(names), None, rate, "the markers", notes)
    return motion_of_labelled(tree.path, found, "recording of Qualisys Track Manager", options)


def _is_recording(keys: Sequence[str]) -> bool:
    return _RATE in keys and (_SKELETONS in keys or _TRAJECTORIES in keys)


def _entries(tree: Tree) -> Iterator[Tree]:
    """The file's dictionary, those in it, and those in lists in it."""
    yield tree
    for _, child in islice(tree.items(), _MOST):
        yield child
        yield from islice(child, _MOST)


def _skeletons(node: Tree) -> Iterator[_Skeleton]:
    """Those with the segments of a body."""
    home = node.get(_SKELETONS)
    for number, one in enumerate([] if home is None else [home, *islice(home, _MOST)]):
        labels, places = one.get("SegmentLabels"), one.get("PositionData")
        if labels is None or places is None:
            continue
        names, place_3ST = labels.texts(), _with_time(places)
        if place_3ST is None or place_3ST.shape[:2] != (3, len(names)) or not by_names(names).keys() >= set(NEEDED):
            continue
        called = one.get("SkeletonName")
        name = (called.text() if called is not None else None) or str(number)
        place_TS3 = place_3ST.transpose(2, 1, 0)
        seen = int(np.isfinite(place_TS3).all(-1).any(-1).sum())
        if seen:
            yield _Skeleton(name, seen, names, place_TS3)


def _labelled(node: Tree) -> tuple[list[str], np.ndarray] | None:
    """The labels of markers, and where they are (T, K, 3)."""
    home = node.get(_TRAJECTORIES)
    markers = None if home is None else home.get("Labeled")
    labels, places = (None, None) if markers is None else (markers.get("Labels"), markers.get("Data"))
    if labels is None or places is None:
        return None
    names, place_K4T = labels.texts(), _with_time(places)
    if not names or place_K4T is None or len(place_K4T) != len(names) or place_K4T.shape[1] < 3:
        return None
    return names, place_K4T[:, :3].transpose(2, 0, 1)


def _with_time(node: Tree) -> np.ndarray | None:
    """An array of three axes, the last of which MATLAB leaves out of a single frame; None of anything else."""
    shape = None if node.is_mapping else node.shape()
    if shape is None or len(shape) not in (2, 3) or 0 in shape:
        return None
    array = node.array()
    if array.dtype.kind not in "fiu":
        return None
    return (array if array.ndim == 3 else array[..., None]).astype(np.float64)
