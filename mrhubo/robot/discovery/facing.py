"""Where a robot is up, and where it faces: votes of all that knows something about it, none of which is needed.

Up is told by legs and trunk, not by the file's z; a base may lie on its back. Facing is told by what bends one way only
(knees, elbows, hips), by feet, cameras and the names of sides. Legend: V votes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mrhubo.robot.discovery.arm import Arm
from mrhubo.robot.discovery.bodies import Bodies
from mrhubo.robot.discovery.leg import Leg
from mrhubo.robot.discovery.lines import cross, unit
from mrhubo.robot.discovery.motion import reach_middle
from mrhubo.robot.discovery.necks import is_named
from mrhubo.robot.discovery.roles import Roles
from mrhubo.robot.discovery.votes import NAMES, Vote, forward_votes

_BELOW = 0.2
"""How far below the shoulders a head may be, as a share of the arm: some robots carry their arms high."""
_UNSURE = 0.3
"""Up less sure than that tells nothing of necks."""
_AGREED = 1.5
"""How much it counts that all joints and frames agree on a direction, against what tells up only roughly."""
_OPPOSED = 0.3
"""How much all other votes must speak against the names of the sides to make them doubtful."""
_TRUNK = 0.6
"""How long a trunk is, as a share of the arm, that tells more than the legs."""
_LEANING, _LIGHT = 0.8, 1.0
"""Cosine of how far legs lean from the trunk that do not stand at the zero pose (37 degrees), and what they count."""
_AGAINST, _HEAVY, _DOUBTED = 0.3, 2.0, 0.45
"""Cosine under which a cue speaks against where up is, how much one has to count, and how sure up is then at most."""
_SAME = 0.9986
"""Cosine of 3 degrees: directions that mean the same one."""


@dataclass(frozen=True)
class Heading:
    """Up, left and forward: unit, at right angles, in the root's frame; and how sure they are, 0..1."""

    up_3: np.ndarray
    left_3: np.ndarray
    forward_3: np.ndarray
    up_sure: float
    forward_sure: float
    up_cue: str
    forward_cue: str
    swap: bool
    """Whether the second chain of each pair is the left one."""
    contradicted: tuple[str, ...]
    """What speaks against it."""


def choose_neck(bodies: Bodies, roles: Roles, arms: list[Arm], legs: list[Leg]) -> Roles:
    """The roles with the likeliest neck that begins above the shoulders or ends there, or with none."""
    if not roles.necks:
        return roles
    necks = [neck for neck in roles.necks if is_named(neck) or not is_named(neck, "waist")]
    if not necks:
        return roles.with_neck(())
    heading = find_heading(bodies, roles.with_neck(()), arms, legs)
    if heading.up_sure < _UNSURE:
        return roles.with_neck(necks[0])
    shoulders = float(np.mean([arm.shoulder.point_3 @ heading.up_3 for arm in arms]))
    tops = {neck: float(bodies.middle(neck[-1].end) @ heading.up_3) - shoulders for neck in necks}
    # A tail, or an arm before the chest, may end at the height of the shoulders; a head is above them if it can be.
    likely = sorted(necks, key=lambda neck: not is_named(neck) and tops[neck] < 0)
    least = -_BELOW * arms[0].length
    return roles.with_neck(next((neck for neck in likely if is_named(neck) or tops[neck] > least), ()))


def find_heading(bodies: Bodies, roles: Roles, arms: list[Arm], legs: list[Leg]) -> Heading:
    """Up by legs, trunk and axes; forward by votes.

    Args:
        bodies: the robot.
        roles: its limbs; the first chain of a pair is taken for the left one, until votes say otherwise.
        arms: both arms, in the order of the pair.
        legs: both legs in the same order, or none.
    """
    normal_3 = _normal(bodies, roles)
    up_3, up_sure, up_cue = _up(bodies, roles, arms, legs, normal_3)
    forward_3 = cross(normal_3, up_3)
    votes = list(forward_votes(bodies, roles, arms, legs, up_3, forward_3, normal_3))
    votes = [vote for vote in votes if abs(vote.value) > 0.1]
    total = sum(vote.weight for vote in votes)
    score = sum(vote.weight * vote.value for vote in votes)
    swap = score < 0
    sign = -1.0 if swap else 1.0
    fors = [vote for vote in votes if vote.value * sign > 0]
    against = tuple(vote.what for vote in votes if vote.value * sign < 0)
    fors.sort(key=lambda vote: -abs(vote.value) * vote.weight)
    cue = ", ".join(vote.what for vote in fors[:4]) or "nothing tells it; a guess"
    # Three points of weight all one way are certain; a tie, or nothing, is a guess.
    sure = float(np.clip(abs(score) / 3.0, 0.0, 1.0) * (abs(score) / max(total, 1e-9)) ** 0.5) if votes else 0.0
    if total and _names_alone(votes, sign):
        sure = min(sure, _DOUBTED)
    return Heading(up_3, sign * normal_3, sign * forward_3, up_sure, sure, up_cue, cue, swap, against)


def _names_alone(votes: list[Vote], sign: float) -> bool:
    """Whether all else, taken together, speaks against the names of the sides: they may be those that somebody sees who
    stands before the robot.
    """
    others = sum(vote.weight * vote.value for vote in votes if vote.what != NAMES)
    return any(vote.what == NAMES and vote.value * sign > 0 for vote in votes) and others * sign < -_OPPOSED


def _normal(bodies: Bodies, roles: Roles) -> np.ndarray:
    """Across the mirror plane: an axis that many joints or frames share, within 3 degrees of what the limbs'
    points tell, which a few millimetres turn.
    """
    normal_3 = roles.arms.normal_3
    steps = [step for pair in (roles.arms, roles.legs) if pair for chain in pair.chains for step in chain]
    axes = [step.hinge.line.axis_3 for step in (*steps, *roles.waist, *roles.neck)]
    axes += [*np.eye(3), *bodies.pose_44[bodies.links_of[roles.chest][0]][:3, :3].T]
    near = [np.sign(axis_3 @ normal_3) * axis_3 for axis_3 in axes if abs(float(axis_3 @ normal_3)) > _SAME]
    if not near:
        return normal_3
    return unit(
        max(
            near,
            key=lambda axis_3: (
                round(sum(float(axis_3 @ other) > 1 - 1e-6 for other in near)),
                float(axis_3 @ normal_3),
            ),
        )
    )


def _up(
    bodies: Bodies, roles: Roles, arms: list[Arm], legs: list[Leg], normal_3: np.ndarray
) -> tuple[np.ndarray, float, str]:
    cues: list[tuple[str, np.ndarray, float]] = []
    leaning = False
    shoulders_3 = np.mean([arm.shoulder.point_3 for arm in arms], axis=0)
    if legs:
        hips_3 = np.mean([leg.hip.point_3 for leg in legs], axis=0)
        ankles_3 = np.mean([leg.ankle.point_3 for leg in legs], axis=0)
        # A long trunk tells where the chest is up whatever the legs do, which may sit, or end in a loop.
        trunk_3 = shoulders_3 - hips_3
        long = min(1.0, float(np.linalg.norm(trunk_3)) / (_TRUNK * arms[0].length))
        legs_3 = hips_3 - ankles_3
        leaning = long == 1.0 and float(unit(legs_3) @ unit(trunk_3)) < _LEANING
        cues += [("the legs", legs_3, _LIGHT if leaning else 3.0), ("hips and shoulders", trunk_3, 2.0 + 2.0 * long)]
    else:
        for what, at_3, weight in _below(bodies, roles):
            near = float(np.linalg.norm(at_3 - shoulders_3)) / (0.3 * arms[0].length)
            cues.append((what, shoulders_3 - at_3, weight * min(1.0, near)))
        cues.append(("the file's z", np.array([0.0, 0.0, 1.0]), 1.0))
        middle_3 = np.mean([reach_middle(arm.chain[arm.clavicles :], arm.wrist.point_3) for arm in arms], axis=0)
        hangs_3 = (shoulders_3 - middle_3) / arms[0].length
        cues.append(("how the arms move", hangs_3, 0.7 * min(1.0, 3 * float(np.linalg.norm(hangs_3)))))
    if roles.neck:
        top_3 = bodies.middle(roles.neck[-1].end)
        cues.append(("the head", top_3 - shoulders_3, 2.0 if is_named(roles.neck) else 0.7))
    flat = [(what, vector_3 - normal_3 * (normal_3 @ vector_3), weight) for what, vector_3, weight in cues]
    flat = [(what, unit(vector_3), weight) for what, vector_3, weight in flat if np.linalg.norm(vector_3) > 1e-6]
    candidates = _directions(bodies, roles, normal_3)
    best, score = max(
        (((up_3, sum(w * float(up_3 @ v) for _, v, w in flat) + _AGREED * share) for up_3, share in candidates)),
        key=lambda found: found[1],
    )
    near = [(v, share) for v, share in candidates if float(v @ best) > _SAME]
    # Of those that mean the same direction, the one that most agree on exactly.
    best = max(near, key=lambda found: sum(float(found[0] @ other) > 1 - 1e-9 for other, _ in candidates))[0]
    total = sum(w for _, _, w in flat) or 1.0
    value = sum(w * float(best @ v) for _, v, w in flat) / total
    told = [what for what, v, _ in flat if float(best @ v) > 0.5]
    against = [what for what, v, w in flat if float(best @ v) < _AGAINST and w >= _HEAVY]
    if leaning:
        against.append("the legs, which lean from the trunk")
    if not legs and bodies.body_of[bodies.description.root] in _hanging(bodies, roles):
        against.append("that the file begins at a hand or a head, so that its frame tells nothing")
    sure, cue = float(np.clip(value, 0.0, 1.0)), ", ".join(told) or "joint axes"
    if against:
        sure, cue = min(sure, _DOUBTED), f"{cue}; against {' and '.join(against)}"
    return unit(best - normal_3 * (normal_3 @ best)), sure, cue


def _below(bodies: Bodies, roles: Roles) -> Iterator[tuple[str, np.ndarray, float]]:
    """What probably lies below the shoulders: what it is, where (3,), and how much that counts."""
    limbs = _hanging(bodies, roles)
    rest = [body for body in range(len(bodies.links_of)) if body not in limbs and body != roles.chest]
    if rest:
        yield "what carries the chest", np.mean([bodies.middle(body) for body in rest], axis=0), 1.5
    else:
        yield "the base", np.zeros(3), 1.0
        yield "the trunk", bodies.corners(roles.chest).mean(0), 0.5


def _hanging(bodies: Bodies, roles: Roles) -> set[int]:
    """The bodies of arms and of all that may be a neck."""
    more = (chain for pair in roles.more_arms for chain in pair.chains)
    return set().union(*(bodies.beyond(chain[0])[0] for chain in (*roles.arms.chains, *more, *roles.necks)))


def _directions(bodies: Bodies, roles: Roles, normal_3: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Directions in the mirror plane along or across which joints turn, and the root's axes; with their share."""
    limbs = [step for pair in (roles.arms, roles.legs) if pair for chain in pair.chains for step in chain[:4]]
    weighed = [(step.hinge.line.axis_3, 1.0) for step in (*limbs, *roles.waist)]
    weighed += [(step.hinge.line.axis_3, 0.3) for step in roles.neck]
    weighed += [(axis_3, 1.0) for axis_3 in np.eye(3)]
    weighed += [(axis_3, 1.0) for axis_3 in bodies.pose_44[bodies.links_of[roles.chest][0]][:3, :3].T]
    flat = [(unit(v - normal_3 * (normal_3 @ v)), w) for v, w in weighed if abs(float(v @ normal_3)) < 0.05]
    found = [(v, w) for axis_3, w in flat for v in (axis_3, cross(normal_3, axis_3))]
    found = [(sign * v, w) for v, w in found for sign in (1.0, -1.0)]
    if not found:
        across_3 = unit(cross(normal_3, np.eye(3)[int(np.argmin(np.abs(normal_3)))]))
        found = [(sign * v, 1.0) for v in (across_3, cross(normal_3, across_3)) for sign in (1.0, -1.0)]
    total = sum(w for _, w in flat) or 1.0
    return [(v, sum(w for other, w in found if float(v @ other) > _SAME) / total) for v, _ in found]
