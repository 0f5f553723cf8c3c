"""From a URDF to what its links mean: bodies, pairs of limbs, roles, directions, points, joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from mrhubo.robot.discovery import names
from mrhubo.robot.discovery.agreement import agreeing_arms, agreeing_hands
from mrhubo.robot.discovery.arm import Spot, read_arm
from mrhubo.robot.discovery.bodies import Bodies, Chain, Step
from mrhubo.robot.discovery.facing import Heading, choose_neck, find_heading
from mrhubo.robot.discovery.hand import Hand, read_hand
from mrhubo.robot.discovery.leg import Leg, read_leg, read_sole
from mrhubo.robot.discovery.ranges import driver, find_ranges
from mrhubo.robot.discovery.reading import read_bodies
from mrhubo.robot.discovery.result import (
    Candidate,
    Discovery,
    FoundAxis,
    FoundEnd,
    FoundPoint,
    Question,
    Vector,
)
from mrhubo.robot.discovery.roles import Roles, find_roles
from mrhubo.robot.discovery.symmetry import find_pairs
from mrhubo.robot.limits import beyond_turns
from mrhubo.robot.urdf import Description, describe

SIDES = ("left", "right")
_SURE = 0.5
"""Confidence under which the user is asked."""
_ZERO = 1e-5


def discover(robot: Description | Path | str) -> Discovery:
    """Which link and point of a robot stands for which part of a human body.

    Args:
        robot: a URDF file, or what `mrhubo.robot.urdf.describe` made of it.

    Raises:
        UserError: the file is no robot (as `describe`), or it has no two arms that could be told; says what it has.
    """
    description = robot if isinstance(robot, Description) else describe(Path(robot))
    bodies = read_bodies(description)
    roles = find_roles(bodies, find_pairs(bodies))
    return _Finder(bodies, roles).found()


class _Finder:
    """Puts together what the parts of this package find."""

    def __init__(self, bodies: Bodies, roles: Roles) -> None:
        arms = [arm for chain in roles.arms.chains if (arm := read_arm(bodies, chain)) is not None]
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
        self.legs: dict[str, Leg] = dict(zip(SIDES, legs, strict=False))
        hands: dict[str, Hand] = {}
        for sign, (side, arm) in zip((1.0, -1.0), self.arms.items(), strict=True):
            hand = read_hand(bodies, arm, sign, self.heading.left_3, self.heading.forward_3)
            if hand is not None:
                hands[side] = hand
        self.hands = agreeing_hands(hands, self.heading.left_3)

    def found(self) -> Discovery:
        """The result."""
        ranges, asked = find_ranges(self.bodies, self.arms, self.roles.neck, self.heading.forward_3)
        joints = self._joints()
        held = dict(self._held(joints))
        questions = [*self._questions(), *asked, *self._coupled()]
        points = dict(self._points())
        return Discovery(
            name=_short_name(self.bodies.description),
            forward=FoundAxis(_vector(self.heading.forward_3), self.heading.forward_sure, self.heading.forward_cue),
            up=FoundAxis(_vector(self.heading.up_3), self.heading.up_sure, self.heading.up_cue),
            points=points,
            ends=dict(self._ends()),
            chains=self._chains(),
            joints=joints,
            held=held,
            left_out=dict(self._left_out({*joints, *held})),
            ranges={name: found for name, found in ranges.items() if name in joints},
            key_links=self._key_links(),
            questions=tuple(questions),
            notes=tuple(self._notes()),
            geometric={name: point for name, point in points.items() if point.confidence >= 0.75},
        )

    def _spots(self) -> Iterator[tuple[str, Spot, tuple[Candidate, ...]]]:
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

    def _points(self) -> Iterator[tuple[str, FoundPoint]]:
        for name, spot, candidates in self._spots():
            offsets = {link: self._offset(link, spot.point_3) for link in spot.links}
            exact = [link for link, offset in offsets.items() if max(map(abs, offset)) < _ZERO]
            link = exact[0] if exact else spot.links[0]
            offset = (0.0, 0.0, 0.0) if exact else offsets[link]
            yield name, FoundPoint(link, offset, _vector(spot.point_3), spot.confidence, spot.cue, candidates)

    def _offset(self, link: str, point_3: np.ndarray) -> Vector:
        return _vector(self.bodies.in_link(link, point_3))

    def _ends(self) -> Iterator[tuple[str, FoundEnd]]:
        forward_3, up_3, roles = self.heading.forward_3, self.heading.up_3, self.roles
        sure = min(self.heading.forward_sure, self.heading.up_sure)
        chest = self._main_link(roles.chest, [chain[0] for chain in roles.arms.chains])
        yield (
            "chest",
            self._end(
                chest, {"forward": forward_3, "up": up_3}, min(sure, roles.sure), "the body that carries both arms"
            ),
        )
        if roles.legs is not None and self.legs:
            pelvis = self._main_link(roles.legs.body, [chain[0] for chain in roles.legs.chains])
            yield (
                "pelvis",
                self._end(pelvis, {"forward": forward_3, "up": up_3}, sure, "the body that carries both legs"),
            )
        if roles.neck:
            link = roles.neck[-1].outer_link
            cue = "the end of the longest chain in the middle above the chest; it faces ahead at the zero pose"
            named = any(
                names.speaks_of(name, "head") for step in roles.neck for name in (step.hinge.name, step.outer_link)
            )
            yield "head", self._end(link, {"forward": forward_3, "up": up_3}, min(sure, 0.9 if named else 0.7), cue)
        for side, hand in self.hands.items():
            axes = {"fingers": hand.fingers_3, "thumb": hand.thumb_3}
            yield f"{side}_hand", self._end(hand.link, axes, hand.confidence, hand.cue)

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

    def _chains(self) -> dict[str, tuple[str, ...]]:
        chains: dict[str, Chain] = {f"{side}_arm": arm.chain for side, arm in self.arms.items()}
        chains |= {f"{side}_leg": leg.chain for side, leg in self.legs.items()}
        chains |= {"neck": self.roles.neck, "waist": self.roles.waist}
        return {name: tuple(step.hinge.name for step in chain) for name, chain in chains.items()}

    def _joints(self) -> tuple[str, ...]:
        moved = [arm.chain if side in self.hands else arm.chain[: arm.elbow_at + 1] for side, arm in self.arms.items()]
        steps = [step for chain in (*moved, self.roles.neck) for step in chain]
        found = [hinge.name for step in steps if (hinge := driver(self.bodies, step)) is not None and hinge.rotary]
        return tuple(dict.fromkeys(found))

    def _held(self, joints: tuple[str, ...]) -> Iterator[tuple[str, str]]:
        for step in self.roles.waist:
            yield step.hinge.name, "it turns the chest against the base, and directions are seen from the chest"
        for leg in self.legs.values():
            for step in leg.chain:
                yield step.hinge.name, "it belongs to a leg, and no direction of the table tells legs"
        for arm in self.arms.values():
            for step in arm.chain:
                if step.hinge.name not in joints:
                    yield (
                        step.hinge.name,
                        "it belongs to an arm, but "
                        + (
                            "slides"
                            if not step.hinge.rotary
                            else "mimics another joint"
                            if not step.hinge.free
                            else "turns nothing that can be told"
                        ),
                    )

    def _left_out(self, used: set[str]) -> Iterator[tuple[str, str]]:
        cut = {name: why for arm in self.arms.values() for name, why in arm.left_out}
        where = {}
        for side, arm in self.arms.items():
            where |= {
                h.name: f"beyond the {side} wrist: a finger or gripper" for h in self.bodies.beyond(arm.chain[-1])[1]
            }
        for side, leg in self.legs.items():
            where |= {h.name: f"beyond the {side} ankle" for h in self.bodies.beyond(leg.chain[-1])[1]}
        if self.roles.neck:
            where |= {h.name: "on the head: an eye, jaw or antenna" for h in self.bodies.beyond(self.roles.neck[-1])[1]}
        for hinge in self.bodies.hinges:
            if hinge.name in used:
                continue
            why = cut.get(hinge.name) or where.get(hinge.name)
            if why is None:
                why = "it mimics another joint" if not hinge.free else "on no limb: a wheel, sensor or linkage"
            yield hinge.name, why

    def _questions(self) -> Iterator[Question]:
        heading, roles = self.heading, self.roles
        if heading.forward_sure < _SURE:
            yield Question("forward", "it is not clear where the robot faces, nor therefore which side is left; "
                           f"taken by: {heading.forward_cue}")  # fmt: skip
        if heading.up_sure < _SURE:
            yield Question("up", f"it is not clear where the robot's up is; taken by: {heading.up_cue}")
        if roles.sure < _SURE:
            first = [chain[0].hinge.name for pair in (roles.arms, roles.legs) if pair for chain in pair.chains]
            yield Question("chest", "it is not clear which pair of limbs is arms and which legs", tuple(first))
        for name, spot, _ in self._spots():
            if spot.confidence < _SURE:
                yield Question(
                    name, f"the {name.replace('_', ' ')} was taken as {spot.cue}; give its point", spot.links
                )
        for side, hand in self.hands.items():
            if hand.doubt is not None:
                yield Question(f"{side}_hand", f"{hand.doubt}; taken: {hand.cue}", (hand.link,))

    def _coupled(self) -> Iterator[Question]:
        """Joints of arms and neck that mimic others of them: as a file may have it that is for a show of one arm."""
        chains = [*(arm.chain for arm in self.arms.values()), self.roles.neck]
        whole = {step.hinge.name for chain in chains for step in chain}
        for step in (step for chain in chains for step in chain if not step.hinge.free):
            source = driver(self.bodies, step)
            if source is not None and source.name in whole:
                name = step.hinge.name
                yield Question(name, f"'{name}' mimics '{source.name}', so neither follows a person by itself; if they "
                               f"can on the robot, take the <mimic> element of '{name}' out of the URDF and "
                               "describe it anew")  # fmt: skip

    def _notes(self) -> Iterator[str]:
        if self.bodies.degrees:
            joint = next(j for j in self.bodies.description.joints.values() if j.kind == "revolute" and beyond_turns(j))
            yield (
                f"the limits of most joints, as {joint.lower:g} .. {joint.upper:g} of '{joint.name}', can only be "
                "degrees, where a URDF has radians; robot.ranges holds them in radians, and nothing else need be done "
                "here, but other programs need a URDF with every limit times 0.0174533"
            )
        for what in self.heading.contradicted:
            yield f"against where the robot was found to face speaks: {what}"

    def _key_links(self) -> tuple[str, ...]:
        steps = [step for arm in self.arms.values() for step in arm.chain]
        links = [step.outer_link for step in (*steps, *self.roles.neck[-1:])]
        return tuple(dict.fromkeys(links))


def _vector(numbers_3: np.ndarray) -> Vector:
    x, y, z = (round(float(number), 6) + 0.0 for number in numbers_3)
    return x, y, z


def _short_name(description: Description) -> str:
    name = description.parsed.robot.name or description.path.stem
    return "".join(letter if letter.isalnum() else "_" for letter in name.lower()).strip("_") or "robot"
