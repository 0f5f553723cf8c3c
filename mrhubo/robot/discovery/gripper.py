"""Where an arm ends and a hand begins: jaws, joints that slide, mimic or are mimicked, more than a wrist can have."""

from __future__ import annotations

import itertools

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies, Chain, Step, lines_of
from mrhubo.robot.discovery.elbow import WRIST_JOINTS, ball_of, elbow_reach, find_elbow
from mrhubo.robot.discovery.ends import carried_along
from mrhubo.robot.discovery.lines import ON, PARALLEL, Line, feet, measure, sine, unit
from mrhubo.robot.discovery.names import speaks_of

_BESIDE = 0.025
"""How far a jaw's axis passes the hand's line, as a share of the arm."""
_FINGER = 0.4
"""How long a finger is at most, as a share of the way from the elbow to its base; a hand is 0.7 of a forearm."""
_PHALANX = 0.25
"""How long a finger's link is at most, as a share of the way from the elbow to the finger; a hand is longer."""
_MEET = 0.005
"""How near two axes pass each other that are meant to cross, as a share of the arm: 2 mm on half a metre."""
_LONGER = 1.5
"""How many times longer the shorter one of upper arm and forearm must be with a driven joint than without it."""
_ROUND = 5.5
"""From what range on a joint is no jaw's [rad]."""
_SHORT = 4
"""Joints of an arm of which even one that others mimic is no gripper: a bar beside the elbow follows it."""


def without_hand(bodies: Bodies, chain: Chain) -> tuple[Chain, tuple[tuple[str, str], ...]]:
    """The joints of the arm proper, and those that belong to a hand: jaws, sliding ones, more than a wrist can have."""
    whole = chain
    chain = without_gripper(bodies, chain)
    end, why = len(chain), "others mimic it, or it slides: a gripper"
    elbow_at = find_elbow(bodies, chain)
    first, most = 2, WRIST_JOINTS
    if elbow_at is not None:
        first, most = elbow_at + 1, WRIST_JOINTS + ball_of(lines_of(chain), elbow_at)
    for i in range(first, len(chain)):
        step = chain[i]
        # Behind a gripper nothing is driven by itself; a bar beside the elbow follows it too.
        if all(_driven(on) for on in chain[i:]) and (i >= _SHORT or not step.hinge.alone):
            end = i
        elif i - first >= most:
            end, why = i, "a wrist has no more than three joints, so it belongs to a gripper"
        elif elbow_at and _is_finger(chain, elbow_at, i):
            end, why = i, "parallel axes near each other, up to the end: a finger"
        elif (i > first or (elbow_at and i == len(chain) - 1)) and _is_named_hand(step):
            end, why = i, "its name says that it belongs to the hand"
        else:
            continue
        break
    if end == len(chain) and elbow_at and not bodies.onward(chain[-1]):
        if end > first + 1 and _is_jaw(chain, elbow_at) and not (_rolls(bodies, chain) or _turns_round(chain)):
            end, why = end - 1, "its axis lies beside the hand's, as a jaw's does"
        elif end == first + 1 and _is_lone_jaw(bodies, chain, elbow_at):
            end, why = end - 1, "its axis lies beside the forearm's middle and it carries no more than a finger: a jaw"
    return chain[:end], tuple((step.hinge.name, why) for step in whole[end:])


def _is_named_hand(step: Step) -> bool:
    return speaks_of(step.hinge.name, "hand") and not speaks_of(step.hinge.name, "turn")


def _is_finger(chain: Chain, elbow_at: int, at: int) -> bool:
    """Whether a joint is the first of a finger: two or more follow, all parallel to it, and each nearer to the one
    before than a hand is long. A wrist's axes cross; one that is parallel to a single jaw's may be either.
    """
    lines = lines_of(chain)
    least, most = (
        ON * lines[elbow_at].distance(lines[at].point_3),
        _PHALANX * lines[at].distance(feet(lines[elbow_at], lines[at])[0]),
    )
    return at + 2 < len(chain) and all(
        sine(one.axis_3, other.axis_3) < PARALLEL and least < one.distance(other.point_3) < most
        for one, other in itertools.pairwise(lines[at:])
    )


def _is_jaw(chain: Chain, elbow_at: int) -> bool:
    """Whether the last joint of an arm is a jaw by where its axis lies: beside the line of the wrist's axes, or
    parallel to one that swings the wrist already.
    """
    lines = lines_of(chain)
    found = measure(lines)
    arm, last, hinge = found.out_N[-1], lines[-1], lines[elbow_at]
    along_3 = unit(found.nodes_N3[-1] - found.nodes_N3[elbow_at])
    if sine(along_3, last.axis_3) < 0.7:
        return False
    first = elbow_at + 1 + ball_of(lines, elbow_at)
    before = [line for line in lines[first:-1] if sine(along_3, line.axis_3) > 0.7]
    if any(sine(line.axis_3, last.axis_3) < 0.1 for line in before):
        return True
    if any(float(np.linalg.norm(np.subtract(*feet(line, last)))) < _MEET * arm for line in before):
        return False  # two axes that cross are a wrist, wherever the forearm's twist passes them
    twists = [line for line in lines[first:-1] if line not in before and sine(line.axis_3, hinge.axis_3) > 0.95]
    return bool(twists) and float(np.linalg.norm(np.subtract(*feet(twists[0], last)))) > _BESIDE * arm


def _turns_round(chain: Chain) -> bool:
    """Whether the last joint turns all the way round, as no jaw does: by its limits, or as the only one without any."""
    hinge = chain[-1].hinge
    if hinge.lower is None or hinge.upper is None:
        return any(step.hinge.limited for step in chain)
    return hinge.upper - hinge.lower > _ROUND


def _rolls(bodies: Bodies, chain: Chain) -> bool:
    """Whether what the last joint carries lies along its axis, as a tool's flange does."""
    before, last = lines_of(chain)[-2:]
    return carried_along(bodies, chain[-1], feet(before, last)[1]) is not None


def _is_lone_jaw(bodies: Bodies, chain: Chain, elbow_at: int) -> bool:
    """Whether the only joint beyond an elbow is a jaw: a wrist's axis crosses the forearm's middle and carries a hand,
    which is about as long as the forearm; a jaw's passes beside it, and carries a finger.
    """
    hinge, last = chain[elbow_at].hinge.line, chain[-1].hinge.line
    centre_3, before_3 = bodies.centre(chain[-1].start), feet(hinge, last)[0]
    if elbow_at > 0 and sine(chain[elbow_at - 1].hinge.line.axis_3, hinge.axis_3) > PARALLEL:
        before_3 = feet(hinge, chain[elbow_at - 1].hinge.line)[0]
    if centre_3 is None or not (way_3 := unit(centre_3 - before_3)).any() or sine(way_3, last.axis_3) < 0.7:
        return False
    middle = Line(before_3, way_3)
    beside = float(np.linalg.norm(np.subtract(*feet(middle, last))))
    corners = np.concatenate([bodies.corners(chain[-1].end), *([] if (tip := bodies.centre(chain[-1].end)) is None
                              else [[last.nearest(tip) + 2 * (tip - last.nearest(tip))]])])  # fmt: skip
    finger = max(last.distance(corner_3) for corner_3 in corners)
    forearm = last.distance(before_3)
    arm = float(measure(lines_of(chain)).out_N[-1])
    return beside > _BESIDE * arm and ON * bodies.size < finger < _FINGER * forearm


def without_gripper(bodies: Bodies, chain: Chain) -> Chain:
    """A limb without the joints at its end that slide, mimic, or are mimicked: they are a gripper wherever they lie,
    and no part of a forearm. But an elbow may be driven by a motor elsewhere, or drive a bar beside it: then what is
    left without it has no stretches as long on both sides of a joint.
    """
    kept = chain
    while len(kept) > 2 and _driven(kept[-1]):
        kept = kept[:-1]
    for end in range(len(kept), len(chain)):
        if chain[end].hinge.rotary and elbow_reach(bodies, chain[: end + 1]) > _LONGER * elbow_reach(bodies, kept):
            kept = chain[: end + 1]
    return kept


def _driven(step: Step) -> bool:
    return not step.hinge.rotary or step.hinge.drives or not step.hinge.alone
