"""Motions in folders with a JSON file a frame, by name in order.

* EasyMocap: a list of people, each with `id` and `keypoints3d`, rows of x, y, z and a confidence
  (https://github.com/zju3dv/EasyMocap).
* CMU Panoptic: `bodies`, each with `id` and `joints19`, a row of x, y, z, confidence for each of 19 joints
  (http://domedb.perception.cs.cmu.edu).
* OpenPose: `people`, each with `pose_keypoints_3d`, laid out alike, of whoever has several cameras; who has one gets
  points in a picture, `pose_keypoints_2d` (https://cmu-perceptual-computing-lab.github.io/openpose, 02_output).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_files import MAX_BYTES
from mrhubo.motion.readers.keypoint_arrays import LIFT, Keypoints
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.tracks import Person, choose

_MOST_PEOPLE, _MOST_NUMBERS = 100, 4_000
"""In a frame, and of a person."""
_LISTS = ("people", "bodies")
_POINTS = ("keypoints3d", "joints19", "joints26", "pose_keypoints_3d")
_FLAT = "pose_keypoints_2d"


def read_frames(folder: Path, files: list[Path], options: ReadOptions) -> Motion:
    """Reads one of the people in a folder.

    Args:
        folder: what the motion is called after.
        files: of its frames, in order.
        options: person, rate.

    Raises:
        NoMotion: the points are in a picture, or nobody is there.
        UserError: a file is damaged, or the frame rate is not known.
    """
    people: dict[str, dict[int, np.ndarray]] = {}
    flat = False
    for number, file in enumerate(files):
        for place, one in enumerate(_people(file)):
            key = next((key for key in _POINTS if one.get(key)), None)
            flat |= key is None and bool(one.get(_FLAT))
            if key is not None:
                name = one.get("id", one.get("person_id", place))
                name = place if isinstance(name, list) else name
                people.setdefault(shortened(name, 40), {})[number] = _points(file, key, one[key])
    if not people and flat:
        raise NoMotion(f"{folder}: holds points in a picture, '{_FLAT}' of OpenPose, frame by frame; {LIFT}")
    if not people:
        raise NoMotion(f"{folder}: nobody with {' or '.join(_POINTS)} is in its {len(files):,} frames")
    notes: list[str] = []
    chosen = choose(folder, [Person(name, len(seen)) for name, seen in people.items()], options, notes)
    seen = people[chosen.person]
    counts = {len(points) for points in seen.values()}
    if len(counts) > 1:
        raise UserError(f"{folder}: person '{chosen.person}' has now {min(counts)} and now {max(counts)} points")
    first, last = min(seen), max(seen)
    point_TK4 = np.full((last + 1 - first, counts.pop(), 4), np.nan)
    for number, points in seen.items():
        point_TK4[number - first] = points
    sure_TK = np.nan_to_num(point_TK4[..., 3]).clip(0.0, 1.0)
    where = f"in a folder with a file a frame, person {chosen.person}"
    return motion_of_points(
        folder, Keypoints(point_TK4[..., :3], confidence_TK=sure_TK, where=where, notes=notes), options
    )


def _people(file: Path) -> list[dict[str, Any]]:
    """The people of a frame."""
    try:
        value = json.loads(read_regular(file, MAX_BYTES))
    except (ValueError, RecursionError) as error:
        raise UserError(f"{file}: is no JSON: {shortened(error, 80)}") from error
    if isinstance(value, dict):
        value = next((value[key] for key in _LISTS if key in value), None)
    if not isinstance(value, list) or len(value) > _MOST_PEOPLE or not all(isinstance(one, dict) for one in value):
        raise UserError(f"{file}: holds no list of at most {_MOST_PEOPLE} people")
    return value


def _points(file: Path, key: str, value: Any) -> np.ndarray:
    """Points (K, 4) of a person: x, y, z and a confidence."""
    try:
        rows = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise UserError(f"{file}: '{key}' holds no numbers, or rows of different lengths") from error
    if rows.ndim == 1 and rows.size % 4 == 0:
        rows = rows.reshape(-1, 4)
    if rows.ndim != 2 or rows.shape[1] not in (3, 4) or not 0 < rows.size <= _MOST_NUMBERS:
        raise UserError(f"{file}: '{key}' has shape {rows.shape}; expected rows of x, y, z and a confidence")
    return rows if rows.shape[1] == 4 else np.pad(rows, ((0, 0), (0, 1)), constant_values=1.0)
