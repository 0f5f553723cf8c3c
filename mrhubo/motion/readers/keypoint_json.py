"""Keypoints in JSON.

`{"fps": 30, "names": [...], "keypoints": [[[x, y, z], ...], ...], "confidence": [[...], ...]}`, or a list of frames, or
a dictionary of such by number, each a list of points [x, y, z], [x, y, z, confidence] or {"x": ..., "y": ..., "z": ...,
"visibility": ...}, or points by name, as {"left_hip": [x, y, z], ...} or with a "name" each, in any order, some of them
perhaps missing. A frame may have a list of people:

* MMPose: `instance_info` with `instances`, names in `meta_info`
  (https://github.com/open-mmlab/mmpose/blob/main/demo/docs/en/3d_human_pose_demo.md);
* Azure Kinect: `frames` with `bodies`, each with `body_id` and `joint_positions`, and `joint_names`
  (https://github.com/microsoft/Azure-Kinect-Samples, body-tracking-samples/offline_processor);
* MediaPipe's tasks for the web: `worldLandmarks`, a list of points a person
  (https://ai.google.dev/edge/mediapipe/solutions/vision/pose_landmarker/web_js);
* pose-detection of TensorFlow.js: lists of people with `keypoints3D` in space beside `keypoints` in the picture
  (https://github.com/tensorflow/tfjs-models/tree/master/pose-detection).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.tree import Tree, tree_of
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_numbers import in_order
from mrhubo.motion.readers.keypoint_arrays import CONFIDENCE_KEYS, NAME_KEYS, Keypoints, point_key
from mrhubo.motion.readers.keypoint_joints import points_beside_names, points_by_joint
from mrhubo.motion.readers.keypoint_rows import NOTHING, Row, people_of, points_key, row_of
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED, by_names
from mrhubo.motion.readers.rate import TIME_KEYS, frames_a_second, rate_of_even
from mrhubo.motion.readers.sightings import Sighting, check_size, frames_of_one, person_called

_FRAMES = ("instance_info", "frames", "data")
"""What files call a list of frames that have points."""
_NUMBERS = ("frame_id", "frame", "frame_idx", "frame_index", "frame_number")
_IDS = ("track_id", "body_id", "person_id", "id")
_PICTURE = "image_id"
"""What lists of detections, as COCO has them, call the frame in which somebody was seen."""
_FEWEST, _MOST_VALUES, _DEEPEST = 2, 10**7, 10
"""Frames of a list in a container other than JSON, at least; values in that, and lists in lists, at most."""
_DIGIT = re.compile(r"[0-9]")


def points_of_json(path: Path, value: Any, options: ReadOptions) -> Keypoints:
    """The points of one person in what a JSON file holds.

    Raises:
        NoMotion: it holds no points; says what it holds.
        UserError: what it holds is no points of frames, or the person that is asked for is not there.
    """
    names, confidence, whole, where = None, None, value, "the list"
    tree = tree_of(value, path, "")
    in_arrays = points_by_joint(tree, options) or points_beside_names(tree, options)
    if in_arrays is not None:
        return in_arrays
    if isinstance(value, dict):
        names = next((value[key] for key in NAME_KEYS if key in value), None)
        told = (value.get(key) for key in CONFIDENCE_KEYS)
        confidence = next((each for each in told if isinstance(each, list) and each), None)
        key = point_key(value) or next((key for key in _FRAMES if key in value), None)
        if key is not None:
            value, where = value[key], f"'{key}'"
    numbered = _frames(path, where, value)
    numbers, frames = [number for number, _ in numbered], [frame for _, frame in numbered]
    people = [people_of(frame) for frame in frames]
    if any(here is not None for here in people):
        if isinstance(value, dict) and max(len(here or ()) for here in people) > len(frames):
            raise NoMotion(
                f"{path}: {where} has {len(frames)} entries with lists of more, as if each were a person; save one"
                " person's, {'keypoints': (frames, points, 3)}"
            )
        found = _of_one(path, where, list(zip(numbers, frames, people, strict=True)), options)
    else:
        rows = [row_of(path, where, number, frame) for number, frame in zip(numbers, frames, strict=True)]
        found = _placed(path, where, _spread(numbers, rows), _texts(names))
    if confidence is not None:
        found.confidence_TK = _array(path, confidence, "'confidence'")
        if len(found.confidence_TK) == len(numbers) < len(found.point_TK3):
            sure_TK = np.zeros((len(found.point_TK3), *found.confidence_TK.shape[1:]))
            sure_TK[numbers] = found.confidence_TK
            found.confidence_TK = sure_TK
    meta = whole.get("meta_info") if isinstance(whole, dict) else None
    if found.names is None:
        found.names = _names_of(names, meta, found.point_TK3.shape[1])
    rate = frames_a_second(tree, found.notes)
    found.rate = _rate_of_frames(numbers, frames) if rate is None else rate
    return found


def points_of_frames(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The same of a list of frames in another container, or of a dictionary that has one; None where it has none.

    Raises:
        UserError: the person that is asked for is not there.
    """
    lists = [tree, *(child for key, child in tree.items() if key in _FRAMES)]
    frames = next((node for node in lists if node.is_list and next(iter(node), tree).is_mapping), None)
    if frames is None or len(frames) < _FEWEST:
        return None
    try:
        value = _plain(tree, [_MOST_VALUES], _DEEPEST)
        found = points_of_json(tree.path, value, options)
    except NoMotion:
        return None
    except UserError:
        if options.person is not None:
            raise
        return None
    return found if by_names(found.names or ()).keys() >= set(NEEDED) else None


def _plain(node: Tree, left: list[int], deepest: int) -> Any:
    """What a node holds, as JSON would have it.

    Args:
        node: of any container.
        left: how many values more may be in it.
        deepest: dictionaries and lists in each other, at most.

    Raises:
        NoMotion: there is too much in it.
    """
    shape = None if node.is_mapping else node.shape()
    left[0] -= 1 + math.prod(shape or (0,))
    if left[0] < 0 or deepest < 0:
        raise NoMotion(f"{node.path}: has more than {_MOST_VALUES:,} values, or lists in lists")
    if node.is_mapping:
        return {name: _plain(child, left, deepest - 1) for name, child in node.items()}
    if shape is None and node.is_list:
        return [_plain(child, left, deepest - 1) for child in node]
    return node.text() if shape is None else node.array().tolist()


def _rate_of_frames(numbers: Sequence[int], frames: Sequence[Any]) -> float | None:
    """Frames per second by the times that frames have, one each; None where they tell none."""
    if list(numbers) != list(range(len(numbers))):
        return None
    for key in (*TIME_KEYS, "t"):
        times = [_under(frame, key) for frame in frames]
        if all(type(time) in (int, float) for time in times):
            return rate_of_even(np.array(times))
    return None


def _under(frame: Any, key: str) -> Any:
    """What a frame has under a key, or the scene that is all that it has."""
    if not isinstance(frame, dict):
        return None
    inner = next(iter(frame.values())) if len(frame) == 1 else None
    return inner.get(key) if key not in frame and isinstance(inner, dict) else frame.get(key)


def _frames(path: Path, where: str, value: Any) -> list[tuple[int, Any]]:
    """Frames and their numbers, in order: of a list by what each says, or its place; of a dictionary by its keys."""
    if isinstance(value, dict) and value:
        if not all(_DIGIT.search(str(key)) and isinstance(one, dict | list | None) for key, one in value.items()):
            keys = shortened(", ".join(map(str, list(value)[:10])), 120)
            raise NoMotion(
                f"{path}: is JSON with {keys}; expected 'keypoints' (frames, points, 3) or SMPL's parameters;"
                " docs/formats.md says how each is laid out"
            )
        check_size(path, where, len(value), 1)
        return in_order(path, [(str(key), one) for key, one in value.items()])
    if not isinstance(value, list) or not value:
        raise UserError(f"{path}: {where} is no list of frames")
    check_size(path, where, len(value), 1)
    pictures = [str(frame.get(_PICTURE, "")) if isinstance(frame, dict) else "" for frame in value]
    if all(pictures) and len(set(pictures)) < len(pictures):  # an entry is a person, and not a frame
        people: dict[str, list[Any]] = {}
        for picture, one in zip(pictures, value, strict=True):
            people.setdefault(picture, []).append(one)
        return in_order(path, list(people.items()))
    for key in _NUMBERS:
        given = [frame.get(key) if isinstance(frame, dict) else None for frame in value]
        if all(type(number) is int and number >= 0 for number in given) and len(set(given)) == len(given):
            return in_order(path, list(zip(map(str, given), value, strict=True)))
    return list(enumerate(value))


def _of_one(
    path: Path, where: str, frames: Sequence[tuple[int, Any, list[Any] | None]], options: ReadOptions
) -> Keypoints:
    """The points of one of the people in frames (number, frame, people), told apart by what the file calls them, or
    else followed, in the picture too where there are boxes: points that were lifted from it may be around one origin.
    """
    rows: list[Row] = []
    seen: list[Sighting] = []
    for number, frame, people in frames:
        for one in [frame] * bool(frame) if people is None else people:
            if isinstance(one, dict) and points_key(one) is None:
                continue
            row = row_of(path, where, number, one)
            told = {} if not isinstance(one, dict) else one
            scores = next((told[key] for key in ("keypoint_scores", *CONFIDENCE_KEYS) if key in told), None)
            sure_K = _array(path, scores, "the confidence").reshape(-1) if isinstance(scores, list) else None
            if sure_K is None or len(sure_K) != len(row.points):
                fourth = [point[3] for point in row.points if len(point) == 4]
                sure_K = np.array(fourth) if fourth and len(fourth) == len(row.points) else None
            person = next((person_called(told[key]) for key in _IDS if key in told), None)
            point_K3 = np.array([point[:3] for point in row.points]).reshape(-1, 3)
            rows.append(row)
            seen.append(Sighting(number, person, point_K3, sure_K, _picture(told.get("bbox"))))
    if not seen:
        raise NoMotion(f"{path}: {where} has nobody with 'keypoints'")
    notes: list[str] = []
    person, places = frames_of_one(path, seen, options, notes)
    found = _placed(path, where, [NOTHING if place is None else rows[place] for place in places])
    points = found.point_TK3.shape[1]
    told = {frame: seen[place].sure_K for frame, place in enumerate(places) if place is not None}
    if all(sure_K is not None and len(sure_K) == points for sure_K in told.values()):
        found.confidence_TK = np.zeros((len(places), points))
        found.confidence_TK[list(told)] = np.stack([sure_K for sure_K in told.values() if sure_K is not None])
    found.notes, found.where = notes, f"{where}, person '{person}'"
    return found


def _names_of(names: Any, meta: Any, points: int) -> list[str] | None:
    """The names of so many points: those that the file lists, or MMPose's dictionary of them by number."""
    listed = _texts(names)
    if listed is not None:
        return listed
    by_number = meta.get("keypoint_id2name") if isinstance(meta, dict) else None
    if not isinstance(by_number, dict) or len(by_number) != points:
        return None
    order = sorted(by_number, key=lambda key: int(key[:9]) if key.isdecimal() else 0)
    return [str(by_number[key]) for key in order]


def _texts(names: Any) -> list[str] | None:
    return [str(name) for name in names] if isinstance(names, list) and names else None


def _spread(numbers: Sequence[int], rows: Sequence[Row]) -> list[Row]:
    """The rows by the numbers of their frames; nothing in frames that are not there."""
    placed = dict(zip(numbers, rows, strict=True))
    return [placed.get(number, NOTHING) for number in range(max(numbers) + 1)]


def _placed(path: Path, where: str, rows: list[Row], names: list[str] | None = None) -> Keypoints:
    """The points of all frames, each in the column of its name, or of its place where points have none.

    Args:
        path: the file, for sentences.
        where: in it they are.
        rows: frame by frame.
        names: of the columns, where the file lists them. Names that are numbers are places in this list.
    """
    seen = [row for row in rows if row.points]
    if any(row.names is None for row in seen) and any(row.names for row in seen):
        odd = next(frame for frame, row in enumerate(rows) if row.points and row.names is None)
        raise UserError(f"{path}: {where} has points without names in frame {odd}, and with names in others")
    own = list(dict.fromkeys(name for row in seen for name in row.names or ()))
    if not own:
        places, width = None, max((len(row.points) for row in rows), default=0)
    elif all(name.isdecimal() and len(name) < 10 for name in own):
        places = {name: int(name) for name in own}
        width = max(len(names or ()), *(place + 1 for place in places.values()))
    else:
        names = names if names is not None and set(own) <= set(names) else own
        places, width = {name: place for place, name in enumerate(names)}, len(names)
    check_size(path, where, len(rows), width)
    point_TKX = np.full((len(rows), width, 4), np.nan)
    for frame, row in enumerate(rows):
        for place, point in enumerate(row.points):
            column = place if places is None or row.names is None else places[row.names[place]]
            point_TKX[frame, column, : len(point)] = point
    has_fourth = bool(np.isfinite(point_TKX[..., 3]).any())
    return Keypoints(point_TKX[..., :3], names or None, point_TKX[..., 3] if has_fourth else None, where=where)


def _picture(box: Any) -> np.ndarray | None:
    """Where the middle of a box [x1, y1, x2, y2] is (2,), in its heights; None of anything else."""
    box = box[0] if isinstance(box, list) and len(box) == 1 else box
    if not isinstance(box, list) or len(box) != 4 or not all(type(x) in (int, float) and abs(x) < 1e6 for x in box):
        return None
    height = box[3] - box[1]
    return np.array([box[0] + box[2], box[1] + box[3]]) / (2 * height) if height > 0 else None


def _array(path: Path, value: Any, where: str) -> np.ndarray:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise UserError(f"{path}: {where} is no number, nor lists of numbers of one length") from error
