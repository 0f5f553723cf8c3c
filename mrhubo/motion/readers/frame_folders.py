"""Motions in folders with a JSON file a frame, whose number is in its name.

* EasyMocap: a list of people, each with `id` and `keypoints3d`, rows of x, y, z and a confidence
  (https://github.com/zju3dv/EasyMocap).
* CMU Panoptic: `bodies`, each with `id` and `joints19`, a row of x, y, z, confidence for each of 19 joints
  (http://domedb.perception.cs.cmu.edu).
* OpenPose: `people`, each with `pose_keypoints_3d`, laid out alike, of whoever has several cameras; who has one gets
  points in a picture, `pose_keypoints_2d` (https://cmu-perceptual-computing-lab.github.io/openpose, 02_output).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_files import Frames, read_frame_json
from mrhubo.motion.readers.frame_numbers import frame_numbers_in
from mrhubo.motion.readers.keypoint_arrays import LIFT, Keypoints
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.sightings import Sighting, check_size, frames_of_one, person_called

_MOST_PEOPLE, _MOST_NUMBERS = 100, 4_000
"""In a frame, and of a person."""
_LISTS, _IDS = ("people", "bodies"), ("id", "person_id")
_POINTS = ("keypoints3d", "joints19", "joints26", "pose_keypoints_3d")
_FLAT = "pose_keypoints_2d"


def read_frames(folder: Path, frames: Frames, options: ReadOptions) -> Motion:
    """Reads one of the people in a folder.

    Args:
        folder: what the motion is called after.
        frames: its files.
        options: person, rate.

    Raises:
        NoMotion: the points are in a picture, or nobody is there.
        UserError: a file is damaged, the order of the frames or the frame rate is not known.
    """
    seen: list[Sighting] = []
    flat, files = False, frames.files
    for number, file in zip(frame_numbers_in(folder, [file.stem for file in files]), files, strict=True):
        for one in _people(file):
            key = next((key for key in _POINTS if one.get(key)), None)
            flat |= key is None and bool(one.get(_FLAT))
            if key is not None:
                row_K4 = _points(file, key, one[key])
                person = next((person_called(one[name]) for name in _IDS if name in one), None)
                seen.append(Sighting(number, person, row_K4[:, :3], row_K4[:, 3]))
    if not seen and flat:
        raise NoMotion(f"{folder}: holds points in a picture, '{_FLAT}' of OpenPose, frame by frame; {LIFT}")
    if not seen:
        raise NoMotion(f"{folder}: nobody with {' or '.join(_POINTS)} is in its {len(files):,} frames")
    notes: list[str] = []
    person, places = frames_of_one(folder, seen, options, notes)
    counts = {len(seen[place].point_K3) for place in places if place is not None}
    if len(counts) > 1:
        raise UserError(f"{folder}: person '{person}' has now {min(counts)} and now {max(counts)} points")
    points = counts.pop()
    check_size(folder, "the folder", len(places), points)
    point_TK3, sure_TK = np.full((len(places), points, 3), np.nan), np.zeros((len(places), points))
    for frame, place in enumerate(places):
        if place is not None:
            point_TK3[frame], sure_TK[frame] = seen[place].point_K3, seen[place].sure_K
    where = f"in a folder with a file a frame, person {person}"
    found = Keypoints(point_TK3, confidence_TK=np.nan_to_num(sure_TK).clip(0.0, 1.0), where=where, notes=notes)
    return motion_of_points(folder, found, options)


def _people(file: Path) -> list[dict[str, Any]]:
    """The people of a frame."""
    value = read_frame_json(file)
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
