"""As `mrhubo.fast.plain.soles`, for one frame."""

from __future__ import annotations

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.human import add, cross, dot, put, row, turn
from mrhubo.fast.compiled.lanes import some
from mrhubo.fast.compiled.tables import (
    AXES_33,
    BLOCK_H,
    BODY_H,
    CARRIER_1,
    COLUMN_A,
    FIRST_C,
    INNER,
    ORDER_N,
    PARENT_A,
    POINT_H3,
    RATIO_A,
    ROOT_3,
    ROTARY_A,
    real,
    size,
    vector,
    whole,
)


@njit(**INNER)
def turned_point(work, body, point):
    """A body's point [m], base frame, where the robot is placed."""
    return add(turn(work.rotation_L33, body, point), row(work.position_L3, body), 1.0)


@njit(**INNER)
def carrier(t, work):
    """The place [m] of the root, base frame; the human axes of what carries the legs stand in `work.carrier_133`."""
    body = whole(t, CARRIER_1, 0)
    for i in range(3):
        for j in range(3):
            work.carrier_133[0, i, j] = (
                work.rotation_L33[body, i, 0] * real(t, AXES_33, j)
                + work.rotation_L33[body, i, 1] * real(t, AXES_33, 3 + j)
                + work.rotation_L33[body, i, 2] * real(t, AXES_33, 6 + j)
            )
    return turned_point(work, body, vector(t, ROOT_3, 0))


@njit(**INNER)
def add_soles(t, work, cost_C, gradient_N, hessian_NN):
    """Adds what places of soles cost, where the robot is placed, to a model."""
    root = carrier(t, work)
    for h in range(size(t, BODY_H)):
        c, weight = whole(t, BLOCK_H, h), max(work.counts_H[h], 0.0)
        if c < 0 or not some(weight > 0):
            continue
        point = turned_point(work, whole(t, BODY_H, h), vector(t, POINT_H3, h))
        goal = add(turn(work.carrier_133, 0, row(work.wanted_H3, h)), root, 1.0)
        miss = add(point, goal, -1.0)
        cost_C[c] += weight * dot(miss, miss)
        first, last = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
        for x in range(first, last):
            put(work.sole_N3, whole(t, ORDER_N, x), (0.0, 0.0, 0.0))
        _turn_point(t, work, whole(t, BODY_H, h), point, 1.0)
        _turn_point(t, work, whole(t, CARRIER_1, 0), point, -1.0)
        for x in range(first, last):
            n = whole(t, ORDER_N, x)
            own = row(work.sole_N3, n)
            own = (weight * own[0], weight * own[1], weight * own[2])
            gradient_N[n] += dot(own, miss)
            for y in range(first, x + 1):
                m = whole(t, ORDER_N, y)
                hessian_NN[n, m] += dot(own, row(work.sole_N3, m))


@njit(**INNER)
def _turn_point(t, work, body, point, sign):
    """Adds to `work.sole_N3` how the joints above a body move a point [m/rad]."""
    while body > 0:
        a = body - 1
        axis = row(work.axis_A3, a)
        moved = axis
        if whole(t, ROTARY_A, a):
            moved = cross(axis, add(point, row(work.position_L3, body), -1.0))
        n = whole(t, COLUMN_A, a)
        put(work.sole_N3, n, add(row(work.sole_N3, n), moved, sign * real(t, RATIO_A, a)))
        body = whole(t, PARENT_A, a)
