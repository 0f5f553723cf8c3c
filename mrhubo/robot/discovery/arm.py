"""Shoulder, elbow and wrist from the axes of an arm.

The way from the first axis to the last along common normals (`lines.measure`) does not depend on the zero pose. An
elbow is the axis on it with long stretches on both sides, upper arm and forearm; what comes before turns the
upper arm, what comes after forearm and hand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies, Chain, lines_of
from mrhubo.robot.discovery.elbow import ball_of, elbow_and_rival
from mrhubo.robot.discovery.ends import OUT, limb_end, long_branches
from mrhubo.robot.discovery.gripper import without_hand
from mrhubo.robot.discovery.lines import LEAST, ON, Line, feet, measure, sine, unit
from mrhubo.robot.discovery.names import speaks_of

_SHORT, _NAMED = 0.6, 0.5
"""How long a forearm is usually at least, as a share of the upper arm, and one whose twist is called a wrist's: shorter
ones are asked about where no joint that swings tells the wrist."""
_TWIST_SINE, _TWIST_MISS = 0.42, 0.35
"""Of a twist axis: sine of its angle to the limb (25 degrees), and how far it may pass a limb's other end, as a share
of its length."""
_ACROSS = 0.7
"""Sine of the angle between a twist axis and the elbow's hinge at the least: 45 degrees."""
_CLAVICLE = 0.2
"""How far a first axis passes the shoulder if it is a clavicle's, as a share of the arm (0.1 m on a human's)."""
_TELESCOPE = 0.15
"""How far an arm reaches at least beyond a joint that makes it longer, as a share of it; a gripper's reaches less."""
_FINGER = 0.4
"""How far fingers reach at most, as a share of the arm along its axes."""
GUESS = 0.45
"""How sure a choice is between two that are about as good: asked about."""


@dataclass(frozen=True)
class Spot:
    """A point and the body that carries it."""

    point_3: np.ndarray
    body: int
    links: tuple[str, ...]
    """Links in which it may be written down: the carrying one, and others in which it stays as well."""
    cue: str
    confidence: float


def doubted(spot: Spot, why: str) -> Spot:
    """A point that is asked about, and why."""
    return replace(spot, confidence=min(spot.confidence, GUESS), cue=spot.cue + why)


@dataclass(frozen=True)
class Arm:
    """An arm whose joints have their roles."""

    chain: Chain
    """All its joints, without those of the hand."""
    elbow_at: int
    """Position of the elbow's hinge in the chain."""
    twist_at: int | None
    """Of the upper arm's twist, if there is one."""
    clavicles: int
    """How many joints before the shoulder's belong to a clavicle."""
    shoulder: Spot
    elbow: Spot
    hinge_3: np.ndarray
    """The point of the elbow's hinge itself nearest to the upper arm's twist axis."""
    wrist: Spot
    forearm_twist_at: int | None
    left_out: tuple[tuple[str, str], ...]
    """Joints cut off at the end, and why."""

    @property
    def length(self) -> float:
        """Upper arm and forearm [m]."""
        upper = float(np.linalg.norm(self.elbow.point_3 - self.shoulder.point_3))
        return upper + float(np.linalg.norm(self.wrist.point_3 - self.elbow.point_3))


def read_arm(bodies: Bodies, chain: Chain, by_origin: bool = True) -> Arm | None:
    """Roles and points of an arm's joints; None if it has no elbow.

    Args:
        bodies: the robot.
        chain: the arm's joints, and those of its hand.
        by_origin: whether the origin of a forearm's twist may tell where the forearm ends; along its axis it lies
            wherever a file puts it.
    """
    branches = long_branches(bodies, chain, _FINGER)
    chain, slides = _without_slides(bodies, chain)
    chain, left_out = without_hand(bodies, chain)
    left_out = (*slides, *left_out)
    found = elbow_and_rival(bodies, chain)
    if found is None:
        return None
    elbow_at, other = found
    other = other or _named_elbow(chain, elbow_at)
    lines = lines_of(chain)
    twist_at = _twist(lines, elbow_at)
    shoulder, clavicles = _shoulder(chain, lines, elbow_at, twist_at)
    hinge = lines[elbow_at]
    if twist_at is None:
        point_3 = hinge_3 = hinge.nearest(shoulder.point_3)
        cue, sure = "the hinge's point nearest to the shoulder", 0.85
        forearm_at = _forearm_twist(lines, elbow_at, math.dist(point_3, shoulder.point_3))
        if forearm_at is not None:
            # Along its hinge the elbow lies where the forearm does: the shoulder's axes may cross beside both.
            point_3 = hinge_3 = feet(hinge, lines[forearm_at])[0]
            cue = "where the forearm's twist axis is nearest to the hinge"
    else:
        point_3, hinge_3 = feet(lines[twist_at], hinge)
        cue = f"where the hinge of '{chain[elbow_at].hinge.name}' is nearest to the upper arm's twist axis"
        sure = 0.95
    step = chain[elbow_at]
    on_hinge = float(np.linalg.norm(point_3 - hinge_3)) < ON * bodies.size
    links = (step.inner_link, step.outer_link) if on_hinge else (step.inner_link,)
    elbow = Spot(point_3, step.start, links, cue, sure)
    wrist, forearm_twist_at = _wrist(bodies, chain, lines, elbow_at, elbow, shoulder, by_origin)
    if min(math.dist(shoulder.point_3, elbow.point_3), math.dist(elbow.point_3, wrist.point_3)) < LEAST * bodies.size:
        return None
    if other is not None:
        why = f"; '{other}' may as well be the elbow"
        shoulder, elbow, wrist = (doubted(spot, why) for spot in (shoulder, elbow, wrist))
    if branches:
        shoulder, elbow, wrist = (doubted(spot, branches) for spot in (shoulder, elbow, wrist))
    return Arm(chain, elbow_at, twist_at, clavicles, shoulder, elbow, hinge_3, wrist, forearm_twist_at, left_out)


def _named_elbow(chain: Chain, elbow_at: int) -> str | None:
    """The joint that is called an elbow where the one that was taken for it is called none, as where an upper arm lies
    along the only axis of its shoulder, and so has no length.
    """
    if speaks_of(chain[elbow_at].hinge.name, "elbow"):
        return None
    return next((step.hinge.name for step in chain if speaks_of(step.hinge.name, "elbow")), None)


def _without_slides(bodies: Bodies, chain: Chain) -> tuple[Chain, tuple[tuple[str, str], ...]]:
    """The joints of an arm without those that slide within it, as of a forearm that telescopes: their axes have a
    direction and no place. One before the first that turns is a lift, one at the end a gripper's.
    """
    first = next((i for i, step in enumerate(chain) if step.hinge.rotary), 0)
    last = max((i for i, step in enumerate(chain) if step.hinge.rotary and step.hinge.alone), default=0)
    inside = {
        i for i in range(first + 1, last)
        if not chain[i].hinge.rotary and bodies.extent(chain[i]) > _TELESCOPE * bodies.extent(chain[0])
    }  # fmt: skip
    why = "it makes the arm longer, as no human's becomes"
    kept = tuple(step for i, step in enumerate(chain) if i not in inside)
    return kept, tuple((chain[i].hinge.name, why) for i in sorted(inside))


def _twist(lines: list[Line], elbow_at: int) -> int | None:
    """The axis next before the elbow, if it runs along the upper arm."""
    if elbow_at < 1:
        return None
    twist, hinge = lines[elbow_at - 1], lines[elbow_at]
    if elbow_at == 1 or sine(twist.axis_3, hinge.axis_3) < _ACROSS:
        return None
    foot_3 = feet(twist, hinge)[1]
    before_3 = feet(lines[elbow_at - 2], twist)[0]
    upper = float(np.linalg.norm(foot_3 - before_3))
    if upper < 1e-9 or sine(twist.axis_3, unit(foot_3 - before_3)) > _TWIST_SINE:
        return None
    return elbow_at - 1 if twist.distance(foot_3) < _TWIST_MISS * upper else None


def _forearm_twist(lines: list[Line], elbow_at: int, upper: float) -> int | None:
    """Position of the forearm's twist, of an arm whose upper arm is so long [m]; None if it has none."""
    if elbow_at + 1 >= len(lines):
        return None
    twist_at = elbow_at + 1
    if ball := ball_of(lines, elbow_at):
        nodes_N3 = measure(lines).nodes_N3
        along_3 = unit(nodes_N3[elbow_at + 1 + ball] - nodes_N3[elbow_at])
        twist_at = min(range(twist_at, twist_at + ball), key=lambda i: sine(lines[i].axis_3, along_3))
    # A swing of a wrist passes the elbow a forearm away; a twist passes it close by.
    hinge, axis = lines[elbow_at], lines[twist_at]
    close = float(np.linalg.norm(np.subtract(*feet(hinge, axis)))) < _TWIST_MISS * upper
    return twist_at if close and sine(hinge.axis_3, axis.axis_3) > 0.5 else None


def _shoulder(chain: Chain, lines: list[Line], elbow_at: int, twist_at: int | None) -> tuple[Spot, int]:
    """The shoulder's centre, and how many joints before it are a clavicle's."""
    swings = list(range(elbow_at if twist_at is None else twist_at))
    hinge = lines[elbow_at]
    last = swings[-1] if swings else 0
    if twist_at is not None and swings:
        on_twist_3, on_swing_3 = feet(lines[twist_at], lines[last])
        if len(swings) > 1 and sine(lines[twist_at].axis_3, lines[last].axis_3) < 0.3:
            on_twist_3 = lines[twist_at].nearest(feet(lines[last - 1], lines[last])[1])
        point_3, cue, sure = on_twist_3, "where the upper arm's twist axis passes the last axis that swings it", 0.9
        body, step = chain[twist_at].end, chain[twist_at]
    elif len(swings) > 1:
        one_3, other_3 = feet(lines[last - 1], lines[last])
        point_3, cue, sure = other_3, "where the last two axes that swing the upper arm are nearest to each other", 0.85
        body, step = chain[last].end, chain[last]
    else:
        point_3 = lines[last].nearest(hinge.point_3)
        cue, sure, body, step = "the point of the only axis nearest to the elbow", 0.6, chain[last].end, chain[last]
    arm = float(np.linalg.norm(hinge.nearest(point_3) - point_3)) * 2
    clavicles = 0
    while clavicles < len(swings) - 1 and lines[clavicles].distance(point_3) > _CLAVICLE * arm:
        clavicles += 1
    links = [step.outer_link]
    for swing in reversed(swings[clavicles:]):
        if lines[swing].distance(point_3) < ON * arm:
            links += [chain[swing].outer_link]
        else:
            break
    if clavicles:
        cue += f"; {clavicles} joint{'s' * (clavicles > 1)} before it belong to the clavicle"
    return Spot(point_3, body, tuple(dict.fromkeys(links)), cue, sure), clavicles


def _wrist(
    bodies: Bodies, chain: Chain, lines: list[Line], elbow_at: int, elbow: Spot, shoulder: Spot,
    by_origin: bool,
) -> tuple[Spot, int | None]:  # fmt: skip
    """The wrist, and the position of the forearm's twist."""
    upper = float(np.linalg.norm(elbow.point_3 - shoulder.point_3))
    beyond = list(range(elbow_at + 1 + ball_of(lines, elbow_at), len(chain)))
    twist_at = _forearm_twist(lines, elbow_at, upper)
    swings = [i for i in beyond if i != twist_at]
    if swings:
        step, line = chain[swings[0]], lines[swings[0]]
        if twist_at is not None:
            point_3 = feet(lines[twist_at], line)[0]
            cue, sure = "where the forearm's twist axis passes the first axis of the wrist", 0.9
        elif len(swings) > 1:
            point_3 = feet(line, lines[swings[1]])[0]
            cue, sure = "where the wrist's axes are nearest to each other", 0.85
        else:
            point_3 = line.nearest(elbow.point_3)
            cue, sure = "the point of the wrist's axis nearest to the elbow", 0.75
            if not bodies.onward(step) and not speaks_of(step.hinge.name, "turn"):
                cue, sure = f"{cue}, if it is no gripper's jaw", GUESS
        links = [step.inner_link]
        if line.distance(point_3) < ON * bodies.size:
            links.append(step.outer_link)
        return Spot(point_3, step.start, tuple(links), cue, sure), twist_at
    last = chain[-1]
    upper_3, hinged = elbow.point_3 - shoulder.point_3, elbow_at == len(chain) - 1
    end_3, how, sure = limb_end(bodies, last, elbow.point_3, upper_3, hinged=hinged)
    if twist_at is not None:
        origin_3 = bodies.position(chain[twist_at].outer_link)
        outward = float((origin_3 - elbow.point_3) @ unit(end_3 - elbow.point_3))
        # Where the twist passes the elbow at a distance, the forearm's direction depends on how far out its end is.
        farther = outward > math.dist(end_3, elbow.point_3) or lines[twist_at].distance(elbow.point_3) < 0.05 * upper
        # A hand that is fixed beyond a twist near the elbow tells more of the forearm's length.
        fixed_hand = sure > GUESS and math.dist(end_3, elbow.point_3) > _SHORT * upper > outward
        if by_origin and outward > OUT * upper and farther and not fixed_hand:
            end_3, how, sure = origin_3, "the origin of the forearm's twist, the only joint beyond the elbow", 0.7
        end_3 = lines[twist_at].nearest(end_3)
        step = chain[twist_at]
        named = any(speaks_of(name, "wrist") for name in (step.hinge.name, step.outer_link))
        if math.dist(end_3, elbow.point_3) < (_NAMED if named else _SHORT) * upper:
            sure, how = min(sure, GUESS), f"{how}, which makes a short forearm"
    return Spot(end_3, last.end, (last.outer_link,), how, sure), twist_at
