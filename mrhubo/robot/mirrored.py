"""Whether the entries of one side are mirror images of the other's, where the robot's two sides are."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.errors import InputWarning
from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.discovery.lines import unit
from mrhubo.robot.entries import End, Point
from mrhubo.robot.joint import Joint
from mrhubo.robot.standing import StandingRobot
from mrhubo.robot.suggestions import axes_entry, oriented, point_entry

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_ALIKE_M, _ALIKE_COSINE = 0.01, 0.996
"""How far from its mirror image an axis of the other side may be, and the cosine of the angle between them (5 degrees),
where two sides are alike."""
_ACROSS = 0.1
"""Cosine of the angle to the plane's normal up to which an axis lies in the plane's direction."""
_UNLIKE_M, _UNLIKE_DEG = 0.02, 15.0
"""From where on an entry is no mirror image: what turns a limb of 20 cm by 6 degrees, or a hand by more than a frame is
put on askew."""


def check_mirrored(body_map: BodyMap) -> None:
    """Warns of pairs of entries that are no mirror images of each other, where the joints that carry them are."""
    found, keypoints = body_map.yardstick.found, body_map.keypoints
    if found is None or not keypoints.pairs:
        return
    standing = StandingRobot(body_map.robot.description, {})
    mirror = _Mirror(body_map, standing, np.asarray(found.forward.root_3), np.asarray(found.up.root_3))
    words = {part.name: part.words for part in oriented(keypoints)}
    for left, right in keypoints.pairs:
        one, other = ((keypoints.points.get(name) or keypoints.ends[name]) for name in (left, right))
        if not mirror.carries(one.link, other.link):
            continue
        if isinstance(one, Point) and isinstance(other, Point):
            places = [standing.position(point) for point in (one, other)]
            apart = float(np.linalg.norm(mirror.image(places[0]) - places[1]))
            if apart > _UNLIKE_M:
                entries = [point_entry(name, standing.on_link(point.link, mirror.image(place_3)))
                           for name, point, place_3 in ((right, other, places[0]), (left, one, places[1]))]  # fmt: skip
                _warn(left, right, f"{1000 * apart:.0f} mm from it", entries)
        elif isinstance(one, End) and isinstance(other, End):
            axes = [standing.poses[end.link][:3, :3] @ end.axes_23.numpy().astype(float).T for end in (one, other)]
            cosine_2 = (mirror.image(axes[0].T, False) * axes[1].T).sum(axis=1)
            off = float(np.degrees(np.arccos(np.clip(cosine_2, -1, 1))).max())
            if off <= _UNLIKE_DEG:
                continue
            entries = []
            for name, end, turned_32 in ((right, other, axes[0]), (left, one, axes[1])):
                local_23 = mirror.image(turned_32.T, False) @ standing.poses[end.link][:3, :3]
                entries.append(axes_entry(name, end.link, dict(zip(words[name], local_23.tolist(), strict=True))))
            _warn(left, right, f"{off:.0f} degrees from it", entries)


def _warn(left: str, right: str, how: str, entries: list[str]) -> None:
    warnings.warn(
        f"robot.keypoints.{right}: is no mirror image of '{left}' ({how}), though the joints that carry the two are; "
        f"write {entries[0]}, or {entries[1]}",
        InputWarning,
        stacklevel=3,
    )


class _Mirror:
    """The plane between left and right of a robot, with every joint at 0."""

    def __init__(self, body_map: BodyMap, standing: StandingRobot, forward_3: np.ndarray, up_3: np.ndarray) -> None:
        """Halfway between the axes of the two sides, along forward and up."""
        self._tree, self._standing = Ancestry(body_map.robot), standing
        self._joints = body_map.robot.description.joints
        self._normal_3 = unit(np.cross(up_3, forward_3))
        points = body_map.keypoints.points
        links = [(points[a].link, points[b].link) for a, b in body_map.keypoints.pairs if {a, b} <= points.keys()]
        both = [[standing.line(joint) for joint in two] for pair in links for two in self._both(*pair)]
        # Of an axis across the plane, any point will do, so it does not tell where the plane is.
        middles = [
            float((one.point_3 + other.point_3) @ self._normal_3) / 2
            for one, other in both
            if abs(float(one.axis_3 @ self._normal_3)) < _ACROSS
        ]
        self._across = float(np.median(middles)) if middles else 0.0

    def _both(self, left: str, right: str) -> list[tuple[Joint, Joint]]:
        """The joints that carry only one of two links each, pair by pair from the body outwards."""
        one, other = (list(reversed(self._tree.movable(link))) for link in (left, right))
        own = [[name for name in names if name not in others] for names, others in ((one, other), (other, one))]
        return (
            [(self._joints[a], self._joints[b]) for a, b in zip(*own, strict=True)]
            if len(own[0]) == len(own[1])
            else []
        )

    def image(self, vector_3: np.ndarray, place: bool = True) -> np.ndarray:
        """The mirror image of a place (..., 3), or of a direction."""
        across = np.asarray(vector_3 @ self._normal_3 - (self._across if place else 0.0))
        return vector_3 - 2 * across[..., None] * self._normal_3

    def carries(self, left: str, right: str) -> bool:
        """Whether two links are carried by joints that are mirror images of each other."""
        both = self._both(left, right)
        for one, other in both:
            here, there = self._standing.line(one), self._standing.line(other)
            if there.distance(self.image(here.point_3)) > _ALIKE_M:
                return False
            if abs(float(self.image(here.axis_3, False) @ there.axis_3)) < _ALIKE_COSINE:
                return False
        return bool(both)
