"""What a robot's own axes tell about its body, against which a body map is held, and the entries that they make."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrhubo.body.skeleton import PAIRED_KEYPOINTS
from mrhubo.errors import UserError
from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.discovery import Discovery, FoundPoint, discover
from mrhubo.robot.entries import End, Point
from mrhubo.robot.keypoints import Keypoints
from mrhubo.robot.model import Robot
from mrhubo.robot.standing import StandingRobot
from mrhubo.robot.suggestions import axes_entry, point_entry

_SURE = 0.5
"""Confidence from which on something counts as known: below it the user is asked (`Discovery.questions`)."""
_SAME_M, _SAME_DEG = 1e-3, 0.5
"""How near an entry is to another one that need not be told in its place."""


class Yardstick:
    """The joint centres, the facing and the sides that were found out of one robot; of some robots nothing."""

    def __init__(self, robot: Robot) -> None:
        """Looks at the robot's tree and axes (`mrhubo.robot.discovery`)."""
        self._tree, self._description = Ancestry(robot), robot.description
        self.found: Discovery | None
        """None: nothing that could be a humanoid was found, so nothing is known."""
        try:
            self.found = discover(robot.description)
        except UserError:
            self.found = None

    def turned(self, end: End, name: str) -> float | None:
        """Degrees by which an oriented part is turned from where it was found to look; None where nothing sure was."""
        found = None if self.found is None else self.found.ends.get(name)
        if self.found is None or found is None or found.confidence < _SURE:
            return None
        standing = StandingRobot(self._description, {})
        given_23 = end.axes_23.numpy().astype(float) @ standing.poses[end.link][:3, :3].T
        found_23 = (
            np.stack([np.asarray(axis_3) for axis_3 in found.axes.values()]) @ standing.poses[found.link][:3, :3].T
        )
        third_23 = [np.cross(*axes_23) for axes_23 in (given_23, found_23)]
        trace = float((given_23 * found_23).sum() + third_23[0] @ third_23[1])
        return float(np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1))))

    @property
    def facing_cue(self) -> str:
        """What told where the robot faces."""
        return "nothing" if self.found is None else self.found.forward.cue

    def centre(self, name: str, link: str) -> Point | None:
        """The joint centre of a keypoint, on the side of the robot on which a link is, whatever a map calls that side;
        None where the axes do not tell it.
        """
        found = None if self.found is None else self._on_side(self.found.geometric, name, link)
        return None if found is None else Point(found.link, found.offset_3)

    def distance(self, name: str, point: Point) -> float | None:
        """Metres from a point to the joint centre of a keypoint, with every joint at 0; None where there is none."""
        centre = self.centre(name, point.link)
        standing = StandingRobot(self._description, {})
        if centre is None:
            return None
        return float(np.linalg.norm(standing.position(centre) - standing.position(point)))

    def entry(self, name: str, link: str | None = None) -> str | None:
        """The entry of a point or oriented part as it was found; of a point on the side on which a link is, if one is
        given.
        """
        if self.found is None:
            return None
        if name in self.found.ends:
            return axes_entry(name, self.found.ends[name].link, self.found.ends[name].axes)
        found = self.found.points.get(name) if link is None else self._on_side(self.found.points, name, link)
        return None if found is None else point_entry(name, Point(found.link, found.offset_3))

    def advice(self, *names: str, after: str = "; ", given: Keypoints | None = None) -> str:
        """``; the robot's axes tell: left_elbow: l_lower, left_wrist: l_hand``, to end a sentence; or nothing, as where
        just these entries are given.
        """
        names = tuple(name for name in names if given is None or not self._is_given(name, given))
        entries = [entry for name in names if (entry := self.entry(name)) is not None]
        return f"{after}the robot's axes tell: {', '.join(entries)}" if entries else ""

    def _is_given(self, name: str, given: Keypoints) -> bool:
        """Whether an entry is the one that was found."""
        if self.found is None:
            return False
        if name in given.ends:
            turned = self.turned(given.ends[name], name)
            return turned is not None and turned < _SAME_DEG
        found, standing = self.found.points.get(name), StandingRobot(self._description, {})
        if found is None or name not in given.points:
            return False
        apart_3 = standing.position(Point(found.link, found.offset_3)) - standing.position(given.points[name])
        return float(np.linalg.norm(apart_3)) < _SAME_M

    def _on_side(self, points: Mapping[str, FoundPoint], name: str, link: str) -> FoundPoint | None:
        both = next((pair for pair in PAIRED_KEYPOINTS.values() if name in pair), (name,))
        there = [points[each] for each in both if each in points]
        above = self._tree.movable(link)
        return max(there, key=lambda point: len(self._tree.movable(point.link).keys() & above.keys()), default=None)
