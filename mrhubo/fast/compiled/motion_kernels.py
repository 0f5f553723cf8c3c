"""What refining a whole motion needs, compiled: the cost of frames, and systems of all of them.

Legend: B frames, T frames of a motion, D directions, N joints, C blocks, M joints of one block, K couplings, R = T M
rows, V entries of a column.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import avoidance, band, collision, cost, human, steps, tables
from mrhubo.fast.compiled import robot as robots
from mrhubo.fast.compiled.reading import read_quickly
from mrhubo.fast.kept import checksum, drop_others


class MotionKernels(NamedTuple):
    """Compiled functions."""

    quadratic: Callable[..., Any]
    whole: Callable[..., Any]
    turning: Callable[..., Any]
    close: Callable[..., Any]
    factor: Callable[..., Any]
    solve: Callable[..., Any]


@cache
def make_motion_kernels() -> MotionKernels:
    """The functions, the same for all retargeters, as for `make_kernels`."""
    version = checksum()

    @njit(cache=True, **tables.COMPILED)
    def quadratic(t, q_BN, target_BD3, cost_BC, gradient_BN, hessian_BNN):
        """Cost and Gauss-Newton model of frames."""
        _ = version
        work = robots.make_work(t)
        joints = q_BN.shape[1]
        for b in range(len(q_BN)):
            steps.aim(t, work, target_BD3, b)
            cost.quadratic(t, work, q_BN[b], work.next_cost_C, work.next_gradient_N, work.next_hessian_NN)
            for c in range(cost_BC.shape[1]):
                cost_BC[b, c] = work.next_cost_C[c]
            for n in range(joints):
                gradient_BN[b, n] = work.next_gradient_N[n]
                for m in range(n + 1):
                    hessian_BNN[b, n, m] = hessian_BNN[b, m, n] = work.next_hessian_NN[n, m]

    @njit(cache=True, **tables.COMPILED)
    def whole(t, q_BN, target_BD3, cost_BC, gradient_BN, hessian_BNN):
        """The same with what contacts cost, all joints in one block."""
        _ = version
        work = robots.make_work(t)
        joints = q_BN.shape[1]
        for b in range(len(q_BN)):
            steps.aim(t, work, target_BD3, b)
            cost_BC[b, 0] = avoidance.whole_model(t, work, q_BN[b])
            for n in range(joints):
                gradient_BN[b, n] = work.next_gradient_N[n]
                for m in range(n + 1):
                    hessian_BNN[b, n, m] = hessian_BNN[b, m, n] = work.next_hessian_NN[n, m]

    @njit(cache=True, **tables.COMPILED)
    def turning(t, q_BN, direction_BD3, jacobian_BD3N):
        """Directions of frames and their Jacobian, both in the axes of the parts that see them."""
        _ = version
        work = robots.make_work(t)
        for b in range(len(q_BN)):
            robots.place(t, work, q_BN[b])
            robots.jacobian(t, work)
            for d in range(direction_BD3.shape[1]):
                view = tables.whole(t, tables.SEEN_D, d)
                x, y, z = human.turn_back(work.view_V33, view, human.row(work.direction_D3, d))
                direction_BD3[b, d, 0], direction_BD3[b, d, 1], direction_BD3[b, d, 2] = x, y, z
                for n in range(q_BN.shape[1]):
                    x, y, z = human.turn_back(work.view_V33, view, human.row3(work.jacobian_DN3, d, n))
                    jacobian_BD3N[b, d, 0, n], jacobian_BD3N[b, d, 1, n], jacobian_BD3N[b, d, 2, n] = x, y, z

    @njit(cache=True, **tables.COMPILED)
    def close(t, q_BN, close_B):
        """Which frames have a pair of capsules nearer than its clearance."""
        _ = version
        work = robots.make_work(t)
        for b in range(len(q_BN)):
            robots.place(t, work, q_BN[b])
            close_B[b] = collision.touches(t, work, True)

    @njit(cache=True, **tables.COMPILED)
    def factor(within_TMM, diagonal_TM, coupling_KTMM):
        """As `band.factor`."""
        _ = version
        return band.factor(within_TMM, diagonal_TM, coupling_KTMM)

    @njit(cache=True, **tables.COMPILED)
    def solve(column_RV, x_R):
        """As `band.solve`."""
        _ = version
        band.solve(column_RV, x_R)

    drop_others(quadratic.stats.cache_path)
    return MotionKernels(*map(read_quickly, (quadratic, whole, turning, close, factor, solve)))
