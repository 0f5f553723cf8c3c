"""From a URDF to what its links mean: bodies, pairs of limbs, roles, directions, points, joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from mrhubo.robot.discovery.agreement import agreeing_arms, agreeing_hands, read_arms
from mrhubo.robot.discovery.arm import GUESS
from mrhubo.robot.discovery.bodies import Step
from mrhubo.robot.discovery.facing import Heading, choose_neck, find_heading
from mrhubo.robot.discovery.foot import read_foot, with_fixed_ankle
from mrhubo.robot.discovery.hand import Hand, read_hand
from mrhubo.robot.discovery.leg import Leg, read_leg, read_sole
from mrhubo.robot.discovery.members import Limbs
from mrhubo.robot.discovery.necks import aside, is_named, turned_back
from mrhubo.robot.discovery.questions import Named, asked_of_neck, coupled, notes, questions
from mrhubo.robot.discovery.ranges import find_ranges
from mrhubo.robot.discovery.result import (
    Candidate,
    Discovery,
    FoundAxis,
    FoundEnd,
    FoundPoint,
    Vector,
)
from mrhubo.robot.discovery.sole import GuessedSole, guess_sole
from mrhubo.robot.discovery.whole import Whole, complete
from mrhubo.robot.urdf import Description, describe

SIDES = ("left", "right")
_ZERO = 1e-5


def discover(robot: Description | Path | str, whole_body: bool = False) -> Discovery:
    """Which link and point of a robot stands for which part of a human body.

    Args:
        robot: a URDF file, or what `mrhubo.robot.urdf.describe` made of it.
        whole_body: whether joints of legs and waist are to move too, and what they leave open is asked; points, parts
            and chains of them are told either way.

    Raises:
        UserError: the file is no robot (as `describe`), or it has no arms that could be told; says what it has.
    """
    description = robot if isinstance(robot, Description) else describe(Path(robot))
    return description.once("discovery", lambda: _Finder(complete(description))).found(whole_body)


class _Finder:
    """Puts together what the parts of this package find."""

    def __init__(self, whole: Whole) -> None:
        bodies, roles = whole.bodies, whole.roles
        self.whole = whole
        arms = read_arms(bodies, roles.arms.chains)
        legs = [
            leg for chain in (roles.legs.chains if roles.legs else ()) if (leg := read_leg(bodies, chain)) is not None
        ]
        legs = legs if len(legs) == 2 else []
        roles = choose_neck(bodies, roles, arms, legs)
        self.bodies, self.roles = bodies, roles
        self.heading: Heading = find_heading(bodies, roles, arms, legs)
        self.arms = agreeing_arms(dict(zip(SIDES, arms[::-1] if self.heading.swap else arms, strict=True)))
        across_3 = roles.legs.normal_3 if roles.legs else self.heading.left_3
        if float(across_3 @ self.heading.left_3) < 0:
            legs = legs[::-1]
        legs = [with_fixed_ankle(bodies, leg, self.heading) for leg in legs]
        self.legs: dict[str, Leg] = dict(zip(SIDES, legs, strict=False))
        # How far the neck's joints turn until the head stands straight.
        self.aside = aside(bodies, roles.neck, self.heading.left_3, roles.arms.mounts_23.mean(0)) or []
        self.turned_aside = [
            step.hinge.name for step, (_, angle) in zip(roles.neck, self.aside, strict=False) if abs(angle) > 0
        ]
        hands: dict[str, Hand] = {}
        for sign, (side, arm) in zip((1.0, -1.0), self.arms.items(), strict=True):
            hand = read_hand(bodies, arm, sign, self.heading.left_3, self.heading.forward_3)
            if hand is not None:
                hands[side] = hand
        self.hands = agreeing_hands(hands, self.heading.left_3)
        self.feet = {side: read_foot(bodies, leg, self.heading) for side, leg in self.legs.items()}
        for side, arm in list(self.arms.items()):
            if whole.is_image(arm.chain[0].hinge.name):
                del self.arms[side]
                self.hands.pop(side, None)

    def found(self, whole_body: bool) -> Discovery:
        """The result; whether legs and waist are to move too."""
        limbs = Limbs(self.bodies, self.roles, self.heading, self.arms, self.legs, self.hands, whole_body)
        spots = list(self._spots())
        legs = self.legs if limbs.whole_body else {}
        soles = {side: sole for side, leg in legs.items() if (sole := guess_sole(self.bodies, leg, self.feet[side]))}
        ranges, asked = find_ranges(self.bodies, self.arms, legs, limbs.moving.values(), self.heading)
        joints = limbs.moved
        ranges = {name: found for name, found in ranges.items() if name in joints}
        held = dict(limbs.held(joints))
        points = dict(self._points(spots))
        all_asked = (
            *self.whole.asked(), *questions(limbs, spots, self.feet, soles), *asked_of_neck(self.turned_aside), *asked,
            *coupled(limbs),
        )  # fmt: skip
        return Discovery(
            name=_short_name(self.bodies.description),
            forward=FoundAxis(_vector(self.heading.forward_3), self.heading.forward_sure, self.heading.forward_cue),
            up=FoundAxis(_vector(self.heading.up_3), self.heading.up_sure, self.heading.up_cue),
            points=points,
            ends=dict(self._ends(soles)),
            chains={name: tuple(step.hinge.name for step in chain) for name, chain in limbs.chains.items()},
            joints=joints,
            held=held,
            left_out={name: why for name, why in limbs.left_out({*joints, *held}) if not self.whole.is_image(name)},
            ranges=ranges,
            key_links=limbs.key_links(),
            questions=tuple(map(self.whole.without_images, all_asked)),
            notes=(*self.whole.told(self.arms), *notes(limbs, ranges)),
            geometric={name: point for name, point in points.items() if point.confidence >= 0.75},
            whole_body=limbs.whole_body,
        )

    def _spots(self) -> Iterator[Named]:
        for side, arm in self.arms.items():
            yield f"{side}_shoulder", arm.shoulder, ()
            apart = float(np.linalg.norm(arm.hinge_3 - arm.elbow.point_3))
            step = arm.chain[arm.elbow_at]
            hinge = Candidate(step.outer_link, self._offset(step.outer_link, arm.hinge_3),
                              f"the hinge itself, {1000 * apart:.0f} mm beside the upper arm's axis")  # fmt: skip
            yield f"{side}_elbow", arm.elbow, (hinge,) if apart > 1e-3 * self.bodies.size else ()
            yield f"{side}_wrist", arm.wrist, ()
        for side, leg in self.legs.items():
            yield f"{side}_hip", leg.hip, ()
            yield f"{side}_knee", leg.knee, ()
            yield f"{side}_ankle", leg.ankle, ()
            sole = read_sole(self.bodies, leg, self.heading.up_3)
            if sole is not None:
                yield f"{side}_sole", sole, ()

    def _points(self, spots: list[Named]) -> Iterator[tuple[str, FoundPoint]]:
        for name, spot, candidates in spots:
            offsets = {link: self._offset(link, spot.point_3) for link in spot.links}
            exact = [link for link, offset in offsets.items() if max(map(abs, offset)) < _ZERO]
            link = exact[0] if exact else spot.links[0]
            offset = (0.0, 0.0, 0.0) if exact else offsets[link]
            yield name, FoundPoint(link, offset, _vector(spot.point_3), spot.confidence, spot.cue, candidates)

    def _offset(self, link: str, point_3: np.ndarray) -> Vector:
        return _vector(self.bodies.in_link(link, point_3))

    def _ends(self, soles: Mapping[str, GuessedSole]) -> Iterator[tuple[str, FoundEnd]]:
        forward_3, up_3, roles = self.heading.forward_3, self.heading.up_3, self.roles
        sure = min(self.heading.forward_sure, self.heading.up_sure)
        arms = "both arms" if len(self.arms) == len(SIDES) else "the only arm"
        # An arm and its image hang on one link, which may be the arm's mount; the neck tells more.
        from_chest = [chain[0] for chain in roles.arms.chains] + ([] if self.whole.lone is None else [*roles.neck[:1]])
        chest = self._main_link(roles.chest, from_chest)
        yield (
            "chest",
            self._end(
                chest, {"forward": forward_3, "up": up_3}, min(sure, roles.sure), f"the body that carries {arms}"
            ),
        )
        if (pelvis := self._pelvis()) is not None:
            cue = "the body that carries both legs" if self.legs else "where the waist begins, as there are no legs"
            yield "pelvis", self._end(pelvis, {"forward": forward_3, "up": up_3}, sure, cue)
        if roles.neck:
            link = roles.neck[-1].outer_link
            cue = "the end of the longest chain in the middle above the chest; it faces ahead "
            cue += "once the neck is turned straight" if self.turned_aside else "at the zero pose"
            named = GUESS if self.turned_aside else 0.9 if is_named(roles.neck) else 0.7
            axes = {word: turned_back(axis_3, self.aside) for word, axis_3 in (("forward", forward_3), ("up", up_3))}
            yield "head", self._end(link, axes, min(sure, named), cue)
        for side, hand in self.hands.items():
            axes = {"fingers": hand.fingers_3, "thumb": hand.thumb_3}
            yield f"{side}_hand", self._end(hand.link, axes, hand.confidence, hand.cue)
        for side, foot in self.feet.items():
            axes = {"forward": foot.forward_3, "up": foot.up_3}
            end = self._end(foot.link, axes, min(sure, foot.confidence), foot.cue)
            yield f"{side}_foot", replace(end, sole_3=soles[side].reach_3) if side in soles else end

    def _pelvis(self) -> str | None:
        """The link that carries both legs, or, without legs, the one on which the waist turns the chest."""
        if self.roles.legs is not None:
            return self._main_link(self.roles.legs.body, [chain[0] for chain in self.roles.legs.chains])
        turning = [step for step in self.roles.waist if step.hinge.rotary]
        return turning[0].inner_link if turning else None

    def _end(self, link: str, axes: Mapping[str, np.ndarray], confidence: float, cue: str) -> FoundEnd:
        turn_33 = self.bodies.pose_44[link][:3, :3].T
        return FoundEnd(link, {word: _vector(turn_33 @ axis_3) for word, axis_3 in axes.items()}, confidence, cue)

    def _main_link(self, body: int, steps: list[Step]) -> str:
        """The link of a body from which joints go out."""
        inside = set(self.bodies.links_of[body])
        above = [
            [step.inner_link, *(j.parent for j in self.bodies.description.joints_above(step.inner_link))]
            for step in steps
        ]
        shared = [link for link in above[0] if link in inside and all(link in other for other in above)]
        return shared[0] if shared else steps[0].inner_link


def _vector(numbers_3: np.ndarray) -> Vector:
    x, y, z = (round(float(number), 6) + 0.0 for number in numbers_3)
    return x, y, z


def _short_name(description: Description) -> str:
    name = description.parsed.robot.name or description.path.stem
    return "".join(letter if letter.isalnum() else "_" for letter in name.lower()).strip("_") or "robot"
