"""Necks: chains in the middle above the chest, without what belongs to a face, and without sensors that turn."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from mrhubo.robot.discovery import names
from mrhubo.robot.discovery.bodies import Bodies, Chain, Step, lines_of
from mrhubo.robot.discovery.lines import ON, Line, feet, measure, reflection, sine
from mrhubo.robot.discovery.motion import straight_angle, turned, usual_range
from mrhubo.robot.discovery.symmetry import Pair

_PLANE = 0.03
"""How far from the mirror plane an axis may pass that belongs to neck or waist, as a share of the robot's size."""
_LATERAL = 0.97
"""Cosine of an axis's angle to what runs across the mirror plane, from which on it is its own mirror image."""
_SAME = 0.1
"""How far apart lateral axes of two eyes may pass, as a share of how far an eye is from the middle."""
_MOST, _NAMED_MOST = 4, 6
"""Joints of a neck at most; and of one that names call so, as two balls, of neck and head."""
_LIGHT = 0.25
"""Share of its head's weight that a jaw has at most."""


def in_plane(step: Step, normal_3: np.ndarray, middle_3: np.ndarray, size: float) -> bool:
    """Whether a joint's axis is its own mirror image: across the mirror plane, or in it."""
    return _own_image(step.hinge.line, normal_3, middle_3, size)


def _own_image(line: Line, normal_3: np.ndarray, middle_3: np.ndarray, size: float) -> bool:
    across = abs(float(line.axis_3 @ normal_3))
    if across > _LATERAL:
        return True
    return across < 0.25 and abs(float((line.point_3 - middle_3) @ normal_3)) < _PLANE * size


def find_necks(bodies: Bodies, arms: Pair, used: set[str]) -> tuple[Chain, ...]:
    """The other chains from the chest with axes in the mirror plane, the likeliest neck first."""
    middle_3, reach = arms.mounts_23.mean(0), measure(lines_of(arms.chains[0])).out_N[-1]
    ranked: list[tuple[float, Chain]] = []
    for step in bodies.steps_from[arms.body]:
        if step.hinge.name in used or not step.hinge.rotary or _is_sensor(bodies, step):
            continue
        if any(names.twins(step.hinge.name, other.hinge.name) for other in bodies.steps_from[arms.body]):
            continue  # one of two legs that a file has not alike
        chain: list[Step] = []
        todo, beside = [step], bodies.steps_from[arms.body]
        while todo:
            able = [s for s in todo if s.hinge.rotary and s.hinge.alone]
            fitting = [s for s in able if in_plane(s, arms.normal_3, middle_3, bodies.size)]
            # Of what stands aside at the zero pose each axis is in the plane once those before it are turned.
            if not fitting and len(able) == 1 and aside(bodies, (*chain, able[0]), arms.normal_3, middle_3):
                fitting = able
            twins = [s for s in beside if _has_twin(s, beside, arms.normal_3, middle_3, ON * bodies.size)]
            fitting = [s for s in fitting if not _is_sensor(bodies, s) and s not in twins]
            paired = bool(twins)
            fitting = [s for s in fitting if not (chain and _in_face(bodies, s, paired))]
            fitting.sort(key=lambda s: (-len(bodies.beyond(s)[0]), -bodies.extent(s), s.hinge.name))
            if not fitting or len(chain) >= (_NAMED_MOST if is_named((*chain, *fitting[:1])) else _MOST):
                break
            chain.append(fitting[0])
            todo = beside = bodies.onward(fitting[0])
        if not chain:
            continue
        called = [name for s in chain for name in (s.outer_link, s.hinge.name)]
        named = float(names.share(called, "head") > 0) - float(names.share(called, "waist") > 0)
        # A neck begins near the shoulders; a waist upside down, below a root that is the chest, does not.
        start_3 = measure(lines_of(tuple(chain))).nodes_N3[0]
        away = min(chain[0].hinge.line.distance(middle_3), float(np.linalg.norm(start_3 - middle_3)))
        ranked.append((named + 0.5 * min(len(chain), 2) - away / reach, tuple(chain)))
    ranked.sort(key=lambda found: -found[0])
    return tuple(chain for _, chain in ranked)


def aside(bodies: Bodies, chain: Chain, normal_3: np.ndarray, middle_3: np.ndarray) -> list[tuple[Line, float]] | None:
    """By what angles [rad] the joints of a chain turn, about which axes at the zero pose, until each axis after them is
    in the mirror plane or across it: 0 where the zero pose does that. None if no angles do, or only those beyond a
    joint's limits.

    Args:
        bodies: the robot.
        chain: a neck's joints, or a waist's, from the chest.
        normal_3: across the mirror plane.
        middle_3: a point of it.
    """
    turns: list[tuple[Line, float]] = []
    for step, after in itertools.pairwise(chain):
        line = _placed(after.hinge.line, turns)
        if _own_image(line, normal_3, middle_3, bodies.size):
            turns.append((step.hinge.line, 0.0))
            continue
        about_3 = _placed(step.hinge.line, turns).axis_3
        across = straight_angle(about_3, line.axis_3, normal_3)
        lower, upper = sorted(step.sign * end for end in usual_range(step.hinge))
        angles = [across + k * math.pi / 2 for k in range(-3, 4)]
        able = sorted((angle for angle in angles if lower <= angle <= upper), key=abs)
        for angle in able:
            placed = _placed(after.hinge.line, [*turns, (step.hinge.line, angle)])
            if _own_image(placed, normal_3, middle_3, bodies.size):
                turns.append((step.hinge.line, angle))
                break
        else:
            return None
    return turns


def turned_back(vector_3: np.ndarray, turns: Sequence[tuple[Line, float]]) -> np.ndarray:
    """Where a direction (3,) of the last body stands at the zero pose that it has once `turns` are made."""
    for about, angle in turns:
        vector_3 = turned(vector_3, about.axis_3, -angle)
    return vector_3


def _placed(line: Line, turns: Sequence[tuple[Line, float]]) -> Line:
    """A line once the joints before it are turned, each by an angle about its own line at the zero pose."""
    point_3, axis_3 = line.point_3, line.axis_3
    for about, angle in reversed(turns):
        point_3 = about.point_3 + turned(point_3 - about.point_3, about.axis_3, angle)
        axis_3 = turned(axis_3, about.axis_3, angle)
    return Line(point_3, axis_3)


def is_named(neck: Chain, kind: str = "head") -> bool:
    """Whether names say that a chain is a neck, or a `waist`."""
    return any(names.speaks_of(name, kind) for step in neck for name in (step.hinge.name, step.outer_link))


def _has_twin(step: Step, others: Sequence[Step], normal_3: np.ndarray, middle_3: np.ndarray, least: float) -> bool:
    """Whether another joint is the mirror image, better than a joint is its own: an eye, an ear. None is of one that
    lies nearer to the middle than `least` [m].
    """
    line = step.hinge.line
    flip_33 = reflection(normal_3)
    image = Line(middle_3 + flip_33 @ (line.point_3 - middle_3), flip_33 @ line.axis_3)

    def miss(other: Line) -> float:
        one_3, other_3 = feet(image, other)
        return float(np.linalg.norm(one_3 - other_3)) + float(np.linalg.norm(image.point_3 - line.point_3)) * sine(
            image.axis_3, other.axis_3
        )

    own = abs(float((line.point_3 - middle_3) @ normal_3))
    # A lateral axis is its own mirror image wherever its frame lies: a twin's is the same one, as well as measured.
    near = max(least, _SAME * own) if abs(float(line.axis_3 @ normal_3)) > _LATERAL else 0.5 * own
    return own > least and any(other is not step and miss(other.hinge.line) < near for other in others)


def _in_face(bodies: Bodies, step: Step, paired: bool) -> bool:
    """Whether a joint above a neck's is one of the face, as a jaw's or an eye's, or of a linkage: by its name, or as a
    single one beside pairs, or as one that carries nothing, or little of the head's weight.
    """
    if _is_face(step):
        return True
    inside, hinges = bodies.beyond(step)
    if len(hinges) == 1 and (paired or (bodies.bare(step.end) and not bodies.bare(step.start))):
        return True
    weights = [sum(map(bodies.weight, part)) for part in (inside, {step.start})]
    return 0 < weights[0] < _LIGHT * weights[1]


def _is_face(step: Step) -> bool:
    """Whether a joint's name, or its link's, is that of a part of a face."""
    return any(names.speaks_of(name, "face") for name in (step.hinge.name, step.outer_link))


def _is_sensor(bodies: Bodies, step: Step) -> bool:
    """A joint without limits above a chest turns a lidar, not a head, if the file gives limits at all; but for one that
    is called so, or carries another joint.
    """
    called = (step.hinge.name, step.outer_link)
    if any(names.speaks_of(name, "sensor") for name in called):
        return True
    if any(names.speaks_of(name, "head") for name in called) or len(bodies.beyond(step)[1]) > 1:
        return False
    limited = any(hinge.limited for hinge in bodies.hinges if hinge.rotary)
    return limited and not step.hinge.limited and step.hinge.lower is None
