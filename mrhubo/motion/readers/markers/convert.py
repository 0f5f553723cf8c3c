"""Human motions from markers on the skin: those of C3D files, and of other files that name them.

Legend: T frames, K points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.body.level_feet import middle, turn_feet
from mrhubo.errors import UserError, listed, shortened
from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import motion_from_points
from mrhubo.motion.readers.advice import SOLVE
from mrhubo.motion.readers.assemble import standing_feet
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoints import motion_of_points, rate_of_points, refuse_far, to_world
from mrhubo.motion.readers.markers.c3d_file import read_c3d_file
from mrhubo.motion.readers.markers.joints import body_of_markers
from mrhubo.motion.readers.markers.labels import has_body, marker_places
from mrhubo.motion.readers.markers.segments import has_segments, motion_of_segments
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED, by_names
from mrhubo.motion.readers.tracks import Person, check_span, choose_or_only

_STANDS_FOR = {"shoulder": "acromion", "hip": "front_pelvis", "knee": "lateral_knee", "ankle": "lateral_ankle"}
"""Markers near joints, by which up, left and the unit are told."""
_LEVEL = np.array([0.0, 1.0, 0.0], np.float32)
_STANDS, _TILTED = 20, np.radians(20.0)
"""Frames in which a foot stands, at least, to tell how it is turned then; and how far it may be from level: more is on
purpose."""
_NOTE = "joints are worked out from markers on the skin: expect limbs to be off by some degrees"


def is_c3d(content: Content) -> bool:
    """Whether a file begins as C3D files do: with the block of its parameters, and a key."""
    return content.start[1:2] == b"\x50" and 2 <= content.start[0] <= 9


def read_c3d(path: Path, options: ReadOptions) -> Motion:
    """Reads the motion of a body with markers, or with segments or points that are joints, as cameras without markers
    find them.

    Raises:
        NoMotion: it has none of these.
        UserError: the file is missing, damaged or too large, or its rate is not known.
    """
    file = read_c3d_file(path)
    if file.segments is not None:
        names = file.segments.names
        if has_segments(names):
            return motion_of_segments(path, file.segments, options.of_one(), options)
        if not file.names:
            raise NoMotion(
                f"{path}: is a C3D file of segments of no body that is known by their names:"
                f" {shortened(listed(names), 160)}; upper arms and thighs are needed, by names such as l_uarm_4X4 and"
                " l_thigh_4X4"
            )
    notes: list[str] = []
    if len(file.point_TK3) < file.frames_told:
        notes.append(f"the file ends after {len(file.point_TK3):,} of {file.frames_told:,} frames")
    found = Keypoints(file.point_TK3, list(file.names), None, file.rate, "the C3D file", notes)
    return motion_of_labelled(path, found, "C3D file", options)


def motion_of_labelled(path: Path, found: Keypoints, kind: str, options: ReadOptions) -> Motion:
    """The motion of one of those whose points a file has by labels, `LASI`, `Ann:LASI` or `Ann_LASI`.

    Args:
        path: the file.
        found: points and their labels.
        kind: what the file is, for sentences.
        options: may tell the rate, and whose.

    Raises:
        NoMotion: they are no markers or joints of a body.
        UserError: there is nobody of the name that is asked for, or the rate is not known.
    """
    labels = found.names or []
    people = _people(labels)
    if people:
        seen = [Person(name, _seen(found.point_TK3[:, list(columns)])) for name, columns in people.items()]
        of_one = people[choose_or_only(path, seen, options, found.notes).person]
    else:
        of_one = dict(enumerate(labels))
        found.notes.extend(options.of_one())
    one = replace(found, point_TK3=found.point_TK3[:, list(of_one)], names=list(of_one.values()))
    if has_body(one.names or []):
        return motion_of_markers(path, one, kind, options)
    if _are_joints(one.names or []):
        return motion_of_points(path, one, options)
    raise NoMotion(
        f"{path}: is a {kind} whose points are no markers or joints of a whole body that are known by their labels:"
        f" {shortened(listed([label for label in labels if label]), 160) or 'they have none'}; shoulders and the"
        " pelvis' front and back are needed, by labels such as LSHO, LASI and LPSI, or joints by names such as"
        f" RShoulder and RHip; {SOLVE}"
    )


def motion_of_markers(path: Path, found: Keypoints, kind: str, options: ReadOptions) -> Motion:
    """The motion of a body by its markers.

    Args:
        path: the file.
        found: markers and their labels, which `has_body`; one that is not seen is NaN, or at the origin.
        kind: what the file is, for `Motion.source`.
        options: may tell the rate.

    Raises:
        UserError: markers are never seen together, or the rate is not known.
    """
    refuse_far(path, found)
    rate = rate_of_points(path, found, options)
    places = marker_places(found.names or [])
    point_TK3 = np.where((found.point_TK3 == 0).all(-1, keepdims=True), np.nan, found.point_TK3)
    markers = {name: point_TK3[:, at] for name, at in places.items()}
    beside = {
        f"{side}_{joint}": markers[f"{side}_{place}"]
        for side in SIDES
        for joint, place in _STANDS_FOR.items()
        if f"{side}_{place}" in markers
    }
    unseen = [name for name in NEEDED if not np.isfinite(beside[name]).all(-1).any()]
    if unseen:
        raise UserError(f"{path}: markers of {listed(unseen)} are not seen in any frame")
    turned, world = to_world({**markers, **beside}, found.notes)
    body = body_of_markers({name: turned[name] for name in markers})
    seen_T = np.all([np.isfinite(body.points[name]).all(-1) for name in NEEDED], axis=0)
    if not seen_T.any():
        raise UserError(f"{path}: the markers of shoulders and pelvis are not seen together in any frame")
    check_span(path, int(seen_T.sum()), len(seen_T))
    source = f"{kind}, {len(places)} of {len(found.names or [])} points taken for markers by their labels, {world}"
    return _levelled(motion_from_points(body, motion_name(path), rate, source, (*found.notes, _NOTE), str(path)))


def _levelled(motion: Motion) -> Motion:
    """The motion with feet that are level where they stand: markers on heels and toes are rarely of one height."""
    arrays = motion.arrays
    if arrays.root_rotation_T33 is None:
        return motion
    feet = standing_feet(arrays.root_rotation_T33, arrays.local_TJ33, motion.frame_rate)
    ups = [middle(up_X3) if len(up_X3) >= _STANDS else _LEVEL for up_X3 in feet]
    left_3, right_3 = (up_3 if up_3 @ _LEVEL > np.cos(_TILTED) else _LEVEL for up_3 in ups)
    return motion.changed(local_TJ33=turn_feet(arrays.local_TJ33, (left_3, right_3)))


def _people(labels: Sequence[str]) -> dict[str, dict[int, str]]:
    """Of those who have the points of a body, the columns and their labels, by what is before a colon, or else before
    the first low line, as skeletons of Qualisys Track Manager have it.
    """
    for parts in ([label.rpartition(":") for label in labels], [label.partition("_") for label in labels]):
        heads: dict[str, dict[int, str]] = {}
        for column, (head, mark, rest) in enumerate(parts):
            heads.setdefault(head if mark else "", {})[column] = rest if mark else head or rest
        people = {head: named for head, named in heads.items() if _is_somebody(list(named.values()))}
        if people:
            return people
    return {}


def _seen(point_TK3: np.ndarray) -> int:
    """In how many frames any of some points is seen."""
    return int(np.isfinite(point_TK3).all(-1).any(-1).sum())


def _is_somebody(labels: Sequence[str]) -> bool:
    return has_body(labels) or _are_joints(labels)


def _are_joints(names: Sequence[str]) -> bool:
    return by_names(names).keys() >= set(NEEDED)
