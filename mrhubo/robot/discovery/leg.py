"""Hip, knee, ankle and sole from the axes of a leg.

A knee is the middle one of three parallel lateral axes. The thigh starts on the pitch axis above it, which may lie far
from where the hip's axes cross. Of two parallel axes, as a leg has without an ankle's joint or without a hip's pitch,
what is above and below them tells which ones they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrhubo.robot.discovery.arm import GUESS, Spot, doubted
from mrhubo.robot.discovery.bodies import Bodies, Chain, lines_of
from mrhubo.robot.discovery.elbow import find_elbow
from mrhubo.robot.discovery.ends import limb_end, long_branches
from mrhubo.robot.discovery.leg_axes import PARALLEL_PITCH, TILTED, gap, more_hinges, parallel, pitches
from mrhubo.robot.discovery.lines import LEAST, ON, Line, feet, sine
from mrhubo.robot.discovery.names import speaks_of

_TOES = 0.15
"""How far toes reach at most, as a share of the leg along its axes."""
_OFF = 0.1
"""How far toes' axis is from the ankle's at least, as a share of the shank."""
_SQUARE = 0.999
"""Sine over which an axis lies in the plane in which a knee moves the shank: 87 degrees."""
_MEET = 0.05
"""How near axes of a hip pass each other that are meant to cross, as a share of the thigh."""


@dataclass(frozen=True)
class Leg:
    """A leg whose joints have their roles."""

    chain: Chain
    """Its rotary joints, without toes."""
    hip_at: int | None
    """Position of the hip's pitch in the chain."""
    knee_at: int
    ankle_at: int | None
    hip: Spot
    knee: Spot
    ankle: Spot
    straight: bool
    """Whether parallel axes told the knee."""
    wheeled: bool = False
    """Whether it ends in a wheel, which is no foot: the ankle is the axle, and no joint of the chain turns it."""


def read_leg(bodies: Bodies, chain: Chain) -> Leg | None:
    """Roles and points of a leg's joints; None if it has no knee."""
    rotary = tuple(step for step in chain if step.hinge.rotary)
    wheel = rotary[-1] if _is_wheel(rotary) else None
    lines = lines_of(rotary)
    places = pitches(bodies, rotary, lines)
    # By what slides, how many joints turn before it.
    above = [sum(step.hinge.rotary for step in chain[:i]) for i, step in enumerate(chain) if not step.hinge.rotary]
    if places is None:
        knee_at = find_elbow(bodies, rotary)
        # What slides between a hip and an ankle stands for a knee.
        if knee_at is None or any(0 < count < len(rotary) for count in above):
            return None
        hip_at = next((i for i in reversed(range(knee_at)) if parallel(lines[i], lines[knee_at])), None)
        ankle_at = knee_at + 1 if knee_at + 1 < len(rotary) else None
    else:
        hip_at, knee_at, ankle_at = places
        if hip_at is not None and any(hip_at < count <= knee_at for count in above):
            return None  # an ankle and toes
    ball_3 = _ball(lines[:knee_at], lines[knee_at])
    aside_3 = _across(lines, knee_at, hip_at, ankle_at, _SQUARE)
    if aside_3 is None:
        aside_3 = ball_3 if ball_3 is not None else _across(lines, knee_at, hip_at, ankle_at, PARALLEL_PITCH)
    if aside_3 is None:
        aside_3 = bodies.position(rotary[knee_at].outer_link)
    knee_3 = lines[knee_at].nearest(aside_3)
    if hip_at is not None and (ball_3 is None or parallel(lines[hip_at], lines[knee_at])):
        between = lines[hip_at + 1 : knee_at]
        crossing = bool(between) and sine(between[-1].axis_3, lines[hip_at].axis_3) > TILTED
        hip_3 = feet(lines[hip_at], between[-1])[0] if crossing else lines[hip_at].nearest(knee_3)
        cue, sure = f"the axis of '{rotary[hip_at].hinge.name}' above the knee", 0.9
    elif ball_3 is not None:
        hip_3, cue, sure = ball_3, "where the axes before the knee cross", 0.8
    else:
        hip_3, cue = _without_pitch(bodies, rotary[:knee_at], lines[knee_at], knee_3)
        sure = GUESS
    ankle = _ankle(bodies, rotary, lines, knee_at, ankle_at, knee_3, hip_3)
    step = rotary[knee_at]
    links = [step.inner_link]
    for i in reversed(range(hip_at if hip_at is not None else 0, knee_at)):
        if lines[i].distance(hip_3) > ON * bodies.size:
            break
        links.append(rotary[i].outer_link)
    hip = Spot(hip_3, step.start, tuple(dict.fromkeys(links)), cue, sure)
    how, sure = "the middle one of three parallel axes", 0.95
    if places is None:
        how, sure = "the axis with the longest stretches on either side", 0.6
    elif hip_at is None:
        how, sure = "the upper one of two parallel axes, a thigh below the hip's axes", 0.8
    knee = Spot(knee_3, step.start, (step.inner_link, step.outer_link), how, sure)
    if min(math.dist(hip_3, knee_3), math.dist(knee_3, ankle.point_3)) < LEAST * bodies.size:
        return None
    if branches := long_branches(bodies, chain, _TOES):
        ankle = doubted(ankle, branches)
    if places is not None and (more := more_hinges(lines, places)):
        names = " and ".join(f"'{rotary[i].hinge.name}'" for i in more)
        hip, knee = (doubted(spot, f", though {names} bends the leg as well, some way off") for spot in (hip, knee))
    if wheel is not None and ankle_at is not None and ankle_at == len(rotary) - 1:
        axle_3 = lines[ankle_at].nearest(knee_3)
        links = (wheel.inner_link, wheel.outer_link)
        ankle = Spot(axle_3, wheel.start, links, f"the axle of '{wheel.hinge.name}', as the leg ends in a wheel", 0.8)
        return Leg(rotary[:-1], hip_at, knee_at, None, hip, knee, ankle, places is not None, wheeled=True)
    return Leg(
        _without_toes(rotary, lines, knee_at, ankle_at), hip_at, knee_at, ankle_at, hip, knee, ankle, places is not None
    )


def _is_wheel(chain: Chain) -> bool:
    """Whether a leg's last joint turns a wheel: nothing limits it, while the others have limits."""
    last = chain[-1].hinge if chain else None
    return last is not None and last.lower is None and last.upper is None and all(s.hinge.limited for s in chain[:-1])


def _ball(lines: list[Line], knee: Line) -> np.ndarray | None:
    """The point (3,) in which all axes before a knee cross, as those of a hip do that is mounted askew."""
    if len(lines) < 2 or sine(lines[-2].axis_3, lines[-1].axis_3) < TILTED:
        return None
    point_3 = feet(lines[-2], lines[-1])[1]
    near = _MEET * knee.distance(point_3)
    return point_3 if all(line.distance(point_3) < near for line in lines) else None


def _without_toes(chain: Chain, lines: list[Line], knee_at: int, ankle_at: int | None) -> Chain:
    """The chain as far as the ankle: toes turn about one more axis parallel to the ankle's, some way off."""
    if ankle_at is None:
        return chain
    least = _OFF * lines[ankle_at].distance(lines[knee_at].point_3)
    toes = (
        i for i in range(ankle_at + 1, len(chain))
        if parallel(lines[i], lines[ankle_at]) and lines[i].distance(lines[ankle_at].point_3) > least
    )  # fmt: skip
    return chain[: next(toes, len(chain))]


def _without_pitch(bodies: Bodies, before: Chain, knee: Line, knee_3: np.ndarray) -> tuple[np.ndarray, str]:
    """The hip (3,) where none of its axes is parallel to the knee's and they do not cross, and how it was told."""
    lines = lines_of(before)
    if gap(lines[-1], knee) > _MEET * bodies.size:
        return lines[-1].nearest(knee_3), "the point of the last axis before the knee"
    if len(lines) > 1 and sine(lines[-2].axis_3, lines[-1].axis_3) > TILTED:
        return feet(lines[-2], lines[-1])[1], "where the last axes before the knee are nearest to each other"
    name, link = before[-1].hinge.name, before[-1].outer_link
    return bodies.position(link), f"where the file puts '{name}', as a turn about the thigh alone tells no place"


def _across(
    lines: list[Line], knee_at: int, hip_at: int | None, ankle_at: int | None, least: float
) -> np.ndarray | None:
    """A point (3,) that tells how far from the middle a leg runs: where an axis that lies about in the plane in which
    the knee moves the shank meets one that is lateral. None if there is none: `least` is the sine of the angle that the
    two must have.
    """

    def upright(between: list[Line], lateral: int) -> list[Line]:
        return [line for line in between if sine(line.axis_3, lines[lateral].axis_3) > least]

    first = hip_at + 1 if hip_at is not None else 0
    if above := upright(lines[first:knee_at], knee_at):
        return feet(above[-1], lines[knee_at])[0]
    if ankle_at is not None and (others := upright(lines[knee_at + 1 :], ankle_at)):
        return feet(lines[ankle_at], others[0])[0]
    before = [line for line in lines[: hip_at or 0] if sine(line.axis_3, lines[knee_at].axis_3) > 0.9]
    return feet(lines[hip_at], before[-1])[0] if before and hip_at is not None else None


def _ankle(
    bodies: Bodies,
    chain: Chain,
    lines: list[Line],
    knee_at: int,
    ankle_at: int | None,
    knee_3: np.ndarray,
    hip_3: np.ndarray,
) -> Spot:
    if ankle_at is None:
        end_3, how, sure = limb_end(bodies, chain[-1], knee_3, knee_3 - hip_3, "ankle")
        return Spot(end_3, chain[-1].end, (chain[-1].outer_link,), how, sure)
    others = [i for i in range(knee_at + 1, len(lines)) if i != ankle_at and not parallel(lines[i], lines[ankle_at])]
    if others:
        point_3, cue, sure = (
            feet(lines[ankle_at], lines[others[0]])[0],
            "where the ankle's axes are nearest to each other",
            0.95,
        )
    else:
        point_3, cue, sure = lines[ankle_at].nearest(knee_3), "the ankle axis's point nearest to the knee", 0.8
    # A second hinge of the knee moves the ankle, and is none of its joints.
    hinges = (i for i in range(knee_at + 1, ankle_at) if parallel(lines[i], lines[ankle_at]))
    first = max(hinges, default=knee_at) + 1
    step = chain[first]
    links = [step.inner_link]
    for i in range(first, len(lines)):
        if lines[i].distance(point_3) > ON * bodies.size:
            break
        links.append(chain[i].outer_link)
    return Spot(point_3, step.start, tuple(links), cue, sure)


def read_sole(bodies: Bodies, leg: Leg, up_3: np.ndarray) -> Spot | None:
    """The lowest point below the ankle, on the foot; None if nothing tells it."""
    foot = leg.chain[-1].end
    link = leg.chain[-1].outer_link
    named = [name for name in bodies.links_of[foot] if speaks_of(name, "sole") and name != link]
    if bodies.shapes_of[foot]:
        height = float((bodies.corners(foot) @ up_3).min())
        cue, sure = "the lowest of the foot's shapes", 0.9
    elif named:
        height = min(float(bodies.position(name) @ up_3) for name in named)
        cue, sure = f"the link '{named[0]}', after its name", 0.8
    else:
        lowest = min(bodies.links_of[foot], key=lambda name: float(bodies.position(name) @ up_3))
        height = float(bodies.position(lowest) @ up_3)
        cue, sure = f"the lowest link '{lowest}' fixed to the foot", 0.5
    below = float(leg.ankle.point_3 @ up_3) - height
    if below < 0.02 * float(np.linalg.norm(leg.ankle.point_3 - leg.hip.point_3)):
        return None
    return Spot(leg.ankle.point_3 - below * up_3, foot, (link,), cue, sure)
