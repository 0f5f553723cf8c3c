"""Bases that move: joints by which a file lets a robot drive over the ground, or float, and which no waist is."""

from __future__ import annotations

import itertools

import numpy as np

from mrhubo.robot.discovery.bodies import Chain
from mrhubo.robot.discovery.lines import ON, Line, feet, sine

_SQUARE = 0.9
"""Sine over which directions count as different."""
_FLOATING = 6
"""Joints of a base that floats: three that slide, and three that turn."""


def without_base(trunk: Chain, size: float) -> Chain:
    """The joints from the root to the chest without those of a base: six that let it float, or two that slide in
    different directions, as no lift does, with the one beside them that turns it over the ground.

    Args:
        trunk: the joints from the root to the chest.
        size: of the robot [m].
    """
    slides = [i for i, step in enumerate(trunk) if not step.hinge.rotary]
    if _floats(trunk[:_FLOATING], size):
        return trunk[_FLOATING:]
    if len(slides) < 2 or sine(*(trunk[i].hinge.line.axis_3 for i in slides[:2])) < _SQUARE:
        return trunk
    end = slides[1] + 1
    sliding = [trunk[i].hinge.line for i in slides[:2]]
    if end == 2 < len(trunk) and trunk[end].hinge.rotary and _square([*sliding, trunk[end].hinge.line]):
        end += 1
    return trunk[end:]


def _floats(base: Chain, size: float) -> bool:
    """Whether three of six joints slide in different directions, and three turn about axes that meet in a point."""
    lines: dict[bool, list[Line]] = {True: [], False: []}
    for step in base:
        lines[step.hinge.rotary].append(step.hinge.line)
    return (
        len(lines[True]) == len(lines[False]) == _FLOATING / 2
        and all(map(_square, lines.values()))
        and all(_apart(*pair) < ON * size for pair in itertools.combinations(lines[True], 2))
    )


def _apart(one: Line, other: Line) -> float:
    return float(np.linalg.norm(np.subtract(*feet(one, other))))


def _square(lines: list[Line]) -> bool:
    return all(sine(one.axis_3, other.axis_3) > _SQUARE for one, other in itertools.combinations(lines, 2))
