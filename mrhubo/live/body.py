"""From points of a body, seen in one frame, to the pose that a stream takes; what is not seen stays as it was.

It is what `mrhubo.motion.positions` makes of a whole motion, for who knows no later frame: a limb whose points are
missing stays where it was last seen, as seen from the trunk, and a straight limb's elbow or knee keeps the axis about
which it bent last. Legs are read where a robot has some, else they are left at rest. Points that tell where the person
is in the world tell the root's place, as far from 0 as a person with legs of our skeleton's length would go.

World: y up, right-handed [m]. Human frame at rest: x to the body's left, y up, z forward.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, PARENTS, POSED_JOINT_NAMES, SIDES, hinge_axis
from mrhubo.fast.plain.human import BEND_DEG
from mrhubo.live.seen_points import REST, SeenPoints, frame_of, turn_between
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
    unit,
)
from mrhubo.motion.hinges import BACKWARD, BENT
from mrhubo.motion.orientations import Triad

UPRIGHT_CONFIDENCE = 0.6
"""How sure the trunk is, at most, where no hip is seen and it is taken to be upright."""
_HANGING: Vector = (0.0, -1.0, 0.0)
_UP: Vector = (0.0, 1.0, 0.0)
_SHOULDERS = [f"{side}_shoulder" for side in SIDES]
_HIPS = [f"{side}_hip" for side in SIDES]
_LENGTHS = 60
"""So many frames, about, tell how long a person's legs are."""
_POSED = {name: number for number, name in enumerate(POSED_JOINT_NAMES)}


@dataclass
class _Limb:
    """What is remembered of an arm, as seen from the chest, or of a leg, as seen from the pelvis."""

    upper: Vector = _HANGING
    lower: Vector = _HANGING
    bent: tuple[Vector, Vector] | None = None
    """The upper bone when the hinge was bent last, and the axis about which it was."""
    tip: Rotation | None = None
    """The hand or foot, as seen from the lower bone, on which it rests until it is seen."""


class Root(NamedTuple):
    """Where the pelvis of a person is, in a world whose y is up."""

    turn_33: np.ndarray
    """Its rotation, float64."""
    place_3: np.ndarray | None
    """[m]; None: it is not known, as of landmarks whose 0 is between the hips."""


@dataclass(frozen=True)
class SeenPose:
    """What one frame tells of a person."""

    local_J33: np.ndarray
    """Local rotations (21, 3, 3) of SMPL's joints 1..21, float32."""
    sure_J: np.ndarray
    """How sure (21,), 0..1; 0 where a joint stays as it was because it is not seen."""
    root: Root | None = None
    """None: the source does not tell, or nobody asks."""


@dataclass
class Body:
    """A person of whom points come frame by frame."""

    has_legs: bool = False
    """Whether legs and root are wanted."""
    chest: Rotation | None = None
    pelvis: Rotation = IDENTITY
    """As seen from the chest, as is the head."""
    head: Rotation = IDENTITY
    arms: dict[str, _Limb] = field(default_factory=lambda: {side: _Limb() for side in SIDES})
    legs: dict[str, _Limb] = field(default_factory=lambda: {side: _Limb() for side in SIDES})
    hips: Vector | None = None
    """Where the middle of the hips was last, in the world [m]."""
    length: float | None = None
    """Of a leg [m], from hip to ankle."""
    _lengths: int = 0

    def see(self, points: Mapping[str, Vector], sure: Mapping[str, float], in_world: bool = False) -> SeenPose | None:
        """The pose of one frame; None as long as nothing has told how the chest is turned.

        Args:
            points: those that are seen [m], by our names (`mrhubo.motion.readers.keypoint_sets`); finite numbers.
            sure: how sure the source is of points, 0..1; 1 where it does not say.
            in_world: whether points tell where the person is in the world, too.
        """
        seen = SeenPoints(points, sure)
        chest_sure, pelvis_sure = self._trunk(seen)
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
            _see_limb(seen, self.arms[side], side, ("shoulder", "elbow", "wrist"), world["spine3"], world, found,
                      found["spine3"])  # fmt: skip
        if not self.has_legs:
            return _pose(world, found, chest_sure)
        for side in SIDES:
            _see_limb(seen, self.legs[side], side, ("hip", "knee", "ankle"), world["pelvis"], world, found,
                      pelvis_sure, one_way=True)  # fmt: skip
            world[f"{side}_foot"], found[f"{side}_foot"] = world[f"{side}_ankle"], found[f"{side}_ankle"]
        pose = _pose(world, found, chest_sure)
        return SeenPose(pose.local_J33, pose.sure_J, self._root(seen, world["pelvis"], in_world))

    def _root(self, seen: SeenPoints, pelvis: Rotation, in_world: bool) -> Root:
        """Where the pelvis is: the middle of its hips, of a person whose legs are as long as our skeleton's."""
        turn_33 = np.array(pelvis).T
        if not in_world:
            return Root(turn_33, None)
        lengths = [seen.length(*(f"{side}_{name}" for name in ("hip", "knee", "ankle"))) for side in SIDES]
        told = [length for length in lengths if length is not None]
        if told:
            self._lengths = min(self._lengths + 1, _LENGTHS)
            last = told[0] if self.length is None else self.length
            self.length = last + (sum(told) / len(told) - last) / self._lengths
        if seen.has(*_HIPS):
            self.hips = mean([seen.points[name] for name in _HIPS])
        if self.hips is None or self.length is None:
            return Root(turn_33, None)
        ratio = LEG_LENGTH / self.length
        place = minus((ratio * self.hips[0], ratio * self.hips[1], ratio * self.hips[2]), apply(pelvis, _MIDDLE))
        return Root(turn_33, np.array(place))

    def _trunk(self, seen: SeenPoints) -> tuple[float, float]:
        """How the trunk is turned, and how sure that is of chest and pelvis."""
        chest, sure = seen.turn("spine3")
        pelvis, pelvis_sure = seen.turn("pelvis")
        if chest is None and seen.has(*_SHOULDERS):
            left, right = (seen.points[name] for name in _SHOULDERS)
            chest = turn_between(minus(left, right), _UP, Triad(((_SHOULDERS[1],), (_SHOULDERS[0],)), ((), ())))
            sure = min(UPRIGHT_CONFIDENCE, seen.surety(*_SHOULDERS))
        if chest is None:
            return 0.0, 0.0
        self.chest = chest
        if pelvis is not None:
            self.pelvis = relative(chest, pelvis)
        return sure, min(sure, pelvis_sure)


def _see_limb(
    seen: SeenPoints, limb: _Limb, side: str, joints: tuple[str, str, str], carrier: Rotation,
    world: dict[str, Rotation], found: dict[str, float], carrier_sure: float, one_way: bool = False,
) -> None:  # fmt: skip
    """Upper bone, lower bone, and hand or foot, in the world, and how sure they are. `one_way`: as a knee bends."""
    start, hinge, end = (f"{side}_{name}" for name in joints)
    upper, lower = (seen.way(*ends, carrier) for ends in ((start, hinge), (hinge, end)))
    limb.upper, limb.lower = upper or limb.upper, lower or limb.lower
    axis = _hinge_axis(limb, hinge, upper is not None and lower is not None, one_way)
    bone, rest_axis = unit(minus(REST[hinge], REST[start])), hinge_axis(hinge)
    at_rest = frame_of(bone, rest_axis)
    turned = frame_of(limb.upper, axis)
    assert at_rest is not None and turned is not None  # both axes are at right angles to the bones
    upper_turn = chained(turned, transposed(at_rest))
    lower_bone = unit(minus(REST[end], REST[hinge]))
    lower_turn = chained(shortest(apply(upper_turn, lower_bone), limb.lower), upper_turn)
    world[start], world[hinge] = chained(carrier, upper_turn), chained(carrier, lower_turn)
    tip, tip_sure = seen.turn(end)
    if tip is not None:
        limb.tip = relative(world[hinge], tip)
    world[end] = world[hinge] if limb.tip is None else chained(world[hinge], limb.tip)
    found[start] = min(seen.surety(start, hinge) if upper else 0.0, carrier_sure)
    found[hinge] = min(seen.surety(hinge, end) if lower else 0.0, carrier_sure)
    # many senders have no points of hands at all, and arms are to follow them; who stands on feet has to know them
    found[end] = found[hinge] if limb.tip is None and not one_way else min(tip_sure, carrier_sure)


def _hinge_axis(limb: _Limb, hinge: str, known: bool, one_way: bool) -> Vector:
    """A unit vector at right angles to the upper bone: of the plane of both bones where the hinge is bent, else as when
    it was bent last (`mrhubo.motion.hinges`).
    """
    plane = cross(limb.upper, limb.lower)
    bend = math.atan2(norm(plane), dot(limb.upper, limb.lower))
    above = JOINT_NAMES[PARENTS[_POSED[hinge] + 1]]
    at_rest = unit(minus(REST[hinge], REST[above])), hinge_axis(hinge)
    if one_way and bend < BACKWARD and dot(plane, apply(shortest(at_rest[0], limb.upper), at_rest[1])) < 0:
        plane, bend = (0.0, 0.0, 0.0), 0.0
    if known and bend > BENT:
        limb.bent = limb.upper, unit(plane)
    start, own = limb.bent or at_rest
    own = unit(across(apply(shortest(start, limb.upper), own), limb.upper))
    if norm(own) < 0.5:  # the limb points to where it was opposite when the axis was known
        own = unit(across((0.0, 0.0, 1.0) if abs(limb.upper[2]) < 0.7 else _UP, limb.upper))
    share = min(1.0, max(0.0, (math.degrees(bend) - BEND_DEG["plane_low_deg"]) / _PLANE_DEG))
    share *= share * (3.0 - 2.0 * share)
    mixed = plus(apply(((share, 0.0, 0.0), (0.0, share, 0.0), (0.0, 0.0, share)), unit(plane)), own, 1.0 - share)
    axis = unit(across(mixed, limb.upper))
    return axis if norm(axis) > 0.5 else own


_MIDDLE: Vector = mean([REST[name] for name in _HIPS])
"""The middle of the hips, from the pelvis [m]."""
LEG_LENGTH = sum(norm(minus(REST[b], REST[a])) for a, b in pairwise(("left_hip", "left_knee", "left_ankle")))
"""How long our skeleton's legs are [m], from hip to ankle."""
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
