"""Where limbs end beyond their last joints: by fingers, fixed links, shapes or masses, as no axis tells it there."""

from __future__ import annotations

import math

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies, Chain, Step, lines_of
from mrhubo.robot.discovery.limbs import ways_on
from mrhubo.robot.discovery.lines import ON, measure, unit
from mrhubo.robot.discovery.names import speaks_of

OUT = 1 / 3
"""How long a forearm is at least, as a share of the upper arm."""
_LONG = 1.5
"""How long a shin is at most, as a share of its thigh: 0.8 to 1.2 on public humanoids."""
_TELLS = 0.1
"""How far out a centre of mass is that tells where a limb ends, as a share of the limb before it."""
_WRIST = 3
"""Joints of a wrist at most."""
_ROLLS = 0.02
"""How far along its axis a hand reaches at least that rolls, as a share of the robot's size."""


def long_branches(bodies: Bodies, chain: Chain, share: float) -> str:
    """What is to be said of a limb that ends in branches longer than a share of it, one of which may be its rest, while
    another is a linkage; nothing if none is as long.
    """
    way = float(measure(lines_of(chain)).out_N[-1])
    onward = ways_on(bodies, chain[-1])
    if not any(bodies.extent(on) > share * way for on in onward):
        return ""
    among = " and ".join(f"'{on.hinge.name}'" for on in onward)
    return f"; the limb was taken to end where {among} begin, one of which may go on with it"


def limb_end(
    bodies: Bodies, last: Step, start_3: np.ndarray, usual_3: np.ndarray, called: str = "wrist", hinged: bool = False
) -> tuple[np.ndarray, str, float]:
    """The end of a limb beyond its last joint (3,), how it was told, and how sure that is.

    Args:
        bodies: the robot.
        last: the last joint.
        start_3: where the limb starts.
        usual_3: where it should end about, as seen from its start (3,) [m]: as the limb before it goes on.
        called: what the end is called.
        hinged: whether the last joint is the hinge that bends the limb.
    """
    inside, onward, usual = bodies.links_of[last.end], bodies.onward(last), float(np.linalg.norm(usual_3))
    if called == "wrist" and (held := _held_wrist(bodies, last, start_3, OUT * usual)) is not None:
        return held
    if len(onward) > 1:  # where a single finger begins is no middle
        bases = [bodies.position(on.outer_link) for on in onward]
        if float(np.linalg.norm(np.mean(bases, axis=0) - start_3)) > OUT * usual:
            return np.mean(bases, axis=0), "the middle of where the fingers begin", 0.45
    named = [
        link
        for link in inside
        if speaks_of(link, "tool") and np.linalg.norm(bodies.position(link) - start_3) > OUT * usual
    ]
    if named:
        nearest = min(named, key=lambda link: float(np.linalg.norm(bodies.position(link) - start_3)))
        return bodies.position(nearest), f"the fixed link '{nearest}', after its name", 0.6
    if bodies.shapes_of[last.end]:
        corners = bodies.corners(last.end)
        out_3 = unit(corners.mean(0) - start_3)
        reach = float(((corners - start_3) @ out_3).max())
        if reach > OUT * usual:
            return (
                start_3 + reach * out_3,
                f"the end of the limb's collision shape, as no joint tells the {called}",
                0.45,
            )
    # The joint's own origin lies on its axis, wherever along it a file puts it, and says nothing.
    fixed = {link: math.dist(bodies.position(link), start_3) for link in inside if link != last.outer_link}
    far = max(fixed, key=lambda link: fixed[link], default=None)
    if far is not None and fixed[far] > OUT * usual:
        return bodies.position(far), f"the farthest fixed link '{far}', as no joint tells the {called}", 0.45
    centre_3 = bodies.centre(last.end)
    away = 0.0 if centre_3 is None else float(np.linalg.norm(centre_3 - start_3))
    if centre_3 is not None and called == "ankle" and 2 * away > _LONG * usual:
        # A heavy foot, or one alone, has its centre there; a shin is about as long as its thigh.
        way_3 = unit(unit(centre_3 - start_3) + unit(usual_3))
        return start_3 + usual * way_3, "as far as the thigh is long, as no joint tells the ankle", 0.4
    # Along the hinge that bends it lies no limb.
    out = away if centre_3 is None or not hinged else last.hinge.line.distance(centre_3)
    if centre_3 is not None and min(away, out) > _TELLS * usual:
        return (
            start_3 + 2 * (centre_3 - start_3),
            f"twice as far as the centre of mass, as no joint tells the {called}",
            0.4,
        )
    return (
        start_3 + usual_3,
        f"a guess: as long as the limb before it, and straight, as nothing tells the {called}",
        0.1,
    )


def _held_wrist(bodies: Bodies, last: Step, start_3: np.ndarray, least: float) -> tuple[np.ndarray, str, float] | None:
    """The middle one of two or three fixed joints whose names are those of a wrist, as where its motors are locked."""
    joints = bodies.description.parent_joint
    wrist = [
        joints[link] for link in bodies.links_of[last.end]
        if link in joints and link != last.outer_link and speaks_of(joints[link].name, "wrist")
        and float(np.linalg.norm(bodies.position(link) - start_3)) > least
    ]  # fmt: skip
    if not 1 < len(wrist) <= _WRIST:
        return None
    wrist.sort(key=lambda joint: float(np.linalg.norm(bodies.position(joint.child) - start_3)))
    middle = wrist[len(wrist) // 2]
    return bodies.position(middle.child), f"where '{middle.name}' is, a wrist's joint that does not move", 0.6


def carried_along(bodies: Bodies, last: Step, start_3: np.ndarray) -> np.ndarray | None:
    """In which direction of a joint's axis all lies that it carries (3,), as a hand does on a wrist that rolls; None if
    some lies beside it, as a finger does beside the axis of its jaw, or nothing tells.
    """
    line = last.hinge.line
    points = np.concatenate([bodies.corners(body) for body in bodies.beyond(last)[0]])
    # The joint's own origin lies on its axis, wherever along it a file puts it, and says nothing.
    points = points[np.linalg.norm(points - bodies.position(last.outer_link), axis=-1) > ON * bodies.size]
    if not len(points):
        return None
    out_N3 = points - line.nearest(start_3)
    along_N = out_N3 @ line.axis_3
    beside = float(np.linalg.norm(out_N3 - np.outer(along_N, line.axis_3), axis=-1).mean())
    along = float(along_N.mean())
    return line.axis_3 * np.sign(along) if abs(along) > max(_ROLLS * bodies.size, 2 * beside) else None
