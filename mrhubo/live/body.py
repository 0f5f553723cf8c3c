"""From points of a body, seen in one frame, to the pose that a stream takes; what is not seen stays as it was.

It is what `mrhubo.motion.positions` makes of a whole motion, for who knows no later frame: a limb whose points are
missing stays where it was last seen, as seen from the trunk, and a straight arm's elbow keeps the axis about which it
bent last. Legs are left at rest: no stream moves them.

World: y up, right-handed [m]. Human frame at rest: x to the body's left, y up, z forward.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, PARENTS, POSED_JOINT_NAMES, SIDES, hinge_axis
from mrhubo.fast.plain.human import BEND_DEG
from mrhubo.live.vectors import (
    IDENTITY,
    Rotation,
    Vector,
    across,
    apply,
    chained,
    cross,
    dot,
    mean,
    minus,
    norm,
    part_of,
    plus,
    relative,
    shortest,
    transposed,
    undo,
    unit,
)
from mrhubo.motion.hinges import BENT
from mrhubo.motion.orientations import PARALLEL, SHORTEST, TRIADS, Triad, rest_points

UPRIGHT_CONFIDENCE = 0.6
"""How sure the trunk is, at most, where no hip is seen and it is taken to be upright."""
_REST: dict[str, Vector] = {name: (float(x), float(y), float(z)) for name, ((x, y, z),) in rest_points().items()}
_HANGING: Vector = (0.0, -1.0, 0.0)
_UP: Vector = (0.0, 1.0, 0.0)
_SHOULDERS = [f"{side}_shoulder" for side in SIDES]
_POSED = {name: number for number, name in enumerate(POSED_JOINT_NAMES)}


@dataclass
class _Arm:
    """What is remembered of an arm, as seen from the chest."""

    upper: Vector = _HANGING
    lower: Vector = _HANGING
    bent: tuple[Vector, Vector] | None = None
    """The upper arm when the elbow was bent last, and the axis about which it was."""
    hand: Rotation = IDENTITY
    """As seen from the forearm."""


@dataclass(frozen=True)
class SeenPose:
    """What one frame tells of a person."""

    local_J33: np.ndarray
    """Local rotations (21, 3, 3) of SMPL's joints 1..21, float32."""
    sure_J: np.ndarray
    """How sure (21,), 0..1; 0 where a joint stays as it was because it is not seen."""


@dataclass
class Body:
    """A person of whom points come frame by frame."""

    chest: Rotation | None = None
    pelvis: Rotation = IDENTITY
    """As seen from the chest, as is the head."""
    head: Rotation = IDENTITY
    arms: dict[str, _Arm] = field(default_factory=lambda: {side: _Arm() for side in SIDES})

    def see(self, points: Mapping[str, Vector], sure: Mapping[str, float]) -> SeenPose | None:
        """The pose of one frame; None as long as nothing has told how the chest is turned.

        Args:
            points: those that are seen [m], by our names (`mrhubo.motion.readers.keypoint_sets`); finite numbers.
            sure: how sure the source is of points, 0..1; 1 where it does not say.
        """
        seen = _Points(points, sure)
        chest_sure = self._trunk(seen)
        if self.chest is None:
            return None
        world: dict[str, Rotation] = {"spine3": self.chest, "pelvis": chained(self.chest, self.pelvis)}
        found = {"spine3": chest_sure}
        head, head_sure = seen.turn("head")
        if head is not None:
            self.head = relative(self.chest, head)
        world["neck"] = chained(self.chest, part_of(self.head, 0.5))
        world["head"] = chained(self.chest, self.head)
        found["neck"] = found["head"] = min(head_sure, chest_sure)
        for side in SIDES:
            self._arm(seen, side, world, found)
        return _pose(world, found, chest_sure)

    def _trunk(self, seen: _Points) -> float:
        """How the trunk is turned, and how sure that is."""
        chest, sure = seen.turn("spine3")
        pelvis, _ = seen.turn("pelvis")
        if chest is None and seen.has(*_SHOULDERS):
            left, right = (seen.points[name] for name in _SHOULDERS)
            chest = _turn_between(minus(left, right), _UP, Triad(((_SHOULDERS[1],), (_SHOULDERS[0],)), ((), ())))
            sure = min(UPRIGHT_CONFIDENCE, seen.surety(*_SHOULDERS))
        if chest is None:
            return 0.0
        self.chest = chest
        if pelvis is not None:
            self.pelvis = relative(chest, pelvis)
        return sure

    def _arm(self, seen: _Points, side: str, world: dict[str, Rotation], found: dict[str, float]) -> None:
        """Upper arm, forearm and hand, in the world, and how sure they are."""
        arm, chest = self.arms[side], world["spine3"]
        shoulder, elbow, wrist = (f"{side}_{name}" for name in ("shoulder", "elbow", "wrist"))
        upper, lower = (seen.way(*ends, chest) for ends in ((shoulder, elbow), (elbow, wrist)))
        arm.upper, arm.lower = upper or arm.upper, lower or arm.lower
        axis = _elbow_axis(arm, elbow, upper is not None and lower is not None)
        bone, rest_axis = unit(minus(_REST[elbow], _REST[shoulder])), hinge_axis(elbow)
        at_rest = _frame(bone, rest_axis)
        turned = _frame(arm.upper, axis)
        assert at_rest is not None and turned is not None  # both axes are at right angles to the bones
        upper_turn = chained(turned, transposed(at_rest))
        lower_bone = unit(minus(_REST[wrist], _REST[elbow]))
        lower_turn = chained(shortest(apply(upper_turn, lower_bone), arm.lower), upper_turn)
        world[shoulder], world[elbow] = chained(chest, upper_turn), chained(chest, lower_turn)
        hand, hand_sure = seen.turn(wrist)
        if hand is not None:
            arm.hand = relative(world[elbow], hand)
        world[wrist] = chained(world[elbow], arm.hand)
        trunk_sure = found["spine3"]
        found[shoulder] = min(seen.surety(shoulder, elbow) if upper else 0.0, trunk_sure)
        found[elbow] = min(seen.surety(elbow, wrist) if lower else 0.0, trunk_sure)
        found[wrist] = min(hand_sure, trunk_sure)


class _Points:
    """The points of one frame."""

    def __init__(self, points: Mapping[str, Vector], sure: Mapping[str, float]) -> None:
        self.points, self._sure = points, sure

    def has(self, *names: str) -> bool:
        return all(name in self.points for name in names)

    def surety(self, *names: str) -> float:
        return min(self._sure.get(name, 1.0) for name in names)

    def way(self, start: str, end: str, seen_from: Rotation) -> Vector | None:
        """The direction of a bone, as a part sees it."""
        if not self.has(start, end):
            return None
        way = minus(self.points[end], self.points[start])
        return unit(undo(seen_from, way)) if norm(way) > SHORTEST else None

    def turn(self, joint: str) -> tuple[Rotation | None, float]:
        """How a part is turned in the world, relative to our rest pose, by the best of its triads that is seen."""
        for triad, names in _TRIADS[joint]:
            if self.has(*names):
                first, second = (_between(vector, self.points) for vector in (triad.first, triad.second))
                found = _turn_between(first, second, triad)
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
            frame = _frame(_between(triad.first, _REST), _between(triad.second, _REST))
            if frame is not None:
                found[triad] = transposed(frame)
    return found


def _turn_between(first: Vector, second: Vector, triad: Triad) -> Rotation | None:
    """The turn of a part whose two vectors are these; None where they fix none."""
    frame = _frame(first, second)
    return None if frame is None else chained(frame, _REST_FRAMES.get(triad, _UPRIGHT))


def _frame(first: Vector, second: Vector) -> Rotation | None:
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


def _elbow_axis(arm: _Arm, elbow: str, known: bool) -> Vector:
    """A unit vector at right angles to the upper arm: of the plane of both bones where the elbow is bent, else as when
    it was bent last (`mrhubo.motion.hinges`).
    """
    plane = cross(arm.upper, arm.lower)
    bend = math.atan2(norm(plane), dot(arm.upper, arm.lower))
    if known and bend > BENT:
        arm.bent = arm.upper, unit(plane)
    shoulder = JOINT_NAMES[PARENTS[_POSED[elbow] + 1]]
    start, own = arm.bent or (unit(minus(_REST[elbow], _REST[shoulder])), hinge_axis(elbow))
    own = unit(across(apply(shortest(start, arm.upper), own), arm.upper))
    if norm(own) < 0.5:  # the arm points to where it was opposite when the axis was known
        own = unit(across((0.0, 0.0, 1.0) if abs(arm.upper[2]) < 0.7 else _UP, arm.upper))
    share = min(1.0, max(0.0, (math.degrees(bend) - BEND_DEG["plane_low_deg"]) / _PLANE_DEG))
    share *= share * (3.0 - 2.0 * share)
    mixed = plus(apply(((share, 0.0, 0.0), (0.0, share, 0.0), (0.0, 0.0, share)), unit(plane)), own, 1.0 - share)
    axis = unit(across(mixed, arm.upper))
    return axis if norm(axis) > 0.5 else own


_PLANE_DEG = BEND_DEG["plane_high_deg"] - BEND_DEG["plane_low_deg"]


def _pose(world: dict[str, Rotation], found: dict[str, float], chest_sure: float) -> SeenPose:
    """Local rotations of all joints; spine and collars as `mrhubo.motion.positions` shares them out."""
    pelvis, chest = world["pelvis"], world["spine3"]
    back = relative(pelvis, chest)
    world["spine1"], world["spine2"] = (chained(pelvis, part_of(back, share)) for share in (1 / 3, 2 / 3))
    for side in SIDES:
        world[f"{side}_collar"] = chest
    local_J33 = np.tile(np.eye(3, dtype=np.float32), (len(_POSED), 1, 1))
    for name, turn in world.items():
        if name != "pelvis":
            place = _POSED[name]
            local_J33[place] = transposed(relative(world[JOINT_NAMES[PARENTS[place + 1]]], turn))
    sure_J = np.array([found.get(name, chest_sure) for name in POSED_JOINT_NAMES])
    return SeenPose(local_J33, sure_J)
