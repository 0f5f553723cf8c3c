"""Damped Gauss-Newton steps of one block of joints, as `mrhubo.universal.objective.steps` makes them.

Legend: N joints.
"""

from __future__ import annotations

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.lanes import alike, choose, some
from mrhubo.fast.compiled.systems import begin, solve
from mrhubo.fast.compiled.tables import FIRST_C, INNER, ORDER_N, whole


@njit(**INNER)
def step(t, work, q_N, c, damping):
    """A block's damped Gauss-Newton step [rad] by the model in `work`, into `work.step_N`: what stops at a limit on the
    way stays there, and the other joints' step is solved for again.
    """
    first = whole(t, FIRST_C, c)
    count = whole(t, FIRST_C, c + 1) - first
    begin(t, work, q_N, first, count)
    solve(t, work, first, count, damping, 0.0)
    hits = alike(work.right_N[0], 0.0)
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        moved = work.right_N[x]
        inside = min(max(moved, work.lower_N[n] - q_N[n]), work.upper_N[n] - q_N[n])
        hit = inside != moved
        hits = choose(hit, 1.0, hits)
        work.step_N[n] = choose(hit, inside, 0.0)
        work.free_N[x] = choose(hit, 0.0, work.free_N[x])
    if some(hits > 0):
        for x in range(count):
            n = whole(t, ORDER_N, first + x)
            found = -work.gradient_N[n]
            for y in range(count):
                m = whole(t, ORDER_N, first + y)
                found -= work.hessian_NN[max(n, m), min(n, m)] * work.step_N[m]
            work.right_N[x] = choose(work.free_N[x] > 0, found, 0.0)
        solve(t, work, first, count, damping, 0.0)
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        moved = work.right_N[x] + work.step_N[n]
        work.step_N[n] = min(max(moved, work.lower_N[n] - q_N[n]), work.upper_N[n] - q_N[n])
