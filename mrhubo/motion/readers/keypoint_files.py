"""Keypoints as files have them: arrays in .npy and .npz, and JSON.

JSON is `{"fps": 30, "names": [...], "keypoints": [[[x, y, z], ...], ...], "confidence": [[...], ...]}`, or a list of
frames, each a list of points [x, y, z], [x, y, z, confidence] or {"x": ..., "y": ..., "z": ..., "visibility": ...}; or
what MMPose writes (`meta_info`, `instance_info`: https://github.com/open-mmlab/mmpose/blob/main/demo/docs/en/3d_human_pose_demo.md).

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.files.tree import read_tree, tree_of
from mrhubo.motion.readers.content import Content, NoMotion
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

_POSE_KEYS = {
    "poses", "pose_body", "body_pose", "pose", "smpl_poses", "pose_world", "fullpose", "thetas", "pose_aa",
    "pred_rotmat", "smpl_thetas", "poses_body", "local_rot_mats", "rotations", "pred_keypoints_3d",
}  # fmt: skip
"""Beside rotations, points say nothing new."""
_JSON = re.compile(
    r"\s*(?:\[\s*[\[{]|\{.*\"(?:" + "|".join((*POINT_KEYS, "instance_info", "frames")) + r")\"\s*:)", re.DOTALL
)
_MAX_JSON = 2**27
_MOST_POINTS = 1_000


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
        return _from_mmpose(path, value, options)
    if isinstance(value, dict):
        names, confidence = (
            next((value[key] for key in keys if key in value), None) for keys in (NAME_KEYS, CONFIDENCE_KEYS)
        )
        key = next((key for key in (*POINT_KEYS, "frames", "data") if key in value), None)
        if key is None:
            raise NoMotion(
                f"{path}: is JSON with {shortened(', '.join(map(str, list(value)[:10])), 120)}; expected 'keypoints'"
            )
        value, where = value[key], f"'{key}'"
    if not isinstance(value, list) or not value:
        raise UserError(f"{path}: {where} is no list of frames")
    rows = [_frame(path, where, number, frame) for number, frame in enumerate(value)]
    given = next((list(row[1]) for row in rows if row[1]), None)
    width = max(len(row[0]) for row in rows)
    point_TKX = np.full((len(rows), width, 4), np.nan)
    for number, (points, _) in enumerate(rows):
        for place, point in enumerate(points):
            point_TKX[number, place, : len(point)] = point
    if width > _MOST_POINTS:
        raise UserError(f"{path}: {where} has {width} points a frame; expected at most {_MOST_POINTS}")
    has_fourth = bool(np.isfinite(point_TKX[..., 3]).any())
    found = Keypoints(point_TKX[..., :3], where=where)
    found.confidence_TK = point_TKX[..., 3] if has_fourth else None
    found.names = [str(name) for name in (names if isinstance(names, list) else given or [])] or None
    if confidence is not None:
        found.confidence_TK = _numbers(path, confidence, "'confidence'")
    told = rate_in(tree_of(whole, path, ""), found.notes)
    found.rate = None if told is None else told[1]
    return found


def _frame(path: Path, where: str, number: int, frame: Any) -> tuple[list[list[float]], list[str]]:
    """The points of a frame, and their names if they have some; none where nothing was seen."""
    if isinstance(frame, dict):
        inner = next((frame[key] for key in POINT_KEYS if key in frame), None)
        frame = inner if inner is not None else frame
    if frame is None:
        return [], []
    names: list[str] = []
    if isinstance(frame, dict):
        names, frame = [str(name) for name in frame], list(frame.values())
    if not isinstance(frame, list):
        raise UserError(f"{path}: {where} has no list of points in frame {number}")
    points = []
    for point in frame:
        if isinstance(point, dict):
            if "name" in point:
                names.append(str(point["name"]))
            sure = next((point[key] for key in ("visibility", "confidence", "score", "presence") if key in point), None)
            point = [point.get("x"), point.get("y"), point.get("z"), *([] if sure is None else [sure])]
        if point is None:
            point = [None, None, None]
        if not isinstance(point, list) or len(point) not in (3, 4):
            what = f"{len(point)} numbers" if isinstance(point, list) else shortened(point, 30)
            raise UserError(f"{path}: {where} has a point of {what} in frame {number}; expected x, y and z")
        points.append([_number(path, where, number, x) for x in point])
    return points, names


def _from_mmpose(path: Path, value: dict[str, Any], options: ReadOptions) -> Keypoints:
    """MMPose's: people in frames, told apart by `track_id`, or else by their place."""
    people: dict[str, dict[int, tuple[Any, Any]]] = {}
    info = value["instance_info"]
    for number, frame in enumerate(info):
        instances = frame.get("instances") if isinstance(frame, dict) else None
        for place, one in enumerate(instances if isinstance(instances, list) else []):
            if isinstance(one, dict) and "keypoints" in one:
                person = str(one.get("track_id", place))
                people.setdefault(person, {})[number] = (one["keypoints"], one.get("keypoint_scores"))
    if not people:
        raise UserError(f"{path}: 'instance_info' has nobody with 'keypoints'")
    person = options.person or max(people, key=lambda name: len(people[name]))
    if person not in people:
        raise UserError(f"{path}: has no person '{shortened(person, 30)}'; there are {', '.join(list(people)[:20])}")
    frames = [people[person].get(number, (None, None)) for number in range(len(info))]
    found = _from_json(path, [points for points, _ in frames], options)
    shape = found.point_TK3.shape[:2]
    if any(scores is not None for _, scores in frames):
        nothing = np.zeros(shape[1])
        rows = [nothing if s is None else _numbers(path, s, "'keypoint_scores'").reshape(-1) for _, s in frames]
        if all(len(row) == shape[1] for row in rows):
            found.confidence_TK = np.stack(rows)
    names = value.get("meta_info", {}).get("keypoint_id2name") if isinstance(value.get("meta_info"), dict) else None
    if isinstance(names, dict) and len(names) == shape[1]:
        order = sorted(names, key=lambda key: int(key[:9]) if key.isdecimal() else 0)
        found.names = [str(names[key]) for key in order]
    found.where = f"'instance_info', person '{shortened(person, 30)}'"
    if len(people) > 1:
        found.notes.append(f"{len(people)} people are in the file; person '{shortened(person, 30)}' is read")
    return found


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
