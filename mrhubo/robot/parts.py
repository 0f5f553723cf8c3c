"""The parts of a human body that a robot can have: one table, from which all else follows.

A limb runs from one point to another and has one direction; an oriented part (a hand, the head) is fixed to one link
and has two; a bend axis says about which axis a limb bends. Directions are seen from the part that carries them: those
of arms and head from the chest, those of legs and of the chest itself from the pelvis, so that neither the way a base
faces nor a bent back matters. A robot without a pelvis entry has a chest that carries itself: arms and head alone.

A row says everything about a part: no other module knows one by its name. Rows stand in the order of the directions,
and a part after the one that it hangs on.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

Vector = tuple[float, float, float]
Region = Literal["trunk", "arm", "hand", "head", "leg", "foot", "bend"]
"""What a part belongs to: measures are means over a region. What is in "bend" guides, but is not measured."""

_LEFT, _RIGHT, _FORWARD = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
_UP, _DOWN = (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)
"""Directions of the human frame (`mrhubo.frames`)."""


@dataclass(frozen=True, kw_only=True)
class BodyPart:
    """A row of the table."""

    name: str
    joint: str
    """The human joint that turns it."""
    region: Region
    hangs_on: str | None = None
    """The part that carries it; None for a part that carries itself."""
    seen_from: str | None = None
    """The oriented part from which its directions are seen; None for one that has none of its own, but from which
    others are seen."""
    inputs: tuple[str, ...] = ()
    """The human joints whose rotations tell a network about it."""
    weight: float = 1.0
    """Weight of its directions' squared error in the reference retargeter's cost."""

    @property
    def direction_names(self) -> tuple[str, ...]:
        """Names of its directions."""
        raise NotImplementedError

    @property
    def direction_weights(self) -> tuple[float, ...]:
        """The weight of each."""
        return (self.weight,) * len(self.direction_names)

    @property
    def outer_points(self) -> tuple[str, ...]:
        """The human keypoints that it carries itself."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class LimbPart(BodyPart):
    """A part with one direction, from one point to another; points have the names of human keypoints."""

    start: str
    end: str
    lengthened_by: str | None = None
    """The number of `robot.manual` that lengthens it, if there is one."""

    @property
    def direction_names(self) -> tuple[str, ...]:
        """Its direction is called after its outer point."""
        return (self.end,)

    @property
    def outer_points(self) -> tuple[str, ...]:
        """Its end."""
        return (self.end,)


@dataclass(frozen=True, kw_only=True)
class OrientedPart(BodyPart):
    """A part with two directions at right angles, fixed to one link."""

    words: tuple[str, str]
    """What the two directions are called."""
    rest: tuple[Vector, Vector]
    """Where they point on a human at rest, human frame."""
    turned_by: tuple[str, ...] = ()
    """The human joints that share its turn in equal parts, from the inner one outwards; `joint` is the last."""
    points: tuple[str, ...] = ()
    """The human keypoints that turn with it."""
    stands: tuple[str, ...] = ()
    """The human keypoints of its sole, the rear one and the front one; none for what does not stand on the floor."""
    first_weight: float | None = None
    """Weight of the first direction, where it is not `weight`."""
    unturned_weights: tuple[float, float] | None = None
    """Weights of both where no joint swings it against the limb that carries it, and where joints do that turn it not
    every way, if these are others (`mrhubo.robot.swings`)."""
    by_itself: bool = False
    """Whether a robot may have it without the part that carries it, or on the same link: then it has no directions of
    its own, and others are seen from it all the same."""

    @property
    def alone(self) -> OrientedPart:
        """The same part where nothing on the robot carries it and turns it."""
        return dataclasses.replace(self, hangs_on=None, seen_from=None, inputs=(), turned_by=(), points=())

    @property
    def direction_names(self) -> tuple[str, ...]:
        """The part's name with each of the words; none if nothing sees it."""
        return tuple(f"{self.name}_{word}" for word in self.words) if self.seen_from else ()

    @property
    def direction_weights(self) -> tuple[float, ...]:
        """The weights of both."""
        first = self.weight if self.first_weight is None else self.first_weight
        return (first, self.weight)[: len(self.direction_names)]

    @property
    def outer_points(self) -> tuple[str, ...]:
        """Those that turn with it."""
        return self.points

    def turn(self, first: Tensor, second: Tensor) -> Tensor:
        """The rotation (..., 3, 3) that takes the part at rest to two directions (..., 3), unit and orthogonal."""
        return _columns(first, second) @ _columns(*torch.tensor(self.rest).to(first)).T


@dataclass(frozen=True, kw_only=True)
class BendPart(BodyPart):
    """The axis about which a limb bends against the one that carries it, fixed to the carrying limb: an elbow's hinge.

    Where the joint is bent, the two limbs' directions tell it, and nothing more need be said. Where it is straight,
    only how the carrying limb is turned about itself tells it; else a straight arm leaves the robot's elbow open.
    """

    bent: str
    """The limb that bends; `hangs_on` carries it."""
    rest: Vector
    """Where the axis points on a human at rest, human frame; turning about it by a positive angle bends the joint."""

    @property
    def limbs(self) -> tuple[str, str]:
        """The limb that carries, and the one that bends."""
        return self.hangs_on or "", self.bent

    @property
    def direction_names(self) -> tuple[str, ...]:
        """The part's own name."""
        return (self.name,)

    @property
    def outer_points(self) -> tuple[str, ...]:
        """None."""
        return ()


def _columns(first: Tensor, second: Tensor) -> Tensor:
    return torch.stack((first, second, torch.linalg.cross(first, second)), dim=-1)


_BEND_WEIGHT = 2e-3
"""Of a bend axis, small against a limb's 1: it decides where limbs leave the choice, and does not turn them away."""
_HEADING_WEIGHT = 0.1
"""Of where a foot points, against a limb's 1. Thigh, shin and foot ask for seven angles, and most robots' legs have six
joints: what is missing is taken from here, and not from the limbs or from how flat the sole is."""
_UNTURNED_WEIGHTS = 0.02, _HEADING_WEIGHT
"""Of a hand that points where its forearm does, enough to tell how the forearm is twisted; and of one whose wrist has
two joints: what is missing is taken from the hand, as from where a foot points."""


def _arm(side: str, elbow_axis: Vector) -> tuple[LimbPart, BendPart, LimbPart]:
    shoulder, elbow, wrist = (f"{side}_{joint}" for joint in ("shoulder", "elbow", "wrist"))
    upper, collar, forearm = f"{side}_upper_arm", f"{side}_collar", f"{side}_forearm"
    return (
        LimbPart(name=upper, joint=shoulder, region="arm", hangs_on="chest", seen_from="chest",
                 start=shoulder, end=elbow, inputs=(collar, shoulder), lengthened_by="upper_arm"),
        BendPart(name=f"{side}_elbow_axis", joint=shoulder, region="bend", hangs_on=upper, seen_from="chest",
                 bent=forearm, rest=elbow_axis, inputs=(collar, shoulder), weight=_BEND_WEIGHT),
        LimbPart(name=forearm, joint=elbow, region="arm", hangs_on=upper, seen_from="chest",
                 start=elbow, end=wrist, inputs=(collar, elbow), lengthened_by="forearm"),
    )  # fmt: skip


def _hand(side: str, outward: Vector) -> OrientedPart:
    wrist = f"{side}_wrist"
    return OrientedPart(
        name=f"{side}_hand", joint=wrist, region="hand", hangs_on=f"{side}_forearm", seen_from="chest",
        words=("fingers", "thumb"), rest=(outward, _FORWARD), turned_by=(wrist,), inputs=(wrist,), weight=0.5,
        unturned_weights=_UNTURNED_WEIGHTS,
        points=tuple(f"{side}_{point}" for point in ("thumb", "index", "middle", "pinky")),
    )  # fmt: skip


def _leg(side: str) -> tuple[LimbPart, BendPart, LimbPart]:
    hip, knee, ankle = (f"{side}_{joint}" for joint in ("hip", "knee", "ankle"))
    thigh, shin = f"{side}_thigh", f"{side}_shin"
    return (
        LimbPart(name=thigh, joint=hip, region="leg", hangs_on="pelvis", seen_from="pelvis", start=hip, end=knee,
                 inputs=(hip,)),
        BendPart(name=f"{side}_knee_axis", joint=hip, region="bend", hangs_on=thigh, seen_from="pelvis", bent=shin,
                 rest=_LEFT, inputs=(hip,), weight=_BEND_WEIGHT),
        LimbPart(name=shin, joint=knee, region="leg", hangs_on=thigh, seen_from="pelvis", start=knee, end=ankle,
                 inputs=(knee,)),
    )  # fmt: skip


def _foot(side: str) -> OrientedPart:
    ankle = f"{side}_ankle"
    return OrientedPart(
        name=f"{side}_foot", joint=ankle, region="foot", hangs_on=f"{side}_shin", seen_from="pelvis",
        words=("forward", "up"), rest=(_FORWARD, _UP), turned_by=(ankle,), inputs=(ankle,), weight=0.5,
        first_weight=_HEADING_WEIGHT, points=tuple(f"{side}_{point}" for point in ("foot", "toe", "heel")),
        stands=(f"{side}_heel", f"{side}_toe"),
    )  # fmt: skip


PELVIS = OrientedPart(
    name="pelvis", joint="pelvis", region="trunk", words=("forward", "up"), rest=(_FORWARD, _UP), by_itself=True
)
CHEST = OrientedPart(
    name="chest", joint="spine3", region="trunk", hangs_on="pelvis", seen_from="pelvis", words=("forward", "up"),
    rest=(_FORWARD, _UP), turned_by=("spine1", "spine2", "spine3"), inputs=("spine1", "spine2", "spine3"),
    points=("neck", "left_shoulder", "right_shoulder"), by_itself=True,
)  # fmt: skip
HEAD = OrientedPart(
    name="head", joint="head", region="head", hangs_on="chest", seen_from="chest", words=("forward", "up"),
    rest=(_FORWARD, _UP), turned_by=("neck", "head"), inputs=("neck", "head"), points=("left_eye", "right_eye"),
)  # fmt: skip

PARTS: tuple[BodyPart, ...] = (
    PELVIS,
    CHEST,
    *_arm("left", _DOWN),
    *_arm("right", _UP),
    _hand("left", _LEFT),
    _hand("right", _RIGHT),
    HEAD,
    *_leg("left"),
    *_leg("right"),
    _foot("left"),
    _foot("right"),
)
"""The table."""
UPPER_BODY: tuple[BodyPart, ...] = (
    CHEST.alone,
    *(part for part in PARTS if part.seen_from == CHEST.name),
)
"""What hangs on a chest that carries itself: what a robot is described by, unless it is to be its whole body."""


def points_beyond(part: BodyPart, table: Sequence[BodyPart] = PARTS) -> tuple[str, ...]:
    """The human keypoints that move when a part gets longer: those that it carries, and all that hangs on it."""
    hanging = [point for other in table if other.hangs_on == part.name for point in points_beyond(other, table)]
    return (*part.outer_points, *hanging)
