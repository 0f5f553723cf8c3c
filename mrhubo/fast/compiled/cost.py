"""What a frame costs, as `mrhubo.fast.plain.steps` has it, for one frame."""

from __future__ import annotations

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.human import add, dot, row, row3, turn
from mrhubo.fast.compiled.lanes import alike
from mrhubo.fast.compiled.robot import jacobian, place
from mrhubo.fast.compiled.soles import add_soles
from mrhubo.fast.compiled.tables import (
    BODY_H,
    FIRST_C,
    FIRST_D,
    INNER,
    MIDDLE_N,
    ORDER_D,
    ORDER_N,
    RIDGE_N,
    SEEN_D,
    real,
    size,
    whole,
)


@njit(**INNER)
def quadratic(t, work, q_N, cost_C, gradient_N, hessian_NN):
    """Cost and Gauss-Newton model at joint angles, for the goal in `work`."""
    place(t, work, q_N)
    jacobian(t, work)
    for c in range(len(cost_C)):
        first, last = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
        found = alike(cost_C[0], 0.0)
        for x in range(first, last):
            n = whole(t, ORDER_N, x)
            off = q_N[n] - real(t, MIDDLE_N, n)
            found += real(t, RIDGE_N, n) * off * off
            gradient_N[n] = real(t, RIDGE_N, n) * off
            for y in range(first, x + 1):
                hessian_NN[n, whole(t, ORDER_N, y)] = 0.0
            hessian_NN[n, n] = real(t, RIDGE_N, n)
        for r in range(whole(t, FIRST_D, c), whole(t, FIRST_D, c + 1)):
            d = whole(t, ORDER_D, r)
            goal = turn(work.view_V33, whole(t, SEEN_D, d), row(work.goal_D3, d))
            miss = add(row(work.direction_D3, d), goal, -1.0)
            weight = work.weight_D[d]
            found += weight * dot(miss, miss)
            for x in range(first, last):
                n = whole(t, ORDER_N, x)
                own = row3(work.jacobian_DN3, d, n)
                own = (weight * own[0], weight * own[1], weight * own[2])
                gradient_N[n] += dot(own, miss)
                for y in range(first, x + 1):
                    m = whole(t, ORDER_N, y)
                    hessian_NN[n, m] += dot(own, row3(work.jacobian_DN3, d, m))
        cost_C[c] = found
    if size(t, BODY_H):
        add_soles(t, work, cost_C, gradient_N, hessian_NN)
