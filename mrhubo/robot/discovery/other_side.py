"""Limits that were copied from one side of a robot to the other, and not mirrored with the axis."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from mrhubo.robot.discovery.bodies import Chain, Hinge, Step, lines_of
from mrhubo.robot.discovery.lines import reflection

_SAME = 0.05
"""How far ends of two ranges may be apart that are meant to be the same [rad]."""
_LOPSIDED = 0.2
"""How much farther one way than the other a joint turns whose range has a side [rad]."""
_ALONG, _NEAR = 0.99, 0.03
"""Cosine of how far an axis may be from the other side's mirror image, and how far its line, as a share of the limb."""


def copied_limits(pairs: Sequence[tuple[Chain, Chain]], normal_3: np.ndarray) -> Iterator[tuple[str, str]]:
    """Joints of two sides whose ranges are the mirror image of what the mirrored axes ask for, where most others of
    their limbs are as these ask: of two limbs that are one product, mounted twice, none is.

    Args:
        pairs: limbs of the left side and of the right one.
        normal_3: unit, across the mirror plane.
    """
    for left, right in pairs:
        told = [(one.hinge, other.hinge, sign) for one, other, sign in _mirrored(left, right, normal_3)]
        sided = [(one, other, sign) for one, other, sign in told if _has_side(one) and _has_side(other)]
        wrong = [(one, other) for one, other, sign in sided if _same(one, other, -sign)]
        right_ones = sum(_same(one, other, sign) for one, other, sign in sided)
        if right_ones > len(wrong):
            yield from ((one.name, other.name) for one, other in wrong)


def _mirrored(left: Chain, right: Chain, normal_3: np.ndarray) -> Iterator[tuple[Step, Step, float]]:
    """Joints of two limbs whose axes are mirror images as the robot stands, from the body as far as all are; with 1
    where the same angle is the mirrored motion, and -1 where its negative is.
    """
    if not left or not right:
        return
    mirror_33 = reflection(normal_3)
    ones, others = lines_of(left), lines_of(right)
    middle_3 = 0.5 * (ones[0].point_3 + others[0].point_3)
    size = max(float(np.linalg.norm(a.point_3 - b.point_3)) for a, b in itertools.combinations((*ones, *others), 2))
    for step, other, line, there in zip(left, right, ones, others, strict=False):
        # A turn is an axial vector: mirrored, it turns the other way about the mirrored axis.
        along = -float((mirror_33 @ (step.sign * line.axis_3)) @ (other.sign * there.axis_3))
        place_3 = middle_3 + mirror_33 @ (line.point_3 - middle_3)
        if abs(along) < _ALONG or there.distance(place_3) > _NEAR * size:
            return
        yield step, other, float(np.sign(along))


def _has_side(hinge: Hinge) -> bool:
    return hinge.rotary and hinge.limited and abs(float(hinge.lower or 0.0) + float(hinge.upper or 0.0)) > _LOPSIDED


def _same(one: Hinge, other: Hinge, sign: float) -> bool:
    """Whether two joints have the same range, or with -1 the same the other way round."""
    ends = sorted(sign * float(end or 0.0) for end in (one.lower, one.upper))
    return bool(np.abs(np.subtract(ends, [other.lower or 0.0, other.upper or 0.0])).max() < _SAME)
