"""From a URDF to bodies and hinges: joints that move nothing are taken for fixed ones, degrees are made radians."""

from __future__ import annotations

import collections
import math
from collections.abc import Collection, Mapping

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot.discovery.bodies import FULL_TURN, Bodies, Hinge, Step
from mrhubo.robot.discovery.lines import PARALLEL, Line, sine
from mrhubo.robot.joint import ROTARY, Joint, drive, stuck
from mrhubo.robot.limits import held_angle, in_degrees
from mrhubo.robot.urdf import Description, moved

_LIMB = 0.1
"""How far a limb reaches beyond the second of two hinges that turn as one, as a share of the robot; no finger does."""
_SPRING, _GIVES = 0.5, 1.0
"""Range of a spring behind a motor about the same axis at the most, as a share of the motor's, and in radians."""
_ALONG = 1e-3
"""How far apart two axes are at most that are one, as a share of the robot."""
_MOTOR = 2.5
"""How many times farther what a motor drives reaches than the motor itself; jaws reach as far as each other."""


def read_bodies(description: Description) -> Bodies:
    """The bodies of a robot. Joints whose numbers cannot be used are taken as fixed where they stand, and so is the
    second of two parallel hinges one after the other that turn as one, as in some elbows. A motor that is drawn beside
    the joint that it drives is no branch.
    """
    bodies = _read(description, {})
    if springs := _find_springs(bodies):
        bodies = _read(description, {}, springs, springs=springs)
    motors = _find_motors(bodies)
    bodies = _read(description, {}, springs, motors, springs) if motors else bodies
    turning = {hinge.name: hinge for hinge in bodies.hinges}
    gains: dict[str, float] = {}
    seconds: set[str] = {*springs}
    for step in (Step(hinge, hinge.bodies[0]) for hinge in bodies.hinges if not hinge.free and hinge.rotary):
        mimic = description.joints[step.hinge.name].mimic
        first = turning.get(mimic.joint) if mimic is not None else None
        if mimic is None or first is None or first.bodies[1] != step.start or not first.rotary:
            continue
        axis_3 = first.line.axis_3
        further = bodies.beyond(step)[1]
        limb = bodies.extent(step) > _LIMB * bodies.size or any(
            hinge.rotary and sine(axis_3, hinge.line.axis_3) > PARALLEL for hinge in further
        )
        if limb and sine(axis_3, step.hinge.line.axis_3) < PARALLEL:
            along = float(np.sign(axis_3 @ step.hinge.line.axis_3))
            gains[first.name] = gains.get(first.name, 1.0) + along * mimic.multiplier
            seconds.add(step.hinge.name)
    gains = {name: gain for name, gain in gains.items() if gain > 0.0}
    return _read(description, gains, seconds, motors, springs) if gains else bodies


def _find_springs(bodies: Bodies) -> dict[str, str]:
    """Of two joints one after the other about one axis, with nothing between them that moves otherwise, the one that
    turns far less: a spring behind a motor, or a motor's play. By name, the other one's.
    """
    found: dict[str, str] = {}
    for steps in bodies.steps_from:
        if len(steps) != 2 or not all(step.hinge.rotary and step.hinge.free for step in steps):
            continue
        # Where both go out from the body, it carries two limbs.
        if steps[0].hinge.bodies[1] == steps[1].hinge.bodies[1] or steps[0].hinge.bodies[0] == steps[1].hinge.bodies[0]:
            continue
        less, more = sorted((step.hinge for step in steps), key=_turn)
        one, other = less.line, more.line
        near = sine(one.axis_3, other.axis_3) < PARALLEL and other.distance(one.point_3) < _ALONG * bodies.size
        if near and _turn(less) < min(_GIVES, _SPRING * _turn(more)) and not less.drives:
            found[less.name] = more.name
    return found


def _turn(hinge: Hinge) -> float:
    """How far a joint turns [rad]; a full turn if nothing limits it."""
    return float((hinge.upper or 0.0) - (hinge.lower or 0.0)) if hinge.limited else FULL_TURN


def _find_motors(bodies: Bodies) -> dict[str, str]:
    """The motors of joints that mimic one: by such a joint, the motor's, which carries nothing, sits on a link beside
    the joint, and reaches nowhere as far as what it drives.
    """
    mimics = {name: joint.mimic.joint for name, joint in bodies.description.joints.items() if joint.mimic is not None}
    counts = collections.Counter(mimics.values())
    steps = {hinge.name: Step(hinge, hinge.bodies[0]) for hinge in bodies.hinges if hinge.rotary}
    found: dict[str, str] = {}
    for name, source in mimics.items():
        if name not in steps or source not in steps or counts[source] > 1 or not steps[source].hinge.free:
            continue
        follower, motor = steps[name], steps[source]
        if motor.start in follower.hinge.bodies and len(bodies.beyond(motor)[1]) == 1:
            further = bodies.beyond(follower)[1] if motor.start == follower.start else ()
            carries = any(hinge.name not in (name, *mimics.values()) for hinge in further)
            if carries or bodies.span(follower) > _MOTOR * bodies.span(motor):
                found[name] = source
    return found


def _read(
    description: Description, gains: Mapping[str, float], fixed: Collection[str] = (),
    motors: Mapping[str, str] | None = None, springs: Mapping[str, str] | None = None,
) -> Bodies:  # fmt: skip
    pose_44, body_of, order = {description.root: np.eye(4)}, {description.root: 0}, [description.root]
    hinges: list[Hinge] = []
    sources, degrees = _sources(description, fixed), in_degrees(description.joints.values())
    for link in order:
        for joint in description.joints_below.get(link, []):
            name, child_44 = joint.name, pose_44[link] @ joint.origin_44
            pose_44[joint.child] = child_44
            order.append(joint.child)
            if joint.kind not in (*ROTARY, "prismatic") or name in description.faults or name in fixed:
                body_of[joint.child] = body_of[link]
                continue
            if stuck(joint, degrees):
                body_of[joint.child] = body_of[link]
                # Its 0 may lie outside its limits.
                pose_44[joint.child] = child_44 @ moved(
                    joint.axis_3, held_angle(joint, None, degrees), not joint.rotary
                )
                continue
            body_of[joint.child] = max(body_of.values()) + 1
            line = Line(child_44[:3, 3], child_44[:3, :3] @ joint.axis_3)
            limits = [_radians(end) if degrees and joint.rotary else end for end in _limits(description, joint)]
            hinges.append(Hinge(
                name, line, joint.rotary, (body_of[link], body_of[joint.child]), limits[0], limits[1],
                joint.mimic is None, name in sources, (link, joint.child), (motors or {}).get(name),
            ))  # fmt: skip
    return Bodies(description, pose_44, body_of, tuple(hinges), degrees, gains, springs or {})


def _limits(description: Description, joint: Joint) -> tuple[float | None, float | None]:
    """Limits of a joint; of a continuous one those that some files give it all the same."""
    # A joint below one whose numbers cannot be read has no place, and is none of the parsed ones.
    parsed = description.parsed.joint_map.get(joint.name)
    given = parsed.limit if joint.kind == "continuous" and parsed is not None else None
    if given is None or given.lower is None or given.upper is None:
        return joint.lower, joint.upper
    return (given.lower, given.upper) if 0.0 < given.upper - given.lower < FULL_TURN else (None, None)


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else math.radians(degrees)


def _sources(description: Description, fixed: Collection[str]) -> set[str]:
    found = set()
    for joint in description.joints.values():
        if joint.mimic is not None and joint.name not in fixed:
            try:
                found.add(drive(description.joints, joint.name).joint)
            except UserError:  # told where it matters
                continue
    return found
