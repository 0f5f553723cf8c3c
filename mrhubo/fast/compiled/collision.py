"""As `mrhubo.fast.plain.collision`, for one frame, or for several side by side (`mrhubo.fast.compiled.lanes`)."""

from __future__ import annotations

import math

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.human import add, cross, dot, put, row, turn
from mrhubo.fast.compiled.lanes import alike, choose, no, some
from mrhubo.fast.compiled.tables import (
    BALL_Z,
    BODY_G,
    BODY_S,
    CAPSULE_Z,
    CENTRE_G3,
    CLEAR_Y,
    COLUMN_A,
    END_S23,
    FIRST_Z,
    INNER,
    PAIR_Y2,
    PARENT_A,
    RADIUS_S,
    RATIO_A,
    REACH_S,
    REACH_Z,
    ROTARY_A,
    real,
    size,
    vector,
    whole,
)
from mrhubo.fast.plain.collision import PARALLEL, SHORT


@njit(**INNER)
def place_capsules(t, work):
    """Ends and middles of capsules, and middles of balls, where the robot is placed."""
    ends_S3, count = work.ends_S3, size(t, BODY_S)
    for s in range(count):
        body = whole(t, BODY_S, s)
        origin = row(work.position_L3, body)
        one = add(turn(work.rotation_L33, body, vector(t, END_S23, 2 * s)), origin, 1.0)
        two = add(turn(work.rotation_L33, body, vector(t, END_S23, 2 * s + 1)), origin, 1.0)
        put(ends_S3, 2 * s, one)
        put(ends_S3, 2 * s + 1, two)
        put(ends_S3, 2 * count + s, add(one, two, 1.0))
    for g in range(size(t, BODY_G)):
        body = whole(t, BODY_G, g)
        put(
            work.centre_G3,
            g,
            add(turn(work.rotation_L33, body, vector(t, CENTRE_G3, g)), row(work.position_L3, body), 1.0),
        )


@njit(**INNER)
def far(t, work, z, more):
    """Whether no pair of a group can be nearer than its clearance and so much more [m], nor overlap, where capsules are
    placed.
    """
    middle, g = 2 * size(t, BODY_S) + whole(t, CAPSULE_Z, z), whole(t, BALL_Z, z)
    between, reach = add(row(work.ends_S3, middle), row(work.centre_G3, g), -2.0), 2 * (real(t, REACH_Z, z) + more)
    return not some(dot(between, between) < reach * reach)


@njit(**INNER)
def far_apart(t, work, y, margin):
    """Whether a pair of placed capsules is certainly further apart than a margin [m]."""
    first = 2 * size(t, BODY_S)
    i, j = whole(t, PAIR_Y2, 2 * y), whole(t, PAIR_Y2, 2 * y + 1)
    between = add(row(work.ends_S3, first + i), row(work.ends_S3, first + j), -1.0)
    reach = 2 * (real(t, REACH_S, i) + real(t, REACH_S, j) + max(margin, 0.0))
    return not some(dot(between, between) < reach * reach)


@njit(**INNER)
def apart(t, work, y):
    """Of a pair of placed capsules: signed distance [m], point on the first one's axis, and what leads there from the
    second's.
    """
    i, j = whole(t, PAIR_Y2, 2 * y), whole(t, PAIR_Y2, 2 * y + 1)
    point, between = _closest(work.ends_S3, 2 * i, 2 * j)
    return math.sqrt(dot(between, between)) - real(t, RADIUS_S, i) - real(t, RADIUS_S, j), point, between


@njit(**INNER)
def _closest(ends_S3, i, j):
    """Of two segments, whose first ends these are: the nearest point of the first, and what leads there."""
    start_a, start_b = row(ends_S3, i), row(ends_S3, j)
    along_a, along_b = add(row(ends_S3, i + 1), start_a, -1.0), add(row(ends_S3, j + 1), start_b, -1.0)
    r = add(start_a, start_b, -1.0)
    a, e, b, c, f = (
        dot(along_a, along_a),
        dot(along_b, along_b),
        dot(along_a, along_b),
        dot(along_a, r),
        dot(along_b, r),
    )
    safe_a, safe_e = max(a, SHORT), max(e, SHORT)
    determinant = a * e - b * b
    s = choose(determinant > PARALLEL * a * e, (b * f - c * e) / max(determinant, SHORT * SHORT), 0.0)
    u = min(max((b * min(max(s, 0.0), 1.0) + f) / safe_e, 0.0), 1.0)
    s = min(max((b * u - c) / safe_a, 0.0), 1.0)
    u = min(max((b * s + f) / safe_e, 0.0), 1.0)
    return add(start_a, along_a, s), add(add(r, along_a, s), along_b, 0.0 - u)


@njit(**INNER)
def touches(t, work, clear):
    """Whether any pair of capsules overlaps, or, if `clear` is true, is nearer than its clearance; where the robot is
    placed.
    """
    place_capsules(t, work)
    found = alike(work.lower_N[0], 0.0) > 0
    for z in range(size(t, BALL_Z)):
        if far(t, work, z, 0.0):
            continue
        for y in range(whole(t, FIRST_Z, z), whole(t, FIRST_Z, z + 1)):
            margin = real(t, CLEAR_Y, y) if clear else 0.0
            if far_apart(t, work, y, margin):
                continue
            found = found | (apart(t, work, y)[0] < margin)
            if not some(no(found)):
                return found
    return found


@njit(**INNER)
def distance_gradient(t, work, y, point, normal):
    """How a pair's distance changes with joints [m/rad], into `work.contact_N`."""
    for n in range(len(work.contact_N)):
        work.contact_N[n] = 0.0
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        body = whole(t, BODY_S, whole(t, PAIR_Y2, 2 * y + side))
        while body > 0:
            axis = row(work.axis_A3, body - 1)
            moved = axis
            if whole(t, ROTARY_A, body - 1):
                moved = cross(axis, add(point, row(work.position_L3, body), -1.0))
            work.contact_N[whole(t, COLUMN_A, body - 1)] += sign * real(t, RATIO_A, body - 1) * dot(normal, moved)
            body = whole(t, PARENT_A, body - 1)
