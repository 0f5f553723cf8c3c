"""The points of a body in one frame: which are seen, where bones point, and how parts are turned by them.

World: y up, right-handed [m].
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

from mrhubo.live.vectors import (
    IDENTITY,
    Rotation,
    Vector,
    across,
    chained,
    cross,
    mean,
    minus,
    norm,
    transposed,
    undo,
    unit,
)
from mrhubo.motion.orientations import PARALLEL, SHORTEST, TRIADS, Triad, rest_points

REST: dict[str, Vector] = {name: (float(x), float(y), float(z)) for name, ((x, y, z),) in rest_points().items()}
"""Points of our skeleton at rest [m], by their names."""
_SHORTEST_BONE = 0.05
"""What is shorter [m] is nobody's thigh or shin."""


class SeenPoints:
    """The points of one frame."""

    def __init__(self, points: Mapping[str, Vector], sure: Mapping[str, float]) -> None:
        """Both by our names; who is not in `sure` is sure."""
        self.points, self._sure = points, sure

    def has(self, *names: str) -> bool:
        """Whether all of them are seen."""
        return all(name in self.points for name in names)

    def surety(self, *names: str) -> float:
        """How sure the source is of the least sure of them, 0..1."""
        return min(self._sure.get(name, 1.0) for name in names)

    def way(self, start: str, end: str, seen_from: Rotation) -> Vector | None:
        """The direction of a bone, as a part sees it."""
        if not self.has(start, end):
            return None
        way = minus(self.points[end], self.points[start])
        return unit(undo(seen_from, way)) if norm(way) > SHORTEST else None

    def length(self, *names: str) -> float | None:
        """How long a chain of bones is [m]; None where a point is missing, or two are one."""
        if not self.has(*names):
            return None
        ways = [norm(minus(self.points[b], self.points[a])) for a, b in pairwise(names)]
        return sum(ways) if min(ways) > _SHORTEST_BONE else None

    def turn(self, joint: str) -> tuple[Rotation | None, float]:
        """How a part is turned in the world, relative to our rest pose, by the best of its triads that is seen."""
        for triad, names in _TRIADS[joint]:
            if self.has(*names):
                first, second = (_between(vector, self.points) for vector in (triad.first, triad.second))
                found = turn_between(first, second, triad)
                if found is not None:
                    return found, self.surety(*names)
        return None, 0.0


_TRIADS = {joint: [(triad, tuple(triad.names)) for triad in triads] for joint, triads in TRIADS.items()}


def _between(vector: tuple[tuple[str, ...], tuple[str, ...]], points: Mapping[str, Vector]) -> Vector:
    start, end = (mean([points[name] for name in place]) for place in vector)
    return minus(end, start)


def _rest_frames() -> dict[Triad, Rotation]:
    """Of each triad, the transpose of its frame at rest."""
    found = {}
    for triads in TRIADS.values():
        for triad in triads:
            frame = frame_of(_between(triad.first, REST), _between(triad.second, REST))
            if frame is not None:
                found[triad] = transposed(frame)
    return found


def turn_between(first: Vector, second: Vector, triad: Triad) -> Rotation | None:
    """The turn of a part whose two vectors are these; None where they fix none."""
    frame = frame_of(first, second)
    return None if frame is None else chained(frame, _REST_FRAMES.get(triad, _UPRIGHT))


def frame_of(first: Vector, second: Vector) -> Rotation | None:
    """As `mrhubo.motion.orientations.frame_of`: None where the vectors are short or nearly parallel."""
    length, other = norm(first), norm(second)
    if length < SHORTEST or other < SHORTEST:
        return None
    x = unit(first)
    side = across(second, x)
    if norm(side) < PARALLEL * other:
        return None
    y = unit(side)
    return x, y, cross(x, y)


_UPRIGHT: Rotation = IDENTITY
"""At rest the shoulders' line is the x axis, and up is y."""
_REST_FRAMES = _rest_frames()
