"""Whether points of a person are told in left-handed axes, as Unity's are: nose, toes and bent knees then point
backward.

It is what `mrhubo.motion.readers.keypoints` finds out for a whole file. A stream has to say it at its first frame, and
may think again when many frames say otherwise.
"""

from __future__ import annotations

from mrhubo.body.joints import SIDES
from mrhubo.live.vectors import Vector, across, cross, dot, mean, minus, norm, plus, unit

CLEAR = 0.3
"""How clearly nose, toes and knees must point forward or backward, of 1, for a frame to say anything."""
_BENT = 0.08
"""How far a knee is beside the line from hip to ankle, of the leg's length, where it tells which way it bends."""
_MOST = 60
"""Frames that are remembered of what was said: so many that say otherwise, and as many again, change it."""


class Handedness:
    """Of one stream's axes."""

    def __init__(self) -> None:
        self.mirrored = False
        """Whether axes are left-handed."""
        self._said = 0
        """By how many frames more axes are right-handed than left-handed, of the last ones."""

    def right(self, points: dict[str, Vector]) -> dict[str, Vector]:
        """The points of one frame in right-handed axes, where x is mirrored if they are not."""
        way = way_forward(points)
        if abs(way) > CLEAR:
            one = 1 if way > 0 else -1
            begins, self._said = self._said == 0, max(-_MOST, min(_MOST, self._said + one))
            if begins or abs(self._said) == _MOST:
                self.mirrored = self._said < 0
        return {name: (-x, y, z) for name, (x, y, z) in points.items()} if self.mirrored else points


def way_forward(points: dict[str, Vector]) -> float:
    """How far nose, toes and bent knees point forward, -1 to 1, for a body whose left is where names say; 0 where
    nothing tells.
    """
    trunk = [f"{side}_{name}" for name in ("hip", "shoulder") for side in SIDES]
    if not all(name in points for name in trunk):
        return 0.0
    left_hip, right_hip, left_shoulder, right_shoulder = (points[name] for name in trunk)
    up = minus(plus(left_shoulder, right_shoulder), plus(left_hip, right_hip))
    forward = unit(cross(minus(left_hip, right_hip), up))
    ways = []
    head = next((pair for pair in _PAIRS if all(name in points for name in pair)), None)
    if "nose" in points and head is not None:
        ways.append(minus(points["nose"], mean([points[name] for name in head])))
    for side in SIDES:
        toe = next((points[name] for name in (f"{side}_toe", f"{side}_foot") if name in points), None)
        if toe is not None and f"{side}_ankle" in points:
            ways.append(minus(toe, points[f"{side}_ankle"]))
        if all(f"{side}_{joint}" in points for joint in ("hip", "knee", "ankle")):
            hip, knee, ankle = (points[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
            beside = across(minus(knee, hip), unit(minus(ankle, hip)))
            if norm(beside) > _BENT * 2 * norm(minus(knee, hip)):
                ways.append(beside)
    return sum(dot(unit(way), forward) for way in ways) / len(ways) if ways else 0.0


_PAIRS = [tuple(f"{side}_{name}" for side in SIDES) for name in ("ear", "shoulder")]
"""Between which points the nose is in front of."""
