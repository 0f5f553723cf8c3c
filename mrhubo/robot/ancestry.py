"""Who is above whom in a robot's tree, and which joints turn a link."""

from __future__ import annotations

from mrhubo.robot.entries import End
from mrhubo.robot.keypoints import Limb
from mrhubo.robot.model import Robot


class Ancestry:
    """The tree of one robot, asked about its links."""

    def __init__(self, robot: Robot) -> None:
        """The joints that turn links as q says are known from the robot."""
        self._description, self._driven = robot.description, set(robot.driven_joints)

    def turning(self, link: str) -> dict[str, None]:
        """The joints that turn a link as q says, nearest first."""
        above = self._description.joints_above(link)
        return {joint.name: None for joint in above if joint.name in self._driven}

    def movable(self, link: str) -> dict[str, None]:
        """The joints above a link that are not fixed, whether q says how they stand or not, nearest first."""
        return {joint.name: None for joint in self._description.joints_above(link) if joint.kind != "fixed"}

    def turns_apart(self, inner: str, outer: str) -> str | None:
        """A joint that turns the inner link and not the outer one."""
        outside = self.turning(outer)
        return next((joint for joint in self.turning(inner) if joint not in outside), None)

    def is_above(self, link: str, other: str) -> bool:
        """Whether a link is another one, or above it."""
        return link == other or any(joint.parent == link for joint in self._description.joints_above(other))

    def is_inward(self, limb: Limb, view: End) -> bool:
        """Whether the tree runs through a limb towards the body: its root is a foot, or a hand."""
        inner, outer = limb.start.link, limb.end.link
        return inner != outer and self.is_above(outer, inner) and self.turns_apart(inner, view.link) is None

    def carrier_of(self, links: list[str]) -> str:
        """The last link that is above all of the given ones, or one of them."""
        paths = [[*(joint.parent for joint in reversed(self._description.joints_above(x))), x] for x in links]
        shared = [column for column in zip(*paths, strict=False) if len(set(column)) == 1]
        return shared[-1][0]
