"""Vectors and rotations as tuples of floats: for one frame at a time they take a tenth of what NumPy takes.

A rotation is the tuple of its three columns.
"""

from __future__ import annotations

import math

Vector = tuple[float, float, float]
Rotation = tuple[Vector, Vector, Vector]

IDENTITY: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def plus(a: Vector, b: Vector, factor: float = 1.0) -> Vector:
    """a + factor * b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def norm(a: Vector) -> float:
    """The length."""
    return math.sqrt(dot(a, a))


def unit(a: Vector) -> Vector:
    """Of length 1; nothing of nothing."""
    length = norm(a)
    return (a[0] / length, a[1] / length, a[2] / length) if length > 1e-12 else (0.0, 0.0, 0.0)


def across(a: Vector, b: Vector) -> Vector:
    """The part of a at right angles to the unit vector b."""
    return plus(a, b, -dot(a, b))


def mean(points: list[Vector]) -> Vector:
    """Of some points."""
    count = len(points)
    x, y, z = (sum(axis) / count for axis in zip(*points, strict=True))
    return x, y, z


def apply(r: Rotation, a: Vector) -> Vector:
    """R a."""
    x, y, z = a
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = r
    return ax * x + bx * y + cx * z, ay * x + by * y + cy * z, az * x + bz * y + cz * z


def undo(r: Rotation, a: Vector) -> Vector:
    """R^T a."""
    return dot(r[0], a), dot(r[1], a), dot(r[2], a)


def chained(r: Rotation, s: Rotation) -> Rotation:
    """R S."""
    return apply(r, s[0]), apply(r, s[1]), apply(r, s[2])


def relative(r: Rotation, s: Rotation) -> Rotation:
    """R^T S."""
    return undo(r, s[0]), undo(r, s[1]), undo(r, s[2])


def transposed(r: Rotation) -> Rotation:
    """R^T."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = r
    return (ax, bx, cx), (ay, by, cy), (az, bz, cz)


def about(axis: Vector, angle: float) -> Rotation:
    """A turn [rad] about a unit vector, by Rodrigues' formula."""
    (x, y, z), s, c = axis, math.sin(angle), math.cos(angle)
    t = 1.0 - c
    return (
        (c + t * x * x, t * x * y + s * z, t * x * z - s * y),
        (t * x * y - s * z, c + t * y * y, t * y * z + s * x),
        (t * x * z + s * y, t * y * z - s * x, c + t * z * z),
    )


def shortest(a: Vector, b: Vector) -> Rotation:
    """The smallest turn from one unit vector to another; none where they are opposite, as no axis is told."""
    axis = cross(a, b)
    sine = norm(axis)
    return IDENTITY if sine < 1e-9 else about(unit(axis), math.atan2(sine, dot(a, b)))


def part_of(r: Rotation, share: float) -> Rotation:
    """The same turn, a share of its angle."""
    (_, ay, az), (bx, _, bz), (cx, cy, _) = r
    axis = (bz - cy, cx - az, ay - bx)
    twice_sine, twice_cosine = norm(axis), r[0][0] + r[1][1] + r[2][2] - 1.0
    if twice_sine > 1e-9:
        return about(unit(axis), share * math.atan2(twice_sine, twice_cosine))
    if twice_cosine > 0:
        return IDENTITY
    diagonal = [r[i][i] for i in range(3)]  # half a turn: R + I = 2 a a^T
    longest = r[diagonal.index(max(diagonal))]
    return about(unit(plus(longest, IDENTITY[diagonal.index(max(diagonal))])), share * math.pi)
