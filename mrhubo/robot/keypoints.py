"""`robot.keypoints` of a config as a whole: which links of a robot stand for which rows of the table of body parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from mrhubo.body.skeleton import PAIRED_KEYPOINTS
from mrhubo.errors import UserError, unknown_name
from mrhubo.robot.entries import End, Point, read_end, read_point
from mrhubo.robot.parts import PARTS, BendPart, BodyPart, LimbPart, OrientedPart


@dataclass(frozen=True)
class Limb:
    """A direction from one point of the robot to another."""

    part: LimbPart
    start: Point
    end: Point

    @property
    def name(self) -> str:
        """The direction's name."""
        return self.part.end


@dataclass(frozen=True)
class Axis:
    """A direction that is fixed to a link."""

    part: OrientedPart
    name: str
    link: str
    axis_3: Tensor
    """In the link's frame."""
    rest: tuple[float, float, float]
    """Where it points on a human at rest, human frame."""


@dataclass(frozen=True)
class Keypoints:
    """The parts that a robot has, and where on the robot they are."""

    parts: tuple[BodyPart, ...]
    """The rows of the table that the robot has, in the table's order."""
    points: dict[str, Point]
    """Ends of limbs, by human keypoint."""
    ends: dict[str, End]
    """Link and axes of the oriented parts, by part."""
    root_follows: str = "pelvis"
    """How the base is turned (`mrhubo.robot.root_turn`): "pelvis", "chest" or "between"."""

    @property
    def links(self) -> tuple[str, ...]:
        """The links that carry the parts; first those from which others are seen."""
        views = [end.link for name, end in self.ends.items() if not self._row(name).seen_from]
        seen = [end.link for name, end in self.ends.items() if self._row(name).seen_from]
        return (*views, *(point.link for point in self.points.values()), *seen)

    def differences(self, other: Keypoints) -> list[str]:
        """Names of the points and oriented parts that are elsewhere on the other robot, or that only one has."""
        mine, theirs = ({**keypoints.points, **keypoints.ends} for keypoints in (self, other))
        return [name for name in {**mine, **theirs} if not _same(mine.get(name), theirs.get(name))]

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Entries of which the robot has the left and the right one: points, and parts by the joints that turn them."""
        both = [(left, right) for left, right in PAIRED_KEYPOINTS.values() if {left, right} <= self.points.keys()]
        ends = {self._row(name).joint: name for name in self.ends}
        both += [(ends[left], ends[right]) for left, right in PAIRED_KEYPOINTS.values() if {left, right} <= ends.keys()]
        return tuple(both)

    @property
    def standing(self) -> tuple[OrientedPart, ...]:
        """The parts that stand on the floor."""
        return tuple(part for part in self.parts if isinstance(part, OrientedPart) and part.stands)

    def _row(self, name: str) -> BodyPart:
        return next(part for part in self.parts if part.name == name)

    @cached_property
    def directions(self) -> tuple[Limb | Axis, ...]:
        """Limbs and axes that robot and human share, in the table's order."""
        found: list[Limb | Axis] = []
        for part in self.parts:
            if isinstance(part, LimbPart):
                found.append(Limb(part, self.points[part.start], self.points[part.end]))
            elif isinstance(part, OrientedPart):
                end = self.ends[part.name]
                rows = zip(part.direction_names, end.axes_23, part.rest, strict=False)
                found += [Axis(part, name, end.link, axis_3, rest) for name, axis_3, rest in rows]
        return tuple(found)


def _is_alone(part: OrientedPart, ends: Mapping[str, End]) -> bool:
    """Whether nothing turns a part that a robot has: what carries it is missing, or is the same link."""
    carrier = ends.get(part.hangs_on or "")
    return part.by_itself and (carrier is None or carrier.link == ends[part.name].link)


def _same(one: Point | End | None, other: Point | End | None) -> bool:
    if isinstance(one, End) and isinstance(other, End):
        return one.link == other.link and one.sole == other.sole and bool(torch.equal(one.axes_23, other.axes_23))
    return one == other


def entry_names(table: Sequence[BodyPart] = PARTS) -> tuple[str, ...]:
    """The entries that `robot.keypoints` can have of some parts, in the order of the table."""
    names: list[str] = []
    for part in table:
        if isinstance(part, LimbPart):
            names += [part.start, part.end]
        elif isinstance(part, OrientedPart):
            names.append(part.name)
    return tuple(dict.fromkeys(names))


def read_keypoints(entries: Mapping[str, Any], table: Sequence[BodyPart] = PARTS) -> Keypoints:
    """The entries of `robot.keypoints`, checked; whether their links exist is not looked at.

    Args:
        entries: a link name, or what else `robot.entries` reads, by point or oriented part.
        table: the body parts that there are.

    Raises:
        UserError: an entry is wrong or missing; says which, and the nearest valid name.
    """
    limbs = [part for part in table if isinstance(part, LimbPart)]
    oriented = {part.name: part for part in table if isinstance(part, OrientedPart)}
    point_names = list(dict.fromkeys(name for limb in limbs for name in (limb.start, limb.end)))
    for name in entries:
        if name not in (*point_names, *oriented):
            raise UserError(f"robot.keypoints.{name}: {unknown_name('body part', name, (*point_names, *oriented))}")
    points = {name: read_point(name, entries[name]) for name in point_names if name in entries}
    for limb in limbs:
        if limb.end in points and limb.start not in points:
            raise UserError(
                f"robot.keypoints.{limb.end}: needs '{limb.start}' too; a limb is a direction between the two"
            )
    ends = {
        name: read_end(name, entries[name], part.words, bool(part.stands))
        for name, part in oriented.items()
        if name in entries
    }
    carriers = {limb.name: limb.end for limb in limbs}
    for name in ends:
        point = carriers.get(oriented[name].hangs_on or "")
        if point and point not in points:
            raise UserError(f"robot.keypoints.{name}: needs '{point}' too")
    there = {limb.name for limb in limbs if limb.end in points} | ends.keys()
    parts = tuple(
        part.alone if isinstance(part, OrientedPart) and _is_alone(part, ends) else part
        for part in table
        if part.name in there or (isinstance(part, BendPart) and {part.hangs_on, part.bent} <= there)
    )
    found = Keypoints(parts, points, ends)
    for part in parts:
        if part.seen_from and part.seen_from not in ends:
            shown = part.start if isinstance(part, LimbPart) else part.name
            raise UserError(f"robot.keypoints: '{part.seen_from}' is missing; name the link that carries '{shown}'")
    if not found.directions:
        raise UserError("robot.keypoints: names no limb; give at least one side's shoulder and elbow")
    return found
