"""As `mrhubo.fast.plain.steps`, for one frame; some of it for several side by side (`mrhubo.fast.compiled.lanes`)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import systems
from mrhubo.fast.compiled.cost import quadratic
from mrhubo.fast.compiled.human import dot, put, row3
from mrhubo.fast.compiled.lanes import alike, choose, no, some
from mrhubo.fast.compiled.tables import (
    BLOCK_N,
    BODY_H,
    FAR,
    FIRST_C,
    FIRST_CS,
    FIRST_D,
    FIRST_STEPS,
    GAIN,
    INNER,
    LIMB_D,
    ORDER_D,
    ORDER_N,
    PARTIAL_D,
    POLISH_4,
    POOL_CU,
    POOL_CXU,
    POOL_RIDGE_CU,
    POOL_UN,
    STARTS,
    WEIGHT_D,
    real,
    single,
    size,
    whole,
)
from mrhubo.fast.plain.steps import (
    DAMPING,
    EASIER,
    FOLLOWED,
    HARDER,
    LEAST,
    MOST,
    NEAREST_STEPS,
    SHORTEST,
    STUCK,
    TOLERANCE,
)


@njit(**INNER)
def solve(t, work, q_N, first, last, damping, pull):
    """The damped step of those joints of some of `order_N`, a block's or all, that no limit holds, into `work.step_N`.
    `pull`: what is added to the Hessian's diagonal; the gradient has it already.
    """
    systems.begin(t, work, q_N, first, last - first)
    systems.solve(t, work, first, last - first, damping, pull)
    for x in range(first, last):
        work.step_N[whole(t, ORDER_N, x)] = work.right_N[x - first]


@njit(**INNER)
def _solve_block(t, work, q_N, c, pull):
    solve(t, work, q_N, whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1), work.damping_C[c], pull)


@njit(**INNER)
def aim(t, work, target_BD3, b):
    """Takes a human's directions as the goal, and places of soles where they stand after them."""
    directions, points = size(t, LIMB_D), size(t, BODY_H)
    for h in range(points):
        work.counts_H[h] = 0.0
        if target_BD3.shape[1] > directions:
            put(work.wanted_H3, h, row3(target_BD3, b, directions + h))
            work.counts_H[h] = target_BD3[b, directions + points + h, 0]
    for c in range(len(work.weight_C)):
        work.weight_C[c] = 0.0
        for r in range(whole(t, FIRST_D, c), whole(t, FIRST_D, c + 1)):
            d = whole(t, ORDER_D, r)
            target = row3(target_BD3, b, d)
            own = math.sqrt(dot(target, target))
            length = own if whole(t, PARTIAL_D, d) else 1.0
            scale = 1 / max(length, SHORTEST)
            put(work.goal_D3, d, (target[0] * scale, target[1] * scale, target[2] * scale))
            work.weight_D[d] = real(t, WEIGHT_D, d) * length
            work.weight_C[c] += real(t, WEIGHT_D, d) * own


@njit(**INNER)
def accept(t, work, c, q_N, better):
    """Takes a block's trial where it is better."""
    if not some(better):
        return
    first, last = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
    work.cost_C[c] = choose(better, work.next_cost_C[c], work.cost_C[c])
    for x in range(first, last):
        n = whole(t, ORDER_N, x)
        q_N[n] = choose(better, work.trial_N[n], q_N[n])
        work.gradient_N[n] = choose(better, work.next_gradient_N[n], work.gradient_N[n])
        for y in range(first, x + 1):
            m = whole(t, ORDER_N, y)
            work.hessian_NN[n, m] = choose(better, work.next_hessian_NN[n, m], work.hessian_NN[n, m])


@njit(**INNER)
def minimise(t, work, q_N, steps):
    """Makes as many steps at most; `q_N` are the joint angles before and after [rad], `work.cost_C` their costs. Frames
    side by side stand still from where each has converged.
    """
    blocks, live = len(work.cost_C), alike(work.cost_C[0], 1.0)
    for c in range(blocks):
        work.damping_C[c], work.cost_C[c] = DAMPING, np.inf
    for n in range(len(q_N)):
        work.trial_N[n] = q_N[n]
    for number in range(steps + 1):  # the first looks at where it begins
        quadratic(t, work, work.trial_N, work.next_cost_C, work.next_gradient_N, work.next_hessian_NN)
        going = alike(live, 0.0)
        for c in range(blocks):
            better = (live > 0) & ((work.next_cost_C[c] < work.cost_C[c]) | (number == 0))
            moved = alike(live, 0.0)
            for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                n = whole(t, ORDER_N, x)
                moved = max(moved, abs(work.trial_N[n] - q_N[n]))
            done = (moved < TOLERANCE) | (no(better) & (work.damping_C[c] > STUCK))
            going = choose(done, going, live)
            accept(t, work, c, q_N, better)
            if number:
                damping = work.damping_C[c] * choose(better, EASIER, HARDER)
                work.damping_C[c] = min(max(damping, LEAST), MOST)
        if number:
            live = going
        if not some(live > 0) or number == steps:
            break
        for c in range(blocks):
            _solve_block(t, work, q_N, c, 0.0)
        for n in range(len(q_N)):
            work.trial_N[n] = min(max(q_N[n] + work.step_N[n], work.lower_N[n]), work.upper_N[n])


@njit(**INNER)
def follow(t, work, target_BD3, b, pull, q_N):
    """A stream's steps from `q_N` [rad], where the answer will stand, inside the bounds in `work`; the costs stand in
    `work.cost_C`.
    """
    blocks = len(work.cost_C)
    aim(t, work, target_BD3, b)
    for n in range(len(q_N)):
        work.begin_N[n] = work.trial_N[n] = q_N[n]
    for number in range(FOLLOWED + 1):  # the first looks at where it begins
        quadratic(t, work, work.trial_N, work.next_cost_C, work.next_gradient_N, work.next_hessian_NN)
        for c in range(blocks):
            first, last = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
            more = 0.0
            for x in range(first, last):
                n = whole(t, ORDER_N, x)
                trial, own = work.trial_N[n] - work.begin_N[n], q_N[n] - work.begin_N[n]
                more += pull * (trial * trial - own * own)
            better = number == 0 or work.next_cost_C[c] + more < work.cost_C[c]
            if better:
                accept(t, work, c, q_N, better)
                for x in range(first, last):  # the gradient has the pull from here on, the cost has not
                    n = whole(t, ORDER_N, x)
                    work.gradient_N[n] += pull * (q_N[n] - work.begin_N[n])
            work.damping_C[c] = DAMPING if number == 0 else work.damping_C[c] * (EASIER if better else HARDER)
        if number == FOLLOWED:
            return
        for c in range(blocks):
            _solve_block(t, work, q_N, c, pull)
        for n in range(len(q_N)):
            work.trial_N[n] = min(max(q_N[n] + work.step_N[n], work.lower_N[n]), work.upper_N[n])


@njit(**INNER)
def near(t, work, target_BD3, b, c, start, into_N):
    """The pool's best pose of a cell, for the joints of a block."""
    starts, poses = int(real(t, POLISH_4, STARTS)), len(work.score_U)
    cell, first, last = c * (starts + 1) + start, whole(t, FIRST_D, c), whole(t, FIRST_D, c + 1)
    at, count = whole(t, FIRST_CS, cell), whole(t, FIRST_CS, cell + 1) - whole(t, FIRST_CS, cell)
    # Loops over views, so that several poses are looked at at once.
    singles, score_U, at = t[2], work.score_U[:count], c * poses + at
    ridge = t[0][2 * POOL_RIDGE_CU] + at
    score_U[:] = singles[ridge : ridge + count]
    row = t[0][2 * POOL_CXU] + 3 * first * poses + at - c * poses
    for r in range(first, last):
        d = whole(t, ORDER_D, r)
        for i in range(3):
            wanted, own_U = np.float32(-2 * real(t, WEIGHT_D, d) * target_BD3[b, d, i]), singles[row : row + count]
            for u in range(count):
                score_U[u] += wanted * own_U[u]
            row += poses
    if count:
        found = 0
        for u in range(1, count):
            if score_U[u] < score_U[found]:
                found = u
        found = whole(t, POOL_CU, at + found)
        for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
            n = whole(t, ORDER_N, x)
            into_N[n] = single(t, POOL_UN, found * size(t, BLOCK_N) + n)


@njit(**INNER)
def nearest(t, work, target_BD3, b, q_N):
    """The best of the pool's poses after some steps, where no network answers."""
    blocks = len(work.cost_C)
    aim(t, work, target_BD3, b)
    for c in range(blocks):
        work.best_C[c] = np.inf
    for start in range(int(real(t, POLISH_4, STARTS))):
        for c in range(blocks):
            near(t, work, target_BD3, b, c, start, work.start_N)
        minimise(t, work, work.start_N, NEAREST_STEPS)
        for c in range(blocks):
            if work.cost_C[c] < work.best_C[c]:
                work.best_C[c] = work.cost_C[c]
                for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                    n = whole(t, ORDER_N, x)
                    q_N[n] = work.start_N[n]


@njit(**INNER)
def polish(t, work, target_BD3, b, q_N, steps):
    """Steps from `q_N` [rad], and from other places for blocks that are far off then; the answer stands in `q_N`."""
    joints, blocks, starts = len(q_N), len(work.cost_C), int(real(t, POLISH_4, STARTS))
    aim(t, work, target_BD3, b)
    far = False
    for n in range(joints):
        work.start_N[n] = q_N[n]
    # From the given angles; a few steps from each start; on from the best of them.
    for number in range(starts + 2):
        most = steps if number in (0, starts + 1) else min(steps, int(real(t, POLISH_4, FIRST_STEPS)))
        minimise(t, work, work.start_N, most)
        for c in range(blocks):
            cost = work.cost_C[c]
            if number == 0:
                work.own_cost_C[c], work.best_C[c] = cost, np.inf
                far |= _far(t, work, c)
            enough = work.best_C[c]
            if number == starts + 1:
                enough = (
                    work.own_cost_C[c] - work.weight_C[c] * real(t, POLISH_4, GAIN) if _far(t, work, c) else -np.inf
                )
            if number and cost < enough:
                work.best_C[c] = cost
            if number == 0 or cost < enough:
                for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                    n = whole(t, ORDER_N, x)
                    if number in (0, starts + 1):
                        q_N[n] = work.start_N[n]
                    else:
                        work.begin_N[n] = work.start_N[n]
        if not far or steps == 0:
            return
        for n in range(joints):
            work.start_N[n] = q_N[n] if number < starts else work.begin_N[n]
        if number < starts:
            for c in range(blocks):
                if _far(t, work, c):
                    near(t, work, target_BD3, b, c, number, work.start_N)


@njit(**INNER)
def _far(t, work, c):
    return work.own_cost_C[c] > work.weight_C[c] * real(t, POLISH_4, FAR)
