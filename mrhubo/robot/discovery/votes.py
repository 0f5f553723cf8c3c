"""What tells where a robot faces: what bends one way only, feet, cameras, the names of sides; each has a vote."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from mrhubo.robot.discovery import names
from mrhubo.robot.discovery.arm import Arm
from mrhubo.robot.discovery.bodies import Bodies, Chain
from mrhubo.robot.discovery.leg import Leg
from mrhubo.robot.discovery.lines import cross, unit
from mrhubo.robot.discovery.motion import bend_side, mean_sign, reach_middle, straight_angle, turned, usual_range
from mrhubo.robot.discovery.roles import Roles

_BENT = 0.3
"""How far a hinge without limits is bent at the zero pose at least [rad] that tells which way it bends."""
NAMES = "the names of the sides"
"""What the vote of the names is called."""


@dataclass(frozen=True)
class Vote:
    """What one thing says, from -1 (against) to 1 (for), and how much it counts."""

    what: str
    value: float
    weight: float


def forward_votes(
    bodies: Bodies, roles: Roles, arms: list[Arm], legs: list[Leg], up_3: np.ndarray, forward_3: np.ndarray,
    left_3: np.ndarray,
) -> Iterator[Vote]:  # fmt: skip
    """What speaks for a robot facing forwards, with the first limb of each pair on its left.

    Args:
        bodies: the robot.
        roles: its limbs.
        arms: both arms, in the order of the pair.
        legs: both legs in the same order, or none.
        up_3: where it is up.
        forward_3: where it is to face.
        left_3: where left would be then.
    """
    yield Vote(NAMES, names.sides(_paired_names(roles)), 3.0)
    if legs:
        knees = [
            _bend(leg.chain, leg.knee_at, leg.hip.point_3, leg.knee.point_3, leg.ankle.point_3, up_3, forward_3)
            for leg in legs
        ]
        yield Vote("the knees bend backwards", -mean_sign(knees), 2.0)
        hips = []
        for leg in legs:
            thigh = float(np.linalg.norm(leg.knee.point_3 - leg.hip.point_3))
            to_3 = reach_middle(leg.chain[: leg.knee_at], leg.knee.point_3)
            hips.append(float((to_3 - leg.hip.point_3) @ forward_3) / thigh * 4)
        yield Vote("the thighs swing further forward", mean_sign(hips), 0.7)
        yield Vote("the feet point forward", mean_sign(list(_feet(bodies, legs, forward_3))), 1.0)
    elbows = [
        _bend(arm.chain, arm.elbow_at, arm.shoulder.point_3, arm.elbow.point_3, arm.wrist.point_3, up_3, forward_3)
        for arm in arms
    ]
    yield Vote("the elbows bend forward", mean_sign(elbows), 1.0)
    hands = [
        float((reach_middle(arm.chain, arm.wrist.point_3) - arm.shoulder.point_3) @ forward_3) / arm.length * 4
        for arm in arms
    ]
    yield Vote("the hands reach further forward", mean_sign(hands), 1.5)
    cameras = list(_cameras(bodies, roles, arms, forward_3))
    if cameras:
        yield Vote("cameras and eyes look forward", mean_sign(cameras), 1.0)
    if up_3[2] > 0.9:
        yield Vote("the file's x", float(forward_3[0]), 0.5)


def _paired_names(roles: Roles) -> list[tuple[str, str]]:
    found = []
    for pair in (roles.arms, roles.legs):
        if pair is not None:
            for one, other in zip(*pair.chains, strict=False):
                found += [(one.hinge.name, other.hinge.name), (one.outer_link, other.outer_link)]
    return [(one, other) for one, other in found if names.side(one, other)]


def _bend(
    chain: Chain, at: int, start_3: np.ndarray, middle_3: np.ndarray, end_3: np.ndarray, up_3: np.ndarray,
    forward_3: np.ndarray,
) -> float:  # fmt: skip
    """-1..1: how far forward a limb's end goes when its hinge bends, with the upper part hanging. Of a hinge without
    limits the zero pose tells, if it is bent there.
    """
    step = chain[at]
    axis_3 = step.sign * step.hinge.line.axis_3
    upper_3, lower_3 = middle_3 - start_3, end_3 - middle_3
    straight = straight_angle(axis_3, lower_3, upper_3)
    if step.hinge.limited:
        side = bend_side(*usual_range(step.hinge), straight)
    elif _BENT < abs(straight) < math.pi - _BENT:
        side = -math.copysign(1.0, straight)
    else:
        return 0.0
    moved_3 = unit(cross(axis_3, turned(lower_3, axis_3, straight))) * np.sign(side)
    # Where forward is once the upper part hangs down: turned back from where it points, the short way.
    down_3, upper_3 = -up_3, unit(upper_3)
    about_3 = cross(down_3, upper_3)
    if np.linalg.norm(about_3) > 1e-6:
        angle = float(np.arctan2(np.linalg.norm(about_3), down_3 @ upper_3))
        forward_3 = turned(forward_3, unit(about_3), angle)
    return float(moved_3 @ forward_3) * min(1.0, 2 * abs(side))


def _feet(bodies: Bodies, legs: Iterable[Leg], forward_3: np.ndarray) -> Iterator[float]:
    for leg in legs:
        along = (bodies.corners(leg.chain[-1].end) - leg.ankle.point_3) @ forward_3
        length = float(np.linalg.norm(leg.ankle.point_3 - leg.knee.point_3))
        if along.max() - along.min() > 0.15 * length:
            yield float(along.max() + along.min()) / float(along.max() - along.min()) * 3
            continue
        centre_3 = bodies.centre(leg.chain[-1].end)
        if centre_3 is not None:
            yield float((centre_3 - leg.ankle.point_3) @ forward_3) / (0.05 * length)


def _cameras(bodies: Bodies, roles: Roles, arms: list[Arm], forward_3: np.ndarray) -> Iterator[float]:
    scale = 0.1 * arms[0].length
    if roles.neck:
        step = roles.neck[-1]
        inside = bodies.beyond(step)[0]
        origin_3 = step.hinge.line.point_3
    else:
        inside, origin_3 = {roles.chest}, np.mean([arm.shoulder.point_3 for arm in arms], axis=0)
    for link, body in bodies.body_of.items():
        if body in inside and names.speaks_of(link, "camera"):
            yield float((bodies.position(link) - origin_3) @ forward_3) / scale
