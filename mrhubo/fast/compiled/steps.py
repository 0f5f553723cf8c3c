"""As `mrhubo.fast.plain.robot` and `mrhubo.fast.plain.steps`, for one frame."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from mrhubo.fast.compiled.human import add, cross, dot, identity, multiply, put, put3, row, row3, turn
from mrhubo.fast.compiled.tables import (
    ACROSS_A33,
    AXIS_A3,
    BLOCK_N,
    CELL_CU,
    COLUMN_A,
    COLUMN_Q,
    DIRECTION_Q,
    END_BODY_D,
    END_D3,
    FACTOR_Q4,
    FAR,
    FIRST_C,
    FIRST_D,
    FIRST_STEPS,
    GAIN,
    INNER,
    JOINT_Q,
    LIMB_D,
    LOWER_N,
    MIDDLE_N,
    OFFSET_A,
    ORDER_D,
    ORDER_N,
    ORIGIN_A33,
    PARENT_A,
    PARTIAL_D,
    POLISH_4,
    POOL_RIDGE_CU,
    POOL_UD3,
    POOL_UN,
    POSITION_A3,
    RATIO_A,
    RIDGE_N,
    ROTARY_A,
    SEEN_D,
    START_BODY_D,
    START_D3,
    STARTS,
    TWICE_A33,
    UPPER_N,
    VIEW_BODY_V,
    VIEW_V33,
    WEIGHT_D,
    real,
    single,
    size,
    vector,
    whole,
)
from mrhubo.fast.plain.steps import DAMPING, EASIER, FLOOR, HARDER, LEAST, MOST, SHORTEST, STUCK, TOLERANCE


class Work(NamedTuple):
    """Where a frame's numbers are while it is worked on."""

    rotation_L33: np.ndarray
    position_L3: np.ndarray
    axis_A3: np.ndarray
    start_D3: np.ndarray
    end_D3: np.ndarray
    direction_D3: np.ndarray
    length_D: np.ndarray
    view_V33: np.ndarray
    jacobian_DN3: np.ndarray
    scratch_133: np.ndarray
    goal_D3: np.ndarray
    """The human's directions, length 1."""
    weight_D: np.ndarray
    """How much each counts."""
    cost_C: np.ndarray
    gradient_N: np.ndarray
    hessian_NN: np.ndarray
    next_cost_C: np.ndarray
    next_gradient_N: np.ndarray
    next_hessian_NN: np.ndarray
    trial_N: np.ndarray
    damping_C: np.ndarray
    system_NN: np.ndarray
    step_N: np.ndarray
    weight_C: np.ndarray
    lower_N: np.ndarray
    upper_N: np.ndarray
    own_cost_C: np.ndarray
    best_C: np.ndarray
    start_N: np.ndarray
    begin_N: np.ndarray


@njit(**INNER)
def make_work(t):
    """Room for one frame."""
    bodies, joints, directions = size(t, PARENT_A) + 1, size(t, BLOCK_N), size(t, LIMB_D)
    blocks = size(t, FIRST_C) - 1
    rotation_L33 = np.zeros((bodies, 3, 3))
    identity(rotation_L33, 0)
    lower_N, upper_N = np.empty(joints), np.empty(joints)
    for n in range(joints):
        lower_N[n], upper_N[n] = real(t, LOWER_N, n), real(t, UPPER_N, n)
    return Work(
        rotation_L33, np.zeros((bodies, 3)), np.empty((bodies - 1, 3)), np.zeros((directions, 3)),
        np.empty((directions, 3)), np.empty((directions, 3)), np.empty(directions),
        np.empty((size(t, VIEW_BODY_V), 3, 3)), np.zeros((directions, joints, 3)), np.empty((1, 3, 3)),
        np.empty((directions, 3)), np.empty(directions), np.empty(blocks), np.empty(joints),
        np.zeros((joints, joints)), np.empty(blocks), np.empty(joints), np.zeros((joints, joints)), np.empty(joints),
        np.empty(blocks), np.empty((joints, joints)), np.empty(joints), np.empty(blocks), lower_N, upper_N,
        np.empty(blocks), np.empty(blocks), np.empty(joints), np.empty(joints),
    )  # fmt: skip


@njit(**INNER)
def place(t, work, q_N):
    """Bodies and directions at joint angles [rad], base frame."""
    rotation_L33, position_L3 = work.rotation_L33, work.position_L3
    for a in range(size(t, PARENT_A)):
        angle = q_N[whole(t, COLUMN_A, a)] * real(t, RATIO_A, a) + real(t, OFFSET_A, a)
        parent = whole(t, PARENT_A, a)
        sine, rest, slide = 0.0, 0.0, angle
        if whole(t, ROTARY_A, a):
            sine, rest, slide = math.sin(angle), 1 - math.cos(angle), 0.0
        for i in range(3):
            for j in range(3):
                x = 9 * a + 3 * i + j
                work.scratch_133[0, i, j] = (
                    real(t, ORIGIN_A33, x) + sine * real(t, ACROSS_A33, x) + rest * real(t, TWICE_A33, x)
                )
        multiply(rotation_L33, parent, work.scratch_133, 0, rotation_L33, a + 1)
        moved = turn(rotation_L33, parent, vector(t, POSITION_A3, a))
        axis = turn(rotation_L33, a + 1, vector(t, AXIS_A3, a))
        put(work.axis_A3, a, axis)
        above = row(position_L3, parent)
        put(position_L3, a + 1, (
            above[0] + moved[0] + slide * axis[0], above[1] + moved[1] + slide * axis[1],
            above[2] + moved[2] + slide * axis[2],
        ))  # fmt: skip
    for v in range(size(t, VIEW_BODY_V)):
        for i in range(3):
            for j in range(3):
                work.scratch_133[0, i, j] = real(t, VIEW_V33, 9 * v + 3 * i + j)
        multiply(rotation_L33, whole(t, VIEW_BODY_V, v), work.scratch_133, 0, work.view_V33, v)
    for d in range(size(t, LIMB_D)):
        end_body = whole(t, END_BODY_D, d)
        start, end = (0.0, 0.0, 0.0), turn(rotation_L33, end_body, vector(t, END_D3, d))
        if whole(t, LIMB_D, d):
            start_body = whole(t, START_BODY_D, d)
            start = add(turn(rotation_L33, start_body, vector(t, START_D3, d)), row(position_L3, start_body), 1.0)
            end = add(end, row(position_L3, end_body), 1.0)
        put(work.start_D3, d, start)
        put(work.end_D3, d, end)
        along = add(end, start, -1.0)
        length = math.sqrt(dot(along, along))
        work.length_D[d] = length
        put(work.direction_D3, d, (along[0] / length, along[1] / length, along[2] / length))


@njit(**INNER)
def _jacobian(t, work):
    pairs = size(t, DIRECTION_Q)
    jacobian_DN3 = work.jacobian_DN3
    for p in range(pairs):
        put3(jacobian_DN3, whole(t, DIRECTION_Q, p), whole(t, COLUMN_Q, p), (0.0, 0.0, 0.0))
    for p in range(pairs):
        d, a, n = whole(t, DIRECTION_Q, p), whole(t, JOINT_Q, p), whole(t, COLUMN_Q, p)
        end, start = real(t, FACTOR_Q4, 4 * p), real(t, FACTOR_Q4, 4 * p + 1)
        bend, slide = real(t, FACTOR_Q4, 4 * p + 2), real(t, FACTOR_Q4, 4 * p + 3)
        axis, direction = row(work.axis_A3, a), row(work.direction_D3, d)
        e, s, o = row(work.end_D3, d), row(work.start_D3, d), row(work.position_L3, a + 1)
        lever = (
            e[0] * end - s[0] * start - o[0] * bend,
            e[1] * end - s[1] * start - o[1] * bend,
            e[2] * end - s[2] * start - o[2] * bend,
        )
        moved = add(cross(axis, lever), axis, slide)
        moved = add(moved, direction, -dot(direction, moved))
        put3(jacobian_DN3, d, n, add(row3(jacobian_DN3, d, n), moved, 1 / work.length_D[d]))


@njit(**INNER)
def quadratic(t, work, q_N, cost_C, gradient_N, hessian_NN):
    """Cost and Gauss-Newton model at joint angles, for the goal in `work`."""
    place(t, work, q_N)
    _jacobian(t, work)
    for c in range(len(cost_C)):
        first, last = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
        found = 0.0
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


@njit(**INNER)
def solve(t, work, q_N, c, damping, pull, lower_N, upper_N):
    """The damped step of a block's joints that no limit holds, into `work.step_N`. `pull`: what is added to the
    Hessian's diagonal; the gradient has it already.
    """
    first, last = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
    count = last - first
    system = work.system_NN
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        held = _held(q_N[n], work.gradient_N[n], lower_N[n], upper_N[n])
        work.step_N[n] = 0.0 if held else -work.gradient_N[n]
        for y in range(x):
            m = whole(t, ORDER_N, first + y)
            held_m = _held(q_N[m], work.gradient_N[m], lower_N[m], upper_N[m])
            system[x, y] = 0.0 if held or held_m else work.hessian_NN[n, m]
        diagonal = work.hessian_NN[n, n] + pull
        system[x, x] = (diagonal if not held else 0.0) + (1.0 if held else damping * (diagonal + FLOOR))
    for x in range(count):  # Cholesky
        for y in range(x + 1):
            found = system[x, y]
            for k in range(y):
                found -= system[x, k] * system[y, k]
            system[x, y] = math.sqrt(found) if x == y else found / system[y, y]
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        found = work.step_N[n]
        for k in range(x):
            found -= system[x, k] * work.step_N[whole(t, ORDER_N, first + k)]
        work.step_N[n] = found / system[x, x]
    for x in range(count - 1, -1, -1):
        n = whole(t, ORDER_N, first + x)
        found = work.step_N[n]
        for k in range(x + 1, count):
            found -= system[k, x] * work.step_N[whole(t, ORDER_N, first + k)]
        work.step_N[n] = found / system[x, x]


@njit(**INNER)
def _held(q, gradient, lower, upper):
    return (q <= lower and gradient > 0) or (q >= upper and gradient < 0)


@njit(**INNER)
def aim(t, work, target_BD3, b):
    """Takes a human's directions as the goal."""
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
def accept(t, work, c, q_N):
    """Takes a block's trial."""
    work.cost_C[c] = work.next_cost_C[c]
    for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
        n = whole(t, ORDER_N, x)
        q_N[n] = work.trial_N[n]
        work.gradient_N[n] = work.next_gradient_N[n]
        for y in range(whole(t, FIRST_C, c), x + 1):
            work.hessian_NN[n, whole(t, ORDER_N, y)] = work.next_hessian_NN[n, whole(t, ORDER_N, y)]


@njit(**INNER)
def minimise(t, work, q_N, steps):
    """Makes as many steps at most; `q_N` are the joint angles before and after [rad], `work.cost_C` their costs."""
    blocks = len(work.cost_C)
    for c in range(blocks):
        work.damping_C[c], work.cost_C[c] = DAMPING, np.inf
    for n in range(len(q_N)):
        work.trial_N[n] = q_N[n]
    for number in range(steps + 1):  # the first looks at where it begins
        quadratic(t, work, work.trial_N, work.next_cost_C, work.next_gradient_N, work.next_hessian_NN)
        going = number == 0
        for c in range(blocks):
            better = work.next_cost_C[c] < work.cost_C[c] or number == 0
            moved = 0.0
            for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                n = whole(t, ORDER_N, x)
                moved = max(moved, abs(work.trial_N[n] - q_N[n]))
            if not (moved < TOLERANCE or (not better and work.damping_C[c] > STUCK)):
                going = True
            if better:
                accept(t, work, c, q_N)
            if number:
                work.damping_C[c] = min(max(work.damping_C[c] * (EASIER if better else HARDER), LEAST), MOST)
        if not going or number == steps:
            break
        for c in range(blocks):
            solve(t, work, q_N, c, work.damping_C[c], 0.0, work.lower_N, work.upper_N)
        for n in range(len(q_N)):
            work.trial_N[n] = min(max(q_N[n] + work.step_N[n], work.lower_N[n]), work.upper_N[n])


@njit(**INNER)
def near(t, target_BD3, b, c, start, into_N):
    """The pool's best pose of a cell, for the joints of a block."""
    best, found = np.inf, -1
    joints, directions = size(t, BLOCK_N), size(t, LIMB_D)
    poses = size(t, POOL_UN) // joints
    for u in range(poses):
        if whole(t, CELL_CU, c * poses + u) != start:
            continue
        score = 0.0
        for r in range(whole(t, FIRST_D, c), whole(t, FIRST_D, c + 1)):
            d = whole(t, ORDER_D, r)
            at = 3 * (u * directions + d)
            pooled = (single(t, POOL_UD3, at), single(t, POOL_UD3, at + 1), single(t, POOL_UD3, at + 2))
            score += real(t, WEIGHT_D, d) * dot(row3(target_BD3, b, d), pooled)
        score = single(t, POOL_RIDGE_CU, c * poses + u) - 2 * score
        if score < best:
            best, found = score, u
    if found >= 0:
        for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
            n = whole(t, ORDER_N, x)
            into_N[n] = single(t, POOL_UN, found * joints + n)


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
                    near(t, target_BD3, b, c, number, work.start_N)


@njit(**INNER)
def _far(t, work, c):
    return work.own_cost_C[c] > work.weight_C[c] * real(t, POLISH_4, FAR)
