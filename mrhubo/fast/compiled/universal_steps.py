"""Damped Gauss-Newton steps of one block of joints, as `mrhubo.universal.objective.steps` makes them.

Legend: N joints.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.tables import BLOCK_N, FIRST_C, INNER, LOWER_N, ORDER_N, UPPER_N, real, size, whole
from mrhubo.fast.plain.steps import FLOOR


class Stepping(NamedTuple):
    """A block's joints, while a step is solved for."""

    held_N: np.ndarray
    right_N: np.ndarray
    fixed_N: np.ndarray


@njit(**INNER)
def make_stepping(t):
    """Room for any block."""
    joints = size(t, BLOCK_N)
    return Stepping(np.empty(joints, np.bool_), np.empty(joints), np.empty(joints))


@njit(**INNER)
def _factor(t, work, own, first, count, damping):
    """The Cholesky factor of a block's damped Hessian, of joints that are not held."""
    system = work.system_NN
    for x in range(count):
        n, held = whole(t, ORDER_N, first + x), own.held_N[x]
        for y in range(x):
            m = whole(t, ORDER_N, first + y)
            system[x, y] = 0.0 if held or own.held_N[y] else work.hessian_NN[n, m]
        diagonal = work.hessian_NN[n, n]
        system[x, x] = 1.0 if held else diagonal + damping * (diagonal + FLOOR)
    for y in range(count):
        for k in range(y):
            factor = system[y, k]
            for x in range(y, count):
                system[x, y] -= factor * system[x, k]
        root = 1 / math.sqrt(system[y, y])
        for x in range(y, count):
            system[x, y] *= root
        system[y, y] = root  # which divides


@njit(**INNER)
def _solve(system, right_N, count):
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


@njit(**INNER)
def step(t, work, own, q_N, c, damping, step_N):
    """A block's damped Gauss-Newton step [rad] by the model in `work`, as `mrhubo.universal.objective.steps`."""
    first = whole(t, FIRST_C, c)
    count, hits = whole(t, FIRST_C, c + 1) - first, False
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        q, gradient = q_N[n], work.gradient_N[n]
        held = (q <= real(t, LOWER_N, n) and gradient > 0) or (q >= real(t, UPPER_N, n) and gradient < 0)
        own.held_N[x], own.fixed_N[x] = held, 0.0
        own.right_N[x] = 0.0 if held else -gradient
    _factor(t, work, own, first, count, damping)
    _solve(work.system_NN, own.right_N, count)
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        moved = own.right_N[x]
        inside = min(max(moved, real(t, LOWER_N, n) - q_N[n]), real(t, UPPER_N, n) - q_N[n])
        if inside != moved:
            hits, own.held_N[x], own.fixed_N[x] = True, True, inside
    if hits:
        for x in range(count):
            n = whole(t, ORDER_N, first + x)
            found = -work.gradient_N[n]
            for y in range(count):
                m = whole(t, ORDER_N, first + y)
                found -= (work.hessian_NN[n, m] if y < x else work.hessian_NN[m, n]) * own.fixed_N[y]
            own.right_N[x] = 0.0 if own.held_N[x] else found
        _factor(t, work, own, first, count, damping)
        _solve(work.system_NN, own.right_N, count)
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        moved = own.right_N[x] + own.fixed_N[x]
        step_N[n] = min(max(moved, real(t, LOWER_N, n) - q_N[n]), real(t, UPPER_N, n) - q_N[n])
