"""Ranges of joints: where a URDF gives no limits, gives degrees, or lets an elbow bend as no human one does."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot.discovery.arm import Arm
from mrhubo.robot.discovery.bodies import Bodies, Chain, Hinge, Step
from mrhubo.robot.discovery.lines import cross
from mrhubo.robot.discovery.motion import bend_side, straight_angle
from mrhubo.robot.discovery.result import FoundRange, Question
from mrhubo.robot.joint import drive

_BENDS = 0.1
"""How far an elbow must bend the other way [rad] for its range to be narrowed."""
_TURN = math.pi
_MOST = 14.0
"""Limits wider than that mean none (`robot.limits`)."""


def find_ranges(
    bodies: Bodies, arms: Mapping[str, Arm], chains: Iterable[Chain], forward_3: np.ndarray
) -> tuple[dict[str, FoundRange], list[Question]]:
    """Ranges by joint where the URDF gives none, or degrees, or lets an elbow bend backwards; and what they leave open.

    Args:
        bodies: the robot.
        arms: by side.
        chains: what moves, arms among it.
        forward_3: where it faces.
    """
    found: dict[str, FoundRange] = {}
    asked: list[Question] = []
    for step in (step for chain in chains for step in chain):
        hinge = driver(bodies, step)
        if hinge is None or not hinge.rotary:
            continue
        if bodies.degrees and hinge.lower is not None and hinge.upper is not None:
            found[hinge.name] = FoundRange(hinge.lower, hinge.upper, "the URDF's limits, which are in degrees")
        if not _limits_meant(hinge.lower, hinge.upper):
            found[hinge.name] = FoundRange(-_TURN, _TURN, "the URDF gives it no limits; a full turn was taken")
    for side, arm in arms.items():
        narrowed, question = _elbow_range(bodies, forward_3, side, arm, found)
        if narrowed is not None:
            found[arm.chain[arm.elbow_at].hinge.name] = narrowed
        if question is not None:
            asked.append(question)
    return found, asked


def _elbow_range(
    bodies: Bodies, forward_3: np.ndarray, side: str, arm: Arm, known: Mapping[str, FoundRange]
) -> tuple[FoundRange | None, Question | None]:
    """The human side of an elbow that bends both ways."""
    step = arm.chain[arm.elbow_at]
    name = step.hinge.name
    if name in known:
        lower, upper = known[name].lower, known[name].upper
    else:
        lower, upper = float(step.hinge.lower or 0.0), float(step.hinge.upper or 0.0)
    axis_3 = step.sign * step.hinge.line.axis_3
    upper_3, fore_3 = arm.elbow.point_3 - arm.shoulder.point_3, arm.wrist.point_3 - arm.elbow.point_3
    straight = straight_angle(axis_3, fore_3, upper_3) / bodies.gains.get(name, 1.0)
    straight = min((straight + turn for turn in (-math.tau, 0.0, math.tau)), key=lambda s: max(lower - s, s - upper))
    if min(straight - lower, upper - straight) < _BENDS:
        return None, None
    share = bend_side(lower, upper, straight)
    above = share > 0
    question = None
    if abs(share) < 0.1:
        moved_3 = cross(axis_3, upper_3)
        ahead = float(moved_3 @ forward_3) / max(float(np.linalg.norm(upper_3)), 1e-9)
        above = ahead > 0
        if abs(ahead) < 0.3:
            text = f"'{name}' bends as far one way as the other, and nothing tells which is a human's; narrow it in "
            question = Question(f"{side}_elbow", f"{text}robot.ranges if the arm bends backwards", (name,))
    ends = (straight, upper) if above else (lower, straight)
    why = f"it bends both ways ({lower:.2f} .. {upper:.2f}), a human elbow one way; straight is at {straight:.2f}"
    return FoundRange(float(ends[0]), float(ends[1]), why), question


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
