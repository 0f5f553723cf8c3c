"""Damped systems of a block's joints, for one frame or for several side by side (`mrhubo.fast.compiled.lanes`).

Legend: N joints.
"""

from __future__ import annotations

import math

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.lanes import choose
from mrhubo.fast.compiled.tables import INNER, ORDER_N, whole
from mrhubo.fast.plain.steps import FLOOR


@njit(**INNER)
def begin(t, work, q_N, first, count):
    """Holds those of some of `order_N`, a block's or all, that a limit stops; the others' right side is downhill."""
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        q, gradient = q_N[n], work.gradient_N[n]
        held = ((q <= work.lower_N[n]) & (gradient > 0)) | ((q >= work.upper_N[n]) & (gradient < 0))
        work.free_N[x] = choose(held, 0.0, 1.0)
        work.right_N[x] = choose(held, 0.0, -gradient)


@njit(**INNER)
def solve(t, work, first, count, damping, pull):
    """The solution, for joints that are not held, of the damped Hessian and `right_N`, in its place. `pull`: what is
    added to the Hessian's diagonal before.
    """
    system, right_N, free_N = work.system_NN, work.right_N, work.free_N
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        for y in range(x):
            system[x, y] = work.hessian_NN[n, whole(t, ORDER_N, first + y)] * (free_N[x] * free_N[y])
        diagonal = work.hessian_NN[n, n] + pull
        system[x, x] = choose(free_N[x] > 0, diagonal + damping * (diagonal + FLOOR), 1.0)
    for x in range(count):  # Cholesky; the diagonal's reciprocals
        for y in range(x):
            found = system[x, y]
            for k in range(y):
                found -= system[x, k] * system[y, k]
            system[x, y] = found * system[y, y]
        found = system[x, x]
        for k in range(x):
            found -= system[x, k] * system[x, k]
        system[x, x] = 1 / math.sqrt(found)
    for x in range(count):
        found = right_N[x]
        for k in range(x):
            found -= system[x, k] * right_N[k]
        right_N[x] = found * system[x, x]
    for x in range(count - 1, -1, -1):
        found = right_N[x]
        for k in range(x + 1, count):
            found -= system[k, x] * right_N[k]
        right_N[x] = found * system[x, x]
