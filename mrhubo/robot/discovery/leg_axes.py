"""Which of a leg's axes are hip, knee and ankle: those that are parallel, and how far they are from each other."""

from __future__ import annotations

import itertools
import math

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies, Chain
from mrhubo.robot.discovery.lines import Line, feet, sine

PARALLEL_PITCH = 0.2
"""Sine under which hip, knee and ankle pitch count as parallel, as the joints stand: 11 degrees."""
TILTED = 0.6
"""The same of a hip's pitch, which some robots tilt by up to 30 degrees."""
_FOURTH = 0.05
"""How far from hip, knee and ankle an axis lies that bends a leg as well, as a share of the leg."""
_APART = 0.15
"""How far hip, knee and ankle are at least from each other, as a share of the leg."""
_SHORT = 0.5
"""How long a thigh is at least, as a share of the shank."""


def pitches(bodies: Bodies, chain: Chain, lines: list[Line]) -> tuple[int | None, int, int] | None:
    """Positions of hip pitch, knee and ankle pitch in a leg, the first one None where no axis of the hip is parallel
    to the knee's; None if the axes do not tell them.
    """
    three = _three(lines)
    if three is not None:
        thigh, shank = (lines[i].distance(lines[j].point_3) for i, j in itertools.pairwise(three))
        if shank > _SHORT * thigh:
            return three
    # Knee, ankle and toes are three as well.
    pair = _knee_and_ankle(bodies, chain, lines)
    return three if pair is None else (None, *pair)


def _three(lines: list[Line]) -> tuple[int, int, int] | None:
    """Hip pitch, knee and ankle pitch: three parallel axes far from each other."""
    best, found = 0.0, None
    length = (
        max(one.distance(other.point_3) for one, other in itertools.combinations(lines, 2)) if len(lines) > 2 else 0.0
    )
    for j in range(1, len(lines)):
        # The next parallel axis some way off is the ankle's; toes have one more, and a knee of two hinges one between.
        shanks = {
            k: lines[j].distance(lines[k].point_3) for k in range(j + 1, len(lines)) if parallel(lines[j], lines[k])
        }
        most = max(shanks.values(), default=0.0)
        k = next((k for k, shank in shanks.items() if shank > max(_APART * length, _SHORT * most)), None)
        if k is None:
            continue
        shank = shanks[k]
        thighs = [lines[i].distance(lines[j].point_3) for i in range(j)]
        above = [
            i
            for i in range(j)
            if thighs[i] > _APART * (thighs[i] + shank) and sine(lines[i].axis_3, lines[j].axis_3) < TILTED
        ]
        if not above:
            continue
        longest = max(thighs[i] for i in above)
        above = [i for i in above if thighs[i] > _SHORT * longest]
        i = min(above, key=lambda i: (round(sine(lines[i].axis_3, lines[j].axis_3), 2), -i))
        if min(thighs[i], shank) > best:
            best, found = min(thighs[i], shank), (i, j, k)
    return found


def _knee_and_ankle(bodies: Bodies, chain: Chain, lines: list[Line]) -> tuple[int, int] | None:
    """Knee and ankle pitch of a leg whose hip has no pitch: two parallel axes, the upper one a thigh below the hip's
    axes, and less than that beyond the lower one. None where there are none, or where these two are hip and knee.
    """
    for j in range(1, len(lines)):
        shanks = {
            k: lines[k].distance(lines[j].point_3) for k in range(j + 1, len(lines)) if parallel(lines[j], lines[k])
        }
        if shanks and all(sine(line.axis_3, lines[j].axis_3) > TILTED for line in lines[:j]):
            # Toes have one more parallel axis, not much farther off.
            k = next(k for k, shank in shanks.items() if shank > _SHORT * max(shanks.values()))
            break
    else:
        return None
    shank, thigh = shanks[k], max(gap(line, lines[j]) for line in lines[:j])
    if thigh < _APART * shank:  # turns about the thigh alone
        thigh = max(lines[j].distance(bodies.position(step.outer_link)) for step in chain[:j])
    beyond = bodies.beyond(chain[k])[0]
    corners = [bodies.corners(body) for body in beyond]
    masses = [
        2 * centre_3 - lines[k].nearest(centre_3) for body in beyond if (centre_3 := bodies.centre(body)) is not None
    ]
    foot = max(
        lines[k].distance(point_3) for point_3 in np.concatenate([*corners, *(mass_3[None] for mass_3 in masses)])
    )
    return (j, k) if thigh > max(foot, _SHORT * shank) else None


def more_hinges(lines: list[Line], places: tuple[int | None, int, int]) -> list[int]:
    """Further axes down to the ankle's that are parallel to the knee's and lie away from hip, knee and ankle: a leg of
    four parts, as of a bird.
    """
    told = [place for place in places if place is not None]
    length = sum(lines[i].distance(lines[j].point_3) for i, j in itertools.pairwise(told))
    return [
        i for i in range(places[2])
        if i not in told and parallel(lines[i], lines[places[1]])
        and all(lines[i].distance(lines[j].point_3) > _FOURTH * length for j in told)
    ]  # fmt: skip


def parallel(one: Line, other: Line) -> bool:
    """Whether two axes are parallel as pitches of a leg are, which files turn a little."""
    return sine(one.axis_3, other.axis_3) < PARALLEL_PITCH


def gap(one: Line, other: Line) -> float:
    """How near two axes pass each other [m]."""
    return math.dist(*feet(one, other))
