"""The messages that a live session is sent, as JSON: what docs/live.md specifies, and nothing else.

Whatever is wrong with one, it is `Refused`, with the kind of fault under which it is counted.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from mrhubo.body.joints import KEYPOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.fast.rotations import are_crooked, axis_angle_to_matrix, quaternion_to_matrix
from mrhubo.live.body import Root, SeenPose
from mrhubo.live.point_sets import POINT_SETS, PointSet
from mrhubo.live.vectors import Vector
from mrhubo.motion.orientations import HEAD_POINTS
from mrhubo.motion.readers.sightings import UNSURE

VERSION = 1
MAX_BYTES = 65_536
"""Of one message."""
_MOST_POINTS = 256
_FARTHEST = 1e3
"""No coordinate of a point is further from 0 [m]."""
_MOST_TURN = 6 * math.pi
_LONGEST_NAME = 64
_OURS = {*KEYPOINT_NAMES, *HEAD_POINTS}
_JOINTS = len(POSED_JOINT_NAMES)


class Refused(Exception):
    """A message that changes nothing; its text is the kind of fault: `malformed`, `version`, `too_long`."""


@dataclass(frozen=True)
class Landmarks:
    """Points of a person."""

    points: dict[str, Vector]
    """Those that are seen [m], y up, right-handed, by our names."""
    sure: dict[str, float]
    """How sure the sender is of each, 0..1."""
    in_world: bool = False
    """Whether the points tell where the person is in the world, and not from the hips alone."""
    axes_known: bool = True
    """Whether the sender's axes surely are right-handed."""

    @classmethod
    def of(cls, told: Sequence[tuple[str, Vector, float]], **axes: bool) -> Landmarks:
        """Those that are seen of some points, each with how sure the sender is of it; `axes` are the other fields."""
        seen = [one for one in told if one[2] >= UNSURE]
        return cls({name: point for name, point, _ in seen}, {name: sure for name, _, sure in seen}, **axes)


@dataclass(frozen=True)
class Nobody:
    """The sender sees nobody."""


@dataclass(frozen=True)
class Heartbeat:
    """The sender is there."""

    held: bool
    """Whether its key or button is held, so that the robot may move."""


Content = Landmarks | SeenPose | Nobody | Heartbeat


@dataclass(frozen=True)
class Message:
    """One message."""

    session: str
    """Of the sender: another one each time it starts."""
    number: int
    """Greater with every message of a session."""
    time: float
    """On the sender's clock, when what it tells was seen [s]."""
    content: Content


def read_message(data: bytes | str) -> Message:
    """A message of its JSON.

    Raises:
        Refused: it is too long, no JSON, of another version, or not what docs/live.md specifies.
    """
    if len(data) > MAX_BYTES:
        raise Refused("too_long")
    try:
        told = json.loads(data, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise Refused("malformed") from error
    if not isinstance(told, dict):
        raise Refused("malformed")
    if told.get("mrhubo") != VERSION or isinstance(told["mrhubo"], bool):
        raise Refused("version")
    session, number, kind = told.get("session"), told.get("number"), told.get("kind")
    if not isinstance(session, str) or not 0 < len(session) <= _LONGEST_NAME:
        raise Refused("malformed")
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 2**53:
        raise Refused("malformed")
    reader = _KINDS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        raise Refused("malformed")
    return Message(session, number, _number(told.get("time"), 1e12), reader(told))


def _no_number(name: str) -> NoReturn:
    raise ValueError(name)


def _number(value: Any, most: float) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not -most <= value <= most:
        raise Refused("malformed")
    return float(value)


def _landmarks(told: dict[str, Any]) -> Landmarks:
    name = told.get("set")
    known = POINT_SETS.get(name) if isinstance(name, str) else None
    if known is None:
        raise Refused("malformed")
    triples = _list(told.get("points"))
    names = _names(known, told, len(triples))
    weights = told.get("visibility")
    weights = [1.0] * len(triples) if weights is None else _list(weights)
    if len(names) != len(triples) or len(weights) != len(triples):
        raise Refused("malformed")
    found: list[tuple[str, Vector, float]] = []
    for ours, triple, weight in zip(names, triples, weights, strict=True):
        if ours is None or triple is None or weight is None:
            continue
        x, y, z = (_number(value, _FARTHEST) for value in _list(triple, 3))
        point = known.signs[0] * x, known.signs[1] * y, known.signs[2] * z
        found.append((ours, point, min(1.0, max(0.0, _number(weight, 1e6)))))
    in_world = told.get("world", known.in_world)
    if not isinstance(in_world, bool):
        raise Refused("malformed")
    return Landmarks.of(found, in_world=in_world, axes_known=known.axes_known)


def _names(known: PointSet, told: dict[str, Any], count: int) -> list[str | None]:
    """Our name of each point; None where it is not used."""
    if known.names is not None:
        return [None if name == "-" else name for name in known.names]
    theirs = _list(told.get("names"))
    if any(not isinstance(name, str) or len(name) > _LONGEST_NAME for name in theirs) or len(set(theirs)) < len(theirs):
        raise Refused("malformed")
    ours = theirs if known.theirs is None else [known.theirs.get(name) for name in theirs]
    return [name if name in _OURS else None for name in ours]


def _list(value: Any, length: int | None = None) -> list[Any]:
    if not isinstance(value, list) or len(value) > _MOST_POINTS or (length is not None and len(value) != length):
        raise Refused("malformed")
    return value


def _rotations(told: dict[str, Any]) -> SeenPose:
    rows = [[_number(value, _MOST_TURN) for value in _list(row)] for row in _list(told.get("rotations"), _JOINTS)]
    widths = {len(row) for row in rows}
    if widths == {3}:
        angle = max(math.sqrt(x * x + y * y + z * z) for x, y, z in rows)
        if angle > _MOST_TURN:
            raise Refused("malformed")
        local_J33 = axis_angle_to_matrix(np.array(rows))
    elif widths == {4}:
        local_J33 = of_quaternions(np.array(rows))
    else:
        raise Refused("malformed")
    if are_crooked(local_J33).any():
        raise Refused("malformed")
    weights = told.get("confidence")
    weights = [1.0] * _JOINTS if weights is None else [_number(value, 1e6) for value in _list(weights, _JOINTS)]
    return SeenPose(local_J33.astype(np.float32), np.clip(weights, 0.0, 1.0), _root(told.get("root")))


def _root(told: Any) -> Root | None:
    """Where the pelvis is."""
    if told is None:
        return None
    if not isinstance(told, dict):
        raise Refused("malformed")
    row = [_number(value, _MOST_TURN) for value in _list(told.get("rotation"))]
    if len(row) not in (3, 4):
        raise Refused("malformed")
    turn_133 = axis_angle_to_matrix(np.array([row])) if len(row) == 3 else of_quaternions(np.array([row]))
    if are_crooked(turn_133).any():
        raise Refused("malformed")
    place = told.get("place")
    place_3 = None if place is None else np.array([_number(value, _FARTHEST) for value in _list(place, 3)])
    return Root(turn_133[0], place_3)


def of_quaternions(xyzw_J4: np.ndarray) -> np.ndarray:
    """Rotations (J, 3, 3) of quaternions, w last, which need not be of length 1.

    Raises:
        Refused: one is nearly 0, and no rotation.
    """
    length_J1 = np.sqrt((xyzw_J4**2).sum(-1, keepdims=True))
    if not (length_J1 > 0.1).all():
        raise Refused("malformed")
    return quaternion_to_matrix(xyzw_J4 / length_J1)


def numbers(values: Sequence[Any], count: int, most: float) -> list[float]:
    """So many numbers that a stranger's message tells, none of them further from 0 than `most`.

    Raises:
        Refused: there are fewer or more, or one is none, NaN, or further.
    """
    found = [float(value) for value in values if isinstance(value, int | float) and abs(value) <= most]
    if len(found) != count:
        raise Refused("malformed")
    return found


def quaternion(values: Sequence[Any]) -> list[float]:
    """Four such numbers, nearly of length 1.

    Raises:
        Refused: there are fewer or more, or they are no rotation.
    """
    found = numbers(values, 4, 2.0)
    if not 0.5 < math.sqrt(sum(number * number for number in found)) < 2.0:
        raise Refused("malformed")
    return found


def _heartbeat(told: dict[str, Any]) -> Heartbeat:
    held = told.get("held")
    if not isinstance(held, bool):
        raise Refused("malformed")
    return Heartbeat(held)


_KINDS = {
    "landmarks": _landmarks,
    "rotations": _rotations,
    "nobody": lambda told: Nobody(),
    "heartbeat": _heartbeat,
}
