"""Ranges of joints: where a URDF gives no limits, or degrees, or lets an elbow or a knee bend as no human one does."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot.discovery.arm import Arm
from mrhubo.robot.discovery.bodies import Bodies, Chain, Hinge, Step
from mrhubo.robot.discovery.facing import Heading
from mrhubo.robot.discovery.leg import Leg
from mrhubo.robot.discovery.lines import cross, unit
from mrhubo.robot.discovery.motion import bend_side, straight_angle
from mrhubo.robot.discovery.result import FoundRange, Question
from mrhubo.robot.joint import Mimic, drive

NOUGHT = 1e-4
"""Radians, or parts of a direction, that are 0 to files whose quarter turns are 1.5708."""
_ELBOW, _KNEE = 0.1, 0.35
"""How far an elbow, and a knee, must bend the other way [rad] for their range to be narrowed. A knee stands behind the
line from hip to ankle on some robots, which then stand on it bent that way."""
_TIED, _CLEAR = 0.1, 0.3
"""How much further one way a joint bends than the other, as a share, that tells nothing; and from which on it does, as
the cosine of where the limb goes."""
_TURN, _QUARTER = math.pi, math.pi / 2
"""How far either way joints without limits are taken to turn: all, and those of which no human's turns farther. Three
axes that turn all the way round reach every place of a limb twice, once with hip or shoulder turned inside out."""
_WIDE = 5.6
"""From where on a range says nothing of a joint that turns less [rad], as -3 .. 3; Unitree G1's hips turn by 5.5."""
_SLACK = 0.3
"""How much more than one turn is one [rad]. Where all joints of an arm have that, a drawing program wrote it."""
_BALL = 3
"""Axes of a shoulder that turns all ways."""
_MOST = 14.0
"""Limits wider than that mean none (`robot.limits`)."""


@dataclass(frozen=True)
class _Bend:
    """An elbow or a knee."""

    about: str
    """What a question is about: `left_elbow`."""
    step: Step
    upper_3: np.ndarray
    """From where the upper limb starts to where it ends, at the zero pose."""
    lower_3: np.ndarray
    human_3: np.ndarray
    """Where a human's lower limb goes as it bends, with the limb hanging."""
    else_33: np.ndarray
    """Where it rather goes than the other way, row by row, where it goes neither there nor away from there."""
    least: float
    """How far it must bend the other way."""
    twisted: bool
    """Whether a joint before it twists the upper limb, so that where the lower one goes at zero tells nothing."""

    @property
    def what(self) -> str:
        """`elbow` or `knee`."""
        return self.about.rpartition("_")[2]


def find_ranges(
    bodies: Bodies, arms: Mapping[str, Arm], legs: Mapping[str, Leg], chains: Iterable[Chain], heading: Heading
) -> tuple[dict[str, FoundRange], list[Question]]:
    """Ranges by joint where the URDF gives none, or degrees, or lets an elbow or a knee bend backwards; and what they
    leave open.

    Args:
        bodies: the robot.
        arms: by side.
        legs: by side, if they move.
        chains: what moves, arms among it.
        heading: where it faces.
    """
    found: dict[str, FoundRange] = {}
    asked: list[Question] = []
    chains = list(chains)
    steps = [step for chain in chains for step in chain]
    short, none = _short(arms, legs, steps), not any(step.hinge.limited for step in steps)
    wide = _without_meaning(arms, legs, chains) & short
    for step in steps:
        hinge = driver(bodies, step)
        if hinge is None or not hinge.rotary:
            continue
        if bodies.degrees and hinge.lower is not None and hinge.upper is not None:
            found[hinge.name] = FoundRange(hinge.lower, hinge.upper, "the URDF's limits, which are in degrees")
        if bodies.description.joints[hinge.name].kind == "continuous" and hinge.limited:
            why = "the URDF calls it continuous, and gives it these limits all the same"
            found[hinge.name] = FoundRange(float(hinge.lower or 0.0), float(hinge.upper or 0.0), why)
        if not _limits_meant(hinge.lower, hinge.upper):
            turn, what = (_QUARTER, "a quarter turn either way") if hinge in short else (_TURN, "a full turn")
            why = f"the URDF gives it no limits; {what} was taken"
            # What is continuous among joints with limits is meant to turn all the way round.
            guessed = none or hinge in short or bodies.description.joints[hinge.name].kind == "revolute"
            found[hinge.name] = FoundRange(-turn, turn, why, guessed)
        elif hinge is step.hinge and (turn := _turn_of(hinge, hinge in wide)) is not None:
            found[hinge.name] = turn
    for bend in _bends(arms, legs, heading):
        gear = _gear(bodies, bend.step, {step.hinge.name for step in steps})
        if gear is None:
            continue
        narrowed, question = _human_range(bodies, bend, gear, found)
        if narrowed is not None:
            whole = found.get(gear.joint)
            found[gear.joint] = replace(narrowed, guessed=whole is not None and whole.guessed)
        if question is not None:
            asked.append(question)
    return found, asked


def _short(arms: Mapping[str, Arm], legs: Mapping[str, Leg], steps: Iterable[Step]) -> set[Hinge]:
    """Joints that a human's body turns by a quarter turn at most either way from how it stands, if a file that gives
    them no limits does not mean it: all of legs, waist and neck but the hip's pitch and the knee; and of an arm whose
    upper arm twists, and of which no joint has limits, clavicles, that twist, and the wrist's.
    """
    short = {step.hinge for step in steps} - {step.hinge for arm in arms.values() for step in arm.chain}
    for leg in legs.values():
        bends = leg.chain[: leg.knee_at] if leg.hip_at is None else (leg.chain[leg.hip_at],)
        short -= {step.hinge for step in (*bends, leg.chain[leg.knee_at])}
    for arm in arms.values():
        if (twist_at := _twist(arm)) is not None and all(_turns_round(step.hinge) for step in arm.chain):
            wrist_at = (arm.elbow_at if arm.forearm_twist_at is None else arm.forearm_twist_at) + 1
            steps = (*arm.chain[: arm.clavicles], arm.chain[twist_at], *arm.chain[wrist_at:])
            short |= {step.hinge for step in steps}
    return short


def _twist(arm: Arm) -> int | None:
    """Position of the axis that twists the upper arm: the one next to the elbow, or of a shoulder of three axes the one
    that lies along the arm as it stands; None if it has none.
    """
    swings = range(arm.clavicles, arm.elbow_at)
    if arm.twist_at is not None or len(swings) < _BALL:
        return arm.twist_at
    along_3 = unit(arm.elbow.point_3 - arm.shoulder.point_3)
    return max(swings, key=lambda i: abs(float(arm.chain[i].hinge.line.axis_3 @ along_3)))


def _without_meaning(arms: Mapping[str, Arm], legs: Mapping[str, Leg], chains: Iterable[Chain]) -> set[Hinge]:
    """The joints of limbs that could be turned inside out, as all that would turn them so have limits of about a turn:
    arms, legs by the hip's axes that do not swing the thigh forwards, and what else has three joints or more.
    """
    found = {step.hinge for arm in arms.values() for step in arm.chain}
    for leg in legs.values():
        hip = [step.hinge for i, step in enumerate(leg.chain[: leg.knee_at]) if i != leg.hip_at]
        if len(hip) > 1 and all(map(_turns_round, hip)):
            found |= {step.hinge for step in leg.chain}
    limbs = [limb.chain[:1] for limb in (*arms.values(), *legs.values())]
    for chain in (chain for chain in chains if chain[:1] not in limbs):
        hinges = {step.hinge for step in chain if step.hinge.rotary}
        if len(hinges) >= _BALL and all(map(_turns_round, hinges)):
            found |= hinges
    return found


def _turn_of(hinge: Hinge, wide: bool) -> FoundRange | None:
    """The part of a range of a turn or more that is needed; None if it is all of it."""
    lower, upper = float(hinge.lower or 0.0), float(hinge.upper or 0.0)
    if wide and upper - lower > _WIDE:
        lower, upper = max(lower, -_QUARTER), min(upper, _QUARTER)
        why = "the URDF lets it turn nearly all the way round; a quarter turn either way was taken"
        return FoundRange(lower, upper, why, guessed=True) if lower < upper else None
    if upper - lower <= math.tau + _SLACK:
        return None
    middle = float(np.clip(0.0, lower + _TURN, upper - _TURN))
    why = f"the URDF lets it turn farther, {lower:.2f} .. {upper:.2f}; one turn reaches all, and winds nothing up"
    return FoundRange(middle - _TURN, middle + _TURN, why)


def _turns_round(hinge: Hinge) -> bool:
    """Whether a file gives a joint no limits, or about one turn, as a drawing program does that knows none."""
    given = _limits_meant(hinge.lower, hinge.upper)
    return not given or _WIDE < float(hinge.upper or 0.0) - float(hinge.lower or 0.0) < math.tau + _SLACK


def _bends(arms: Mapping[str, Arm], legs: Mapping[str, Leg], heading: Heading) -> Iterator[_Bend]:
    forward_3 = heading.forward_3
    for side, arm in arms.items():
        ends = [spot.point_3 for spot in (arm.shoulder, arm.elbow, arm.wrist)]
        inward_3 = -heading.left_3 if side == "left" else heading.left_3
        ways_33 = np.stack((heading.up_3, inward_3, forward_3))
        yield _Bend(
            f"{side}_elbow", arm.chain[arm.elbow_at], ends[1] - ends[0], ends[2] - ends[1], forward_3, ways_33, _ELBOW,
            _twist(arm) is not None,
        )  # fmt: skip
    for side, leg in legs.items():
        ends = [spot.point_3 for spot in (leg.hip, leg.knee, leg.ankle)]
        step, back_3 = leg.chain[leg.knee_at], -forward_3
        yield _Bend(f"{side}_knee", step, ends[1] - ends[0], ends[2] - ends[1], back_3, back_3[None], _KNEE, False)


def _gear(bodies: Bodies, step: Step, moving: Collection[str]) -> Mimic | None:
    """What drives an elbow or a knee: itself, or a motor of its own, as behind a gear; None if another joint of the
    limbs does, or one motor drives several joints.
    """
    joints, name = bodies.description.joints, step.hinge.name
    motor = driver(bodies, step)
    if motor is None or (motor.name != name and motor.name in moving):
        return None
    gear = drive(joints, name)
    shared = sum(joint.mimic is not None and joint.mimic.joint == gear.joint for joint in joints.values())
    alone = shared <= 1 or name == gear.joint or name in bodies.gains
    return gear if alone and gear.multiplier else None


def _limits_of(bodies: Bodies, hinge: Hinge, gear: Mimic, known: Mapping[str, FoundRange]) -> tuple[float, float]:
    """Limits of a joint [rad]: those of what drives it, within its own."""
    motor = next(other for other in bodies.hinges if other.name == gear.joint)
    ends = (motor.lower, motor.upper) if gear.joint not in known else (known[gear.joint].lower, known[gear.joint].upper)
    lower, upper = sorted(gear.multiplier * float(end or 0.0) + gear.offset for end in ends)
    if motor is not hinge and hinge.limited:
        lower, upper = max(lower, float(hinge.lower or 0.0)), min(upper, float(hinge.upper or 0.0))
    return lower, upper


def _human_range(
    bodies: Bodies, bend: _Bend, gear: Mimic, known: Mapping[str, FoundRange]
) -> tuple[FoundRange | None, Question | None]:
    """The human side of an elbow or a knee that bends both ways, as a range of what drives it."""
    hinge, upper_3 = bend.step.hinge, bend.upper_3
    name = hinge.name
    lower, upper = _limits_of(bodies, hinge, gear, known)
    axis_3 = bend.step.sign * hinge.line.axis_3
    straight = straight_angle(axis_3, bend.lower_3, upper_3) / bodies.gains.get(name, 1.0)
    straight = min((straight + turn for turn in (-math.tau, 0.0, math.tau)), key=lambda s: max(lower - s, s - upper))
    straight = 0.0 if abs(straight) < NOUGHT else straight
    share = bend_side(lower, upper, straight)
    goes_3 = cross(axis_3, upper_3) / max(float(np.linalg.norm(upper_3)), 1e-9)
    ahead = float(goes_3 @ bend.human_3)
    if not bend.twisted and share * ahead < 0 and min(abs(share), abs(ahead)) > _CLEAR:
        way, other, limb = ("forwards", "backwards", "leg") if bend.what == "knee" else ("backwards", "forwards", "arm")
        return None, Question(
            bend.about, f"'{name}' bends further {way} than {other}, as no human {bend.what} does: either its limits "
            f"are wrong, or the robot faces the other way, or its {limb} is no human's", (name,),
        )  # fmt: skip
    if min(straight - lower, upper - straight) < bend.least:
        return None, None
    above = share > 0
    question = None
    if abs(share) < _TIED:
        above = ahead > 0
        if abs(ahead) < _CLEAR:
            # Both sides alike, at least.
            above = next((way > 0 for way in bend.else_33 @ goes_3 if abs(way) > _CLEAR), above)
            limb = "arm" if bend.what == "elbow" else "leg"
            question = Question(
                bend.about,
                f"'{name}' bends as far one way as the other, and nothing tells which is a human's; narrow it in "
                f"robot.ranges if the {limb} bends backwards",
                (name,),
            )
    ends = (straight, upper) if above else (lower, straight)
    why = f"it bends both ways ({lower:.2f} .. {upper:.2f}), a human {bend.what} one way; straight is at {straight:.2f}"
    if gear.joint != name:
        why = f"it drives '{name}': {why}"
    low, high = sorted((float(end) - gear.offset) / gear.multiplier for end in ends)
    return FoundRange(low, high, why), question


def driver(bodies: Bodies, step: Step) -> Hinge | None:
    """The joint by which one of a limb is driven: itself, or the one that it mimics, as behind a gear."""
    if step.hinge.free:
        return step.hinge
    try:
        name = drive(bodies.description.joints, step.hinge.name).joint
    except UserError:  # told where it matters
        return None
    return next((hinge for hinge in bodies.hinges if hinge.name == name), None)


def _limits_meant(lower: float | None, upper: float | None) -> bool:
    return lower is not None and upper is not None and upper - lower <= _MOST and max(abs(lower), abs(upper)) <= _MOST
