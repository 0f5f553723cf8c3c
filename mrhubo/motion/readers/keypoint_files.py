"""Keypoints as files have them: arrays in .npy and .npz, and JSON.

JSON is `{"fps": 30, "names": [...], "keypoints": [[[x, y, z], ...], ...], "confidence": [[...], ...]}`, or a list of
frames, each a list of points [x, y, z], [x, y, z, confidence] or {"x": ..., "y": ..., "z": ..., "visibility": ...}, or
points by name, as {"left_hip": [x, y, z], ...} or with a "name" each, in any order, some of them perhaps missing; or
what MMPose writes (`meta_info`, `instance_info`:
https://github.com/open-mmlab/mmpose/blob/main/demo/docs/en/3d_human_pose_demo.md).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.files.tree import read_tree, tree_of
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.frame_numbers import frame_numbers_in
from mrhubo.motion.readers.keypoint_arrays import (
    CONFIDENCE_KEYS,
    NAME_KEYS,
    POINT_KEYS,
    Keypoints,
    in_array,
    in_npz,
)
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import rate_in
from mrhubo.motion.readers.sightings import Sighting, check_size, frames_of_one, person_called

_POSE_KEYS = {
    "poses", "pose_body", "body_pose", "pose", "smpl_poses", "pose_world", "fullpose", "thetas", "pose_aa",
    "pred_rotmat", "smpl_thetas", "poses_body", "local_rot_mats", "rotations", "pred_keypoints_3d",
}  # fmt: skip
"""Beside rotations, points say nothing new."""
_JSON = re.compile(
    r"\s*(?:\[\s*[\[{]|\{.*\"(?:" + "|".join((*POINT_KEYS, "instance_info", "frames")) + r")\"\s*:)", re.DOTALL
)
_MAX_JSON = 2**27


def holds_points(content: Content) -> bool:
    """Whether a file has points and no rotations, by the names of its arrays; or is JSON with something that may be
    points. Does not raise.
    """
    if content.arrays:
        return bool(content.arrays & set(POINT_KEYS)) and not content.arrays & _POSE_KEYS
    return content.text is not None and bool(_JSON.match(content.text))


def read_keypoints_file(path: Path, options: ReadOptions) -> Keypoints:
    """Reads points.

    Raises:
        UserError: the file is damaged, or holds no points of frames; says what it holds.
    """
    content = Content.open(path)
    if content.is_npy:
        return checked(path, in_array(path, read_tree(path)))
    if content.arrays:
        return checked(path, in_npz(path, read_tree(path)))
    try:
        value = json.loads(read_regular(path, _MAX_JSON))
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: is no JSON: {shortened(str(error), 80)}") from error
    return checked(path, _from_json(path, value, options))


def _from_json(path: Path, value: Any, options: ReadOptions) -> Keypoints:
    names, confidence, whole = None, None, value
    where = "the list"
    if isinstance(value, dict) and isinstance(value.get("instance_info"), list):
        return _from_mmpose(path, "'instance_info'", value["instance_info"], value.get("meta_info"), options)
    if isinstance(value, list) and value and all(isinstance(one, dict) and "instances" in one for one in value):
        return _from_mmpose(path, where, value, None, options)
    if isinstance(value, dict):
        names = next((value[key] for key in NAME_KEYS if key in value), None)
        told = (value.get(key) for key in CONFIDENCE_KEYS)
        confidence = next((each for each in told if isinstance(each, list) and each), None)
        key = next((key for key in (*POINT_KEYS, "frames", "data") if key in value), None)
        if key is None:
            raise NoMotion(
                f"{path}: is JSON with {shortened(', '.join(map(str, list(value)[:10])), 120)}; expected 'keypoints'"
            )
        value, where = value[key], f"'{key}'"
    if not isinstance(value, list) or not value:
        raise UserError(f"{path}: {where} is no list of frames")
    check_size(path, where, len(value), 1)
    rows = [_frame(path, where, number, frame) for number, frame in enumerate(value)]
    found = _placed(path, where, rows, [str(name) for name in names] if isinstance(names, list) else None)
    if confidence is not None:
        found.confidence_TK = _numbers(path, confidence, "'confidence'")
    told = rate_in(tree_of(whole, path, ""), found.notes)
    found.rate = None if told is None else told[1]
    return found


@dataclass(frozen=True)
class _Row:
    """The points of a frame; none where nothing was seen."""

    points: list[list[float]]
    names: list[str] | None = None
    """Where points have them."""


_NOTHING = _Row([])


def _frame(path: Path, where: str, number: int, frame: Any) -> _Row:
    if isinstance(frame, dict):
        inner = next((frame[key] for key in POINT_KEYS if key in frame), None)
        frame = inner if inner is not None else frame
    if frame is None:
        return _NOTHING
    names: list[str] = []
    if isinstance(frame, dict):
        names, frame = [str(name) for name in frame], list(frame.values())
    elif isinstance(frame, list):
        names = [str(point["name"]) for point in frame if isinstance(point, dict) and "name" in point]
    if not isinstance(frame, list):
        raise UserError(f"{path}: {where} has no list of points in frame {number}")
    points = []
    for point in frame:
        if isinstance(point, dict):
            sure = next((point[key] for key in ("visibility", "confidence", "score", "presence") if key in point), None)
            point = [point.get("x"), point.get("y"), point.get("z"), *([] if sure is None else [sure])]
        if point is None:
            point = [None, None, None]
        if not isinstance(point, list) or len(point) not in (3, 4):
            what = f"{len(point)} numbers" if isinstance(point, list) else shortened(point, 30)
            raise UserError(f"{path}: {where} has a point of {what} in frame {number}; expected x, y and z")
        points.append([_number(path, where, number, x) for x in point])
    if len(names) not in (0, len(points)):
        raise UserError(f"{path}: {where} names {len(names)} of the {len(points)} points in frame {number}; name all")
    if len(set(names)) < len(names):
        twice = next(name for place, name in enumerate(names) if name in names[:place])
        raise UserError(f"{path}: {where} has two points '{shortened(twice, 30)}' in frame {number}")
    return _Row(points, names or None)


def _placed(path: Path, where: str, rows: list[_Row], names: list[str] | None = None) -> Keypoints:
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


def _from_mmpose(path: Path, where: str, info: list[Any], meta: Any, options: ReadOptions) -> Keypoints:
    """MMPose's: people in frames, told apart by `track_id`, or else followed, in the picture too where there are boxes:
    points that were lifted from it may be around one origin.
    """
    rows: list[_Row] = []
    scores: list[np.ndarray | None] = []
    seen: list[Sighting] = []
    for number, frame in zip(_frame_ids(path, info), info, strict=True):
        instances = frame.get("instances") if isinstance(frame, dict) else None
        for one in instances if isinstance(instances, list) else []:
            if isinstance(one, dict) and "keypoints" in one:
                row = _frame(path, where, number, one["keypoints"])
                sure_K = one.get("keypoint_scores")
                sure_K = None if sure_K is None else _numbers(path, sure_K, "'keypoint_scores'").reshape(-1)
                sure_K = None if sure_K is None or len(sure_K) != len(row.points) else sure_K
                point_K3 = np.array([point[:3] for point in row.points]).reshape(-1, 3)
                rows.append(row)
                scores.append(sure_K)
                seen.append(
                    Sighting(number, person_called(one.get("track_id")), point_K3, sure_K, _picture(one.get("bbox")))
                )
    if not seen:
        raise UserError(f"{path}: {where} has nobody with 'keypoints'")
    notes: list[str] = []
    person, places = frames_of_one(path, seen, options, notes)
    found = _placed(path, where, [_NOTHING if place is None else rows[place] for place in places])
    found.notes = notes
    frames, points = found.point_TK3.shape[:2]
    told = {frame: scores[place] for frame, place in enumerate(places) if place is not None}
    if all(sure_K is not None and len(sure_K) == points for sure_K in told.values()):
        found.confidence_TK = np.zeros((frames, points))
        found.confidence_TK[list(told)] = np.stack([sure_K for sure_K in told.values() if sure_K is not None])
    names = meta.get("keypoint_id2name") if isinstance(meta, dict) else None
    if isinstance(names, dict) and len(names) == points:
        order = sorted(names, key=lambda key: int(key[:9]) if key.isdecimal() else 0)
        found.names = [str(names[key]) for key in order]
    found.where = f"{where}, person '{person}'"
    return found


def _picture(box: Any) -> np.ndarray | None:
    """Where the middle of a box [x1, y1, x2, y2] is (2,), in its heights; None of anything else."""
    box = box[0] if isinstance(box, list) and len(box) == 1 else box
    if not isinstance(box, list) or len(box) != 4 or not all(type(x) in (int, float) and abs(x) < 1e6 for x in box):
        return None
    height = box[3] - box[1]
    return np.array([box[0] + box[2], box[1] + box[3]]) / (2 * height) if height > 0 else None


def _frame_ids(path: Path, info: list[Any]) -> list[int]:
    """The number of each frame: by `frame_id`, or by its place where these are no numbers of their own."""
    given = [frame.get("frame_id") if isinstance(frame, dict) else None for frame in info]
    if all(type(number) is int and number >= 0 for number in given) and len(set(given)) == len(given):
        return frame_numbers_in(path, [str(number) for number in given])
    return list(range(len(info)))


def checked(path: Path, found: Keypoints) -> Keypoints:
    """The same with a confidence (T, K) between 0 and 1.

    Raises:
        UserError: names or confidence do not fit the points.
    """
    shape = found.point_TK3.shape[:2]
    if found.names is not None and len(found.names) != shape[1]:
        raise UserError(f"{path}: has {len(found.names)} names for {shape[1]} points")
    if found.confidence_TK is not None:
        sure = found.confidence_TK
        sure = sure[..., 0] if sure.ndim == 3 and sure.shape[2] == 1 else sure
        if sure.shape == shape[1:]:
            sure = np.broadcast_to(sure, shape)
        if sure.shape != shape:
            raise UserError(f"{path}: confidence has shape {sure.shape}; expected {shape}")
        found.confidence_TK = np.clip(np.nan_to_num(sure, nan=0.0, posinf=0.0, neginf=0.0), 0.0, 1.0)
    return found


def _numbers(path: Path, value: Any, where: str) -> np.ndarray:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise UserError(f"{path}: {where} is no number, nor lists of numbers of one length") from error


def _number(path: Path, where: str, frame: int, value: Any) -> float:
    if value is None:
        return np.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > 1e30:
        raise UserError(f"{path}: {where} has '{shortened(value, 30)}' for a number in frame {frame}")
    return float(value)
