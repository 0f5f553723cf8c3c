"""The elbow: the axis of an arm with long stretches on both sides, upper arm and forearm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies, Chain, Step, lines_of
from mrhubo.robot.discovery.lines import LEAST, ON, Line, feet, measure, sine

WRIST_JOINTS = 3
"""Joints beyond an elbow that an arm can have: a twist and two swings."""
_HAND, _FOREARM = 0.5, 0.75
"""How much what lies beyond the last joint counts as a forearm, as it may be a long gripper; and beyond one whose axis
crosses the one before, as a twist does at an elbow."""
_SAME = 0.02
"""Stretches shorter than this share of the longest one are none: the axes meet in a point."""
_CROSSING = 0.1
"""How near two axes pass each other that cross, as a share of the longest stretch."""
_CLOSE = 0.8
"""Second axis's share of the elbow's stretches from which on it may be the elbow as well."""
_BALL = 0.5
"""How far apart axes of one shoulder are, as a share of the upper arm; what lies farther off is a clavicle's."""
_BEFORE, _FEW = 3, 0.8
"""Joints before the elbow of an arm with many, and what an elbow loses for each that is missing: it may be a shoulder
below a clavicle."""


def find_elbow(bodies: Bodies, chain: Chain) -> int | None:
    """Position of the elbow's hinge: the axis with the longest stretches of the arm on either side of it. None if the
    chain is too short to have one.
    """
    scores = _elbow_scores(bodies, chain)
    return None if scores is None else _best(chain, scores)


def elbow_and_rival(bodies: Bodies, chain: Chain) -> tuple[int, str | None] | None:
    """`find_elbow`, and the joint that may be the elbow as well, if one has stretches about as long on either side.
    Beyond an elbow that has a whole shoulder before it, and no more joints beyond it than a wrist has, a wrist with a
    long hand is none.
    """
    scores = _elbow_scores(bodies, chain)
    if scores is None:
        return None
    elbow_at = _best(chain, scores)
    if elbow_at >= _BEFORE and len(chain) - elbow_at - 1 <= WRIST_JOINTS:
        scores[elbow_at + 1 :] = 0.0
    best = float(scores[elbow_at])
    scores[elbow_at] = 0.0
    other = int(np.argmax(scores))
    return elbow_at, chain[other].hinge.name if scores[other] > _CLOSE * best else None


def _best(chain: Chain, scores: np.ndarray) -> int:
    near = [i for i, score in enumerate(scores) if score > _CLOSE * scores.max()]
    if len(near) == 1:
        return near[0]
    out_N = measure(lines_of(chain)).out_N
    gap_N = np.diff(out_N)

    def fitness(i: int) -> tuple[bool, int, int, bool, float]:
        swings = _swings(gap_N, i)
        # An arm of more joints than a human's may begin with a boom.
        short = len(scores) > _BEFORE + 1 + WRIST_JOINTS or float(out_N[i - swings]) < gap_N[i - 1]
        whole = len(scores) - i - 1 <= WRIST_JOINTS
        return short, min(swings, 2), min(i, _BEFORE), whole, float(scores[i])

    # Of those about as good, one whose clavicle is shorter than its upper arm, with a whole shoulder before it, and no
    # more beyond it than a wrist has.
    return max(near, key=fitness)


def _swings(gap_N: np.ndarray, elbow_at: int) -> int:
    """How many axes before an elbow are its shoulder's, near each other."""
    near = 1
    while near < elbow_at and gap_N[elbow_at - 1 - near] < _BALL * gap_N[elbow_at - 1]:
        near += 1
    return near


def elbow_reach(bodies: Bodies, chain: Chain) -> float:
    """How long the shorter one of upper arm and forearm is about [m], whichever joint is the elbow; 0 without one."""
    scores = _elbow_scores(bodies, chain)
    return 0.0 if scores is None else float(scores.max())


def _elbow_scores(bodies: Bodies, chain: Chain) -> np.ndarray | None:
    """How long the shorter one of the two stretches beside each axis is [m] (N,), with less weight where joints are
    missing before it; None if there are too few axes, or all meet in one point.
    """
    if len(chain) < 2:
        return None
    found = measure(lines_of(chain))
    gap_N = np.diff(found.out_N, append=found.out_N[-1])
    longest = float(gap_N.max())
    if longest < LEAST * bodies.size:
        return None
    beyond = _beyond(bodies, chain[-1], found.nodes_N3[-1])
    # Where nothing tells, as where all shapes are meshes, as far as is usual.
    gap_N[-1] = _HAND * longest if beyond is None else (_FOREARM if _meets(chain, longest) else _HAND) * beyond
    scores = np.zeros(len(chain))
    for i in range(1, len(chain)):
        # A twist at the elbow comes before the forearm, and so do the other axes of an elbow that is a ball: the
        # stretch is one axis further, or behind all that meet there. Without a shoulder before it, that ball is one.
        met = (k for k in range(i, len(chain)) if gap_N[k] > _SAME * longest)
        after = max(gap_N[i : max(i + 2, next(met, i) + 1 if i >= _BEFORE else 0)])
        scores[i] = min(gap_N[i - 1], after) * (_FEW ** max(0, _BEFORE - i) if len(chain) > _BEFORE + 2 else 1.0)
        # More joints than a wrist has beyond it: the elbow is farther out, and the first ones are a clavicle's.
        scores[i] *= _FEW ** max(0, len(chain) - i - 2 - WRIST_JOINTS)
    if not scores.any():
        scores[1:] = gap_N[:-1]
    return scores


def ball_of(lines: Sequence[Line], elbow_at: int) -> int:
    """How many axes beyond an elbow's hinge meet it there, one of which twists the forearm, where the elbow is a ball;
    0 where it is none.
    """
    out_N = measure(lines).out_N
    met = sum(out - out_N[elbow_at] < _SAME * out_N[-1] for out in out_N[elbow_at + 1 :])
    return met if met > 1 and elbow_at + 1 + met < len(lines) else 0


def _meets(chain: Chain, longest: float) -> bool:
    """Whether the last axis crosses the one before, about at a right angle."""
    one, other = lines_of(chain)[-2:]
    near = float(np.linalg.norm(np.subtract(*feet(one, other)))) < _CROSSING * longest
    return near and sine(one.axis_3, other.axis_3) > 1 - _CROSSING


def _beyond(bodies: Bodies, last: Step, end_3: np.ndarray) -> float | None:
    """How far a limb reaches beyond its last joint [m], by shapes, masses and links; None where these tell nothing."""
    # Fingers are no part of a forearm: a limb ends where they begin.
    bases = [bodies.position(on.outer_link)[None] for on in bodies.onward(last)]
    corners = np.concatenate([bodies.corners(last.end), *bases])
    centre_3 = bodies.centre(last.end)
    if centre_3 is not None:
        corners = np.vstack([corners, end_3 + 2 * (centre_3 - end_3)])
    # The joint's own origin lies on its axis, wherever along it a file puts it, and says nothing.
    own_3 = bodies.position(last.outer_link)
    corners = corners[np.linalg.norm(corners - own_3, axis=-1) > ON * bodies.size]
    return float(np.linalg.norm(corners - end_3, axis=-1).max()) if len(corners) else None
