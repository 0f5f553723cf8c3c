"""Limbs: chains of joints from a body outwards, past linkages, motors and jaws, to where they end or branch."""

from __future__ import annotations

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies, Chain, Step, key_of
from mrhubo.robot.discovery.lines import ON, PARALLEL, feet, sine
from mrhubo.robot.discovery.names import speaks_of

_DOMINANT = 2.5
"""How many times longer than any other branch the one must be in which a limb goes on; else it ends, as a hand."""
_NO_FARTHER = 1.1
"""How much farther out than the joint that it drives a linkage may begin."""
_BALL = 3
"""Axes of a ball joint."""


def limb(bodies: Bodies, step: Step) -> Chain:
    """The limb that begins with a joint: outwards until it ends, or branches into what is alike (fingers)."""
    found: dict[tuple[int, str], Step] = {}
    on: Step | None = step
    while on is not None and key_of(on) not in found:
        found[key_of(on)] = on
        on = _next(bodies, on)
    return tuple(found.values())


def _next(bodies: Bodies, step: Step) -> Step | None:
    """The joint with which a limb goes on; None where it ends or branches."""
    key = key_of(step)
    if key not in bodies.nexts:
        onward = ways_on(bodies, step)
        reach = {on.hinge.name: _reach(bodies, step, on) for on in onward}
        onward.sort(key=lambda on: (-reach[on.hinge.name], on.hinge.name))
        alike = [on for on in onward[1:] if _DOMINANT * reach[on.hinge.name] > reach[onward[0].hinge.name]]
        bodies.nexts[key] = onward[0] if onward and not alike else None
    return bodies.nexts[key]


def ways_on(bodies: Bodies, step: Step) -> list[Step]:
    """The joints at the body that a joint leads to with which a limb may go on: no linkages, no sliding jaws, and
    nothing that weighs nothing beside what weighs something, as a leg's linkage that is drawn beside its model.
    """
    onward = bodies.onward(step)
    heavy = [on for on in onward if bodies.beyond(on)[0] & bodies.weighty]
    onward = heavy or onward
    motors = _motors(bodies, onward)
    onward = [on for on in onward if on not in motors and (on in motors.values() or not _idle(bodies, on))]
    return [on for on in onward if not any(_drives(bodies, on, other, step) for other in onward if other is not on)]


def _motors(bodies: Bodies, onward: list[Step]) -> dict[Step, Step]:
    """Of joints at one body, the motors that carry nothing, each with the limb that mimics it."""
    found: dict[Step, Step] = {}
    driven = [joint.mimic.joint for joint in bodies.description.joints.values() if joint.mimic is not None]
    for on in onward:
        mimic = bodies.description.joints[on.hinge.name].mimic
        motor = next((other for other in onward if mimic is not None and other.hinge.name == mimic.joint), None)
        if (
            motor is not None
            and driven.count(motor.hinge.name) == 1
            and _idle(bodies, on)
            and bodies.span(on) > _DOMINANT * bodies.span(motor)
        ):
            found[motor] = on
    return found


def _drives(bodies: Bodies, rod: Step, other: Step, before: Step) -> bool:
    """Whether a branch looks like a linkage that drives another one, from a loop that a URDF has to cut: it moves
    in the plane in which that one's joint turns, and begins no farther out, while that one goes on in other planes
    too, as a forearm or a foot does. Fingers begin farther out than a thumb. Names betray it as well.
    """
    if not other.hinge.rotary:
        return False
    if _is_ball_rod(bodies, rod):
        return not _is_ball_rod(bodies, other)
    if all(speaks_of(hinge.name, "rod") or speaks_of(hinge.links[1], "rod") for hinge in bodies.beyond(rod)[1]):
        return not any(speaks_of(hinge.links[1], "rod") for hinge in bodies.beyond(other)[1])
    axis_3, start_3 = other.hinge.line.axis_3, before.hinge.line.point_3
    far = [float(np.linalg.norm(step.hinge.line.point_3 - start_3)) for step in (rod, other)]
    return far[0] < _NO_FARTHER * far[1] and _in_plane(bodies, rod, axis_3) and not _in_plane(bodies, other, axis_3)


def _is_ball_rod(bodies: Bodies, step: Step) -> bool:
    """Whether a branch is one chain, of a crank at most, and then a ball joint that nothing limits: a rod whose far end
    a loop held.
    """
    chain, on = [step], bodies.onward(step)
    while len(on) == 1 and len(chain) <= _BALL + 1:
        chain, on = [*chain, on[0]], bodies.onward(on[0])
    if on or len(chain) not in (_BALL, _BALL + 1) or any(not last.hinge.rotary for last in chain):
        return False
    ball = [last.hinge for last in chain[-_BALL:]]
    middle_3 = feet(ball[0].line, ball[1].line)[0]
    far = max(hinge.line.distance(middle_3) for hinge in ball)
    return not any(hinge.limited for hinge in ball) and far < ON * bodies.size


def _in_plane(bodies: Bodies, step: Step, axis_3: np.ndarray) -> bool:
    """Whether all joints of a branch turn about a direction, or slide across it."""
    hinges = bodies.beyond(step)[1]
    return all(
        sine(hinge.line.axis_3, axis_3) < PARALLEL
        if hinge.rotary
        else abs(float(hinge.line.axis_3 @ axis_3)) < PARALLEL
        for hinge in hinges
    )


def _reach(bodies: Bodies, last: Step, on: Step) -> float:
    return bodies.extent(on) + float(np.linalg.norm(bodies.position(on.outer_link) - bodies.position(last.outer_link)))


def _idle(bodies: Bodies, step: Step) -> bool:
    """Whether a branch has no rotary joint driven by itself: a linkage, mimicking fingers, a sliding jaw."""
    return not any(hinge.alone and hinge.rotary for hinge in bodies.beyond(step)[1])
