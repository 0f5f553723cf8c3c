"""What refining a whole motion needs, compiled: the cost of frames, and systems of all of them.

Legend: B frames, T frames of a motion, D directions, N joints, C blocks, M joints of one block, K couplings, R = T M
rows, W entries of a row from the first that is not 0 to the diagonal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import avoidance, collision, cost, human, steps, tables
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
            cost_BC[b, 0] = avoidance.whole_model(
                t, work, q_BN[b], work.next_cost_C, work.next_gradient_N, work.next_hessian_NN
            )
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
    def factor(within_TMM, diagonal_TM, coupling_KTMM, lower_RW):
        """Cholesky factor of a `Banded`, row after row; the last entry of a row is the reciprocal of its diagonal."""
        _ = version
        frames, joints = diagonal_TM.shape
        reach, width = len(coupling_KTMM), lower_RW.shape[1] - 1
        for t in range(frames):
            earlier = min(reach, t)
            for m in range(joints):
                r, first = t * joints + m, width - m - earlier * joints
                row_W = lower_RW[r]
                row_W[:] = 0.0
                for lag in range(1, earlier + 1):
                    for n in range(joints):
                        row_W[width - m - lag * joints + n] = coupling_KTMM[lag - 1, t - lag, m, n]
                for n in range(m):
                    row_W[width - m + n] = within_TMM[t, m, n]
                for y in range(first, width):
                    other_W = lower_RW[r - width + y]
                    found = row_W[y]
                    for k in range(first, y):  # what lies before the first entry is 0
                        found -= row_W[k] * other_W[width - y + k]
                    row_W[y] = found * other_W[width]
                found = diagonal_TM[t, m]
                for k in range(first, width):
                    found -= row_W[k] * row_W[k]
                row_W[width] = 1 / math.sqrt(found)

    @njit(cache=True, **tables.COMPILED)
    def solve(lower_RW, x_R):
        """The solution of a system whose factor is given, in the place of its right side."""
        _ = version
        rows, width = len(x_R), lower_RW.shape[1] - 1
        for r in range(rows):
            row_W = lower_RW[r]
            first = max(0, r - width)
            before_X = x_R[first:r]
            found = x_R[r]
            for k in range(len(before_X)):
                found -= row_W[width - len(before_X) + k] * before_X[k]
            x_R[r] = found * row_W[width]
        for r in range(rows - 1, -1, -1):
            row_W = lower_RW[r]
            x_R[r] *= row_W[width]
            found = x_R[r]
            first = max(0, r - width)
            before_X = x_R[first:r]
            for k in range(len(before_X)):
                before_X[k] -= row_W[width - len(before_X) + k] * found

    drop_others(quadratic.stats.cache_path)
    return MotionKernels(*map(read_quickly, (quadratic, whole, turning, close, factor, solve)))
