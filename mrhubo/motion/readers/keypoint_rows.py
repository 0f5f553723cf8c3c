"""Points of one frame in JSON: those of each of the people in it, by name or by place.

Legend: K keypoints.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.keypoint_arrays import LIFT, point_key

_PEOPLE = ("instances", "people", "bodies", "body_list", "object_list", "persons", "skeletons", "actors")
_SURE = ("visibility", "confidence", "score", "presence")
_MORE_POINTS = ("jointdata", "bones", "bodyparts", "transforms", "body", "jointmodeltransforms", "jointtransforms")
"""What frames call points beside what arrays of them are called."""
_PLACES = (
    "position",
    "pos",
    "worldposition",
    "globalposition",
    "translation",
    "location",
    "coordinates",
    "coords",
    "xyz",
    "transform",
    "modeltransform",
    "worldtransform",
    "matrix",
)
"""What a point that has more than a place, as a bone's rotation, calls that."""
_NAMES = ("name", "jointname", "joint", "bonename", "bone", "label", "part", "keypoint", "landmark")
"""What points in a list call the joint that they are."""
_FLAT = 4
"""Numbers of a single point, at most."""


@dataclass(frozen=True)
class Row:
    """The points of a frame; none where nothing was seen."""

    points: list[list[float]]
    names: list[str] | None = None
    """Where points have them."""


NOTHING = Row([])


def counts_of_frame(path: Path, frame: Any) -> list[int]:
    """How many points each of the people in a frame has, which is a file of its own.

    Raises:
        UserError: it has no points.
    """
    people = people_of(frame)
    return [len(row_of(path, "the file", 0, one).points) for one in ([frame] if people is None else people)]


def people_of(frame: Any) -> list[Any] | None:
    """The people of a frame: dictionaries, or lists of points; None where it is one person's, or nobody's."""
    if isinstance(frame, dict):
        found = next((frame[key] for key in _PEOPLE if isinstance(frame.get(key), list)), None)
        key = points_key(frame)
        if found is None and key is None:  # a scene around them
            inner = [child for child in frame.values() if isinstance(child, dict)]
            return people_of(inner[0]) if len(inner) == 1 and not _is_point(inner[0]) else None
        return found if found is not None or key is None else people_of(frame[key])
    first = frame[0] if isinstance(frame, list) and frame else None
    if isinstance(first, dict):
        return frame if points_key(first) is not None else None
    if isinstance(first, list) and _translation(first) is not first:
        return None
    return frame if isinstance(first, list) and first and isinstance(first[0], dict | list) else None


def row_of(path: Path, where: str, number: int, frame: Any) -> Row:
    """The points of one person in a frame."""
    key = points_key(frame) if isinstance(frame, dict) else None
    frame = frame if key is None else frame[key]
    if frame is None:
        return NOTHING
    names: list[str] = []
    if isinstance(frame, dict):
        points = {str(name): point for name, point in frame.items() if not isinstance(point, str | int | float)}
        names, frame = list(points), list(points.values())  # what is left out is a time, say
    elif isinstance(frame, list):
        names = [name for point in frame if isinstance(point, dict) and (name := _name(point)) is not None]
    if not isinstance(frame, list):
        raise UserError(f"{path}: {where} has no list of points in frame {number}")
    if len(frame) > _FLAT and all(type(x) in (int, float) for x in frame):  # COCO's way, without an axis for the points
        width = 3 if len(frame) % 3 == 0 else 4
        frame = [frame[start : start + width] for start in range(0, len(frame), width)]
    points = []
    for point in frame:
        if isinstance(point, dict):
            point = _listed(point)
        if isinstance(point, list) and len(point) == 2 and all(isinstance(part, list) for part in point):
            point = point[0]  # a bone's place, and its rotation
        point = _translation(point)
        if point is None:
            point = [None, None, None]
        if not isinstance(point, list) or len(point) not in (3, 4):
            if isinstance(point, list) and len(point) == 2:
                raise NoMotion(f"{path}: {where} has points in a picture (x and y); {LIFT}")
            what = f"a point of {len(point)} numbers" if isinstance(point, list) else f"'{shortened(point, 30)}'"
            raise UserError(f"{path}: {where} has {what} in frame {number}; expected points, [x, y, z] each")
        points.append([_number(path, where, number, x) for x in point])
    if len(names) not in (0, len(points)):
        raise UserError(f"{path}: {where} names {len(names)} of the {len(points)} points in frame {number}; name all")
    if len(set(names)) < len(names):
        twice = next(name for place, name in enumerate(names) if name in names[:place])
        raise UserError(f"{path}: {where} has two points '{shortened(twice, 30)}' in frame {number}")
    return Row(points, names or None)


def points_key(frame: dict[str, Any]) -> str | None:
    """The key under which a frame, or one of the people in it, has points."""
    return point_key(frame) or next((key for key in frame if _plain(key) in _MORE_POINTS), None)


def _is_point(found: dict[str, Any]) -> bool:
    """Whether a dictionary is a point and no more."""
    return any(_plain(key) in ("x", *_PLACES) for key in found)


def _name(point: dict[str, Any]) -> str | None:
    """The name that a point has; None where it has none."""
    plain = point if "name" in point else {_plain(key): value for key, value in point.items()}
    name = next((plain[key] for key in _NAMES if isinstance(plain.get(key), str | int)), None)
    return None if name is None else str(name)


def _listed(point: dict[str, Any]) -> Any:
    """A point's numbers in a list, where they stand under keys."""
    plain = point if "x" in point else {_plain(key): value for key, value in point.items()}
    place = next((plain[key] for key in _PLACES if key in plain), plain)
    if isinstance(place, dict):
        by_axis = {str(key).lower(): value for key, value in place.items()}
        place = [by_axis.get(axis) for axis in "xyz"]
    sure = next((plain[key] for key in _SURE if key in plain), None)
    return [*place, sure] if sure is not None and isinstance(place, list) and len(place) == 3 else place


def _translation(point: Any) -> Any:
    """The place of a joint's axes in a matrix of 16 numbers, or 4 times 4, of rows or, as ARKit's, of columns; anything
    else as it is.
    """
    if not isinstance(point, list) or len(point) not in (4, 16):
        return point
    flat = point
    if len(point) == 4:
        if not all(isinstance(part, list) and len(part) == 4 for part in point):
            return point
        flat = [number for part in point for number in part]
    if not all(type(number) in (int, float) for number in flat) or flat[15] != 1:
        return point
    return flat[12:15] if not any(flat[3:15:4]) else flat[3:15:4] if not any(flat[12:15]) else point


def _plain(key: Any) -> str:
    return "".join(filter(str.isalnum, str(key).lower()))


def _number(path: Path, where: str, frame: int, value: Any) -> float:
    if value is None:
        return np.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > 1e30:
        raise UserError(f"{path}: {where} has '{shortened(value, 30)}' for a number in frame {frame}")
    return float(value)
