"""As `mrhubo.fast.plain.universal`, for one frame.

Legend: K hypotheses or dampings, N joints, C blocks, D directions, S = 5 slots.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.cost import quadratic
from mrhubo.fast.compiled.human import add, dot, put, row, row3, turn_back
from mrhubo.fast.compiled.robot import place
from mrhubo.fast.compiled.steps import minimise
from mrhubo.fast.compiled.tables import (
    BLOCK_N,
    FIRST_C,
    FIRST_D,
    INNER,
    LOWER_N,
    MIDDLE_N,
    ORDER_D,
    ORDER_N,
    RIDGE_N,
    SEEN_D,
    UPPER_N,
    real,
    size,
    whole,
)
from mrhubo.fast.compiled.universal_network import OUTPUTS, answer, exponential
from mrhubo.fast.description import Description
from mrhubo.fast.plain.steps import FLOOR
from mrhubo.fast.plain.universal import DAMPINGS, FINAL, FINAL_DAMPINGS, KEPT, REACH, STEPS
from mrhubo.fast.sections import Universal

_SEEN = len(DAMPINGS)
_MOST = max(KEPT)
_FINAL, _TURNS = len(FINAL_DAMPINGS), 1 + len(KEPT) + FINAL


class Lookup(NamedTuple):
    """What is looked up once for a robot."""

    known_C: np.ndarray
    slot_CS: np.ndarray
    view_C: np.ndarray
    axial_C3: np.ndarray
    flip_CS3: np.ndarray
    joint_N: np.ndarray
    sense_N: np.ndarray
    hypotheses: int


def look_up(description: Description, universal: Universal) -> Lookup:
    """Of each block of joints; what the network does not know sees nothing."""
    blocks, e = len(description.cost.cell_CU), universal.block_E

    def spread(array_E: np.ndarray, fill: float) -> np.ndarray:
        found_C = np.full((blocks, *array_E.shape[1:]), fill, array_E.dtype)
        found_C[e] = array_E
        return found_C

    return Lookup(
        spread(np.ones(len(e), np.bool_), False), spread(universal.slot_E5, -1), spread(universal.view_E, 0),
        spread(universal.axial_E3.astype(np.float64), 1), spread(universal.flip_E53.astype(np.float64), 1),
        universal.joint_N, universal.sense_N.astype(np.float64), int(universal.size_2[1]),
    )  # fmt: skip


class Tried(NamedTuple):
    """Hypotheses, the ways that they may go, and the best so far."""

    q_KN: np.ndarray
    cost_KC: np.ndarray
    kept_KN: np.ndarray
    step_PN: np.ndarray
    """Damped steps of the one that is at work."""
    best_N: np.ndarray
    best_C: np.ndarray
    held_N: np.ndarray
    right_N: np.ndarray
    fixed_N: np.ndarray
    other_N: np.ndarray
    other_C: np.ndarray
    miss_S3: np.ndarray


@njit(**INNER)
def make_tried(t, u):
    """Room for one frame."""
    joints, blocks, most = size(t, BLOCK_N), size(t, FIRST_C) - 1, max(u.hypotheses, _MOST)
    return Tried(
        np.empty((most, joints)), np.empty((most, blocks)), np.empty((_MOST, joints)),
        np.zeros((_SEEN, joints)), np.empty(joints), np.empty(blocks), np.empty(joints, np.bool_),
        np.empty(joints), np.empty(joints), np.empty(joints), np.empty(blocks),
        np.empty((5, 3)),
    )  # fmt: skip


@njit(**INNER)
def cost(t, work, q_N, cost_C):
    """What each block costs at joint angles, for the goal in `work`."""
    place(t, work, q_N)
    for c in range(len(cost_C)):
        found = 0.0
        for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
            n = whole(t, ORDER_N, x)
            off = q_N[n] - real(t, MIDDLE_N, n)
            found += real(t, RIDGE_N, n) * off * off
        for r in range(whole(t, FIRST_D, c), whole(t, FIRST_D, c + 1)):
            d = whole(t, ORDER_D, r)
            seen = turn_back(work.view_V33, whole(t, SEEN_D, d), row(work.direction_D3, d))
            miss = add(seen, row(work.goal_D3, d), -1.0)
            found += work.weight_D[d] * dot(miss, miss)
        cost_C[c] = found


@njit(**INNER)
def _factor(t, work, tried, first, count, damping):
    """The Cholesky factor of a block's damped Hessian, of joints that are not held."""
    system = work.system_NN
    for x in range(count):
        n, held = whole(t, ORDER_N, first + x), tried.held_N[x]
        for y in range(x):
            m = whole(t, ORDER_N, first + y)
            system[x, y] = 0.0 if held or tried.held_N[y] else work.hessian_NN[n, m]
        diagonal = work.hessian_NN[n, n]
        system[x, x] = 1.0 if held else diagonal + damping * (diagonal + FLOOR)
    for y in range(count):
        for k in range(y):
            own = system[y, k]
            for x in range(y, count):
                system[x, y] -= own * system[x, k]
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
def step(t, work, tried, q_N, c, damping, step_N):
    """A block's damped Gauss-Newton step [rad] by the model in `work`, as `mrhubo.universal.objective.steps`."""
    first = whole(t, FIRST_C, c)
    count, hits = whole(t, FIRST_C, c + 1) - first, False
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        q, gradient = q_N[n], work.gradient_N[n]
        held = (q <= real(t, LOWER_N, n) and gradient > 0) or (q >= real(t, UPPER_N, n) and gradient < 0)
        tried.held_N[x], tried.fixed_N[x] = held, 0.0
        tried.right_N[x] = 0.0 if held else -gradient
    _factor(t, work, tried, first, count, damping)
    _solve(work.system_NN, tried.right_N, count)
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        moved = tried.right_N[x]
        inside = min(max(moved, real(t, LOWER_N, n) - q_N[n]), real(t, UPPER_N, n) - q_N[n])
        if inside != moved:
            hits, tried.held_N[x], tried.fixed_N[x] = True, True, inside
    if hits:
        for x in range(count):
            n = whole(t, ORDER_N, first + x)
            found = -work.gradient_N[n]
            for y in range(count):
                m = whole(t, ORDER_N, first + y)
                found -= (work.hessian_NN[n, m] if y < x else work.hessian_NN[m, n]) * tried.fixed_N[y]
            tried.right_N[x] = 0.0 if tried.held_N[x] else found
        _factor(t, work, tried, first, count, damping)
        _solve(work.system_NN, tried.right_N, count)
    for x in range(count):
        n = whole(t, ORDER_N, first + x)
        moved = tried.right_N[x] + tried.fixed_N[x]
        step_N[n] = min(max(moved, real(t, LOWER_N, n) - q_N[n]), real(t, UPPER_N, n) - q_N[n])


@njit(**INNER)
def _features(t, u, work, tried, room, q_N, c, first):
    """Features of a block and its joints, whose steps stand in `tried` and whose model in `work`."""
    seen_XF, miss_S3 = room.seen_XF, tried.miss_S3
    for s in range(5):
        d = u.slot_CS[c, s]
        weight = work.weight_D[d] if d >= 0 else 0.0
        own, goal = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if weight > 0:
            own = turn_back(work.view_V33, whole(t, SEEN_D, d), row(work.direction_D3, d))
            goal = row(work.goal_D3, d)
        put(miss_S3, s, add(own, goal, -1.0))
        for j in range(3):
            seen_XF[c, 3 * s + j] = own[j] * u.flip_CS3[c, s, j]
            seen_XF[c, 15 + 3 * s + j] = goal[j] * u.flip_CS3[c, s, j]
        seen_XF[c, 30 + s] = math.sqrt(weight)
    seen_XF[c, 35] = math.log(work.cost_C[c] + 1e-4) / 5
    seen_XF[c, 36] = 1.0 if first else 0.0
    begin, end = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
    for i in range(begin, end):
        n = whole(t, ORDER_N, i)
        line_F, sense = room.feature_TF[i], u.sense_N[n]
        axis = turn_back(work.view_V33, u.view_C[c], row(work.axis_A3, u.joint_N[n]))
        for j in range(3):
            line_F[j] = axis[j] * u.axial_C3[c, j] * sense
        for s in range(5):
            d = u.slot_CS[c, s]
            if d >= 0:
                root = seen_XF[c, 30 + s] * sense
                own = turn_back(work.view_V33, whole(t, SEEN_D, d), row3(work.jacobian_DN3, d, n))
                for j in range(3):
                    line_F[3 + 3 * s + j] = own[j] * u.flip_CS3[c, s, j] * root
                line_F[18 + s] = dot(own, row(miss_S3, s)) * work.weight_D[d] * sense
        _joint_features(t, work, tried, line_F, q_N[n], n, sense)
        line_F[43] = 1.0 / (end - begin)


@njit(**INNER)
def _asinh(x):
    return math.copysign(math.log(abs(x) + math.sqrt(x * x + 1)), x)


@njit(**INNER)
def _joint_features(t, work, tried, line_F, q, n, sense):
    gradient, diagonal = work.gradient_N[n], work.hessian_NN[n, n]
    lower, upper = real(t, LOWER_N, n), real(t, UPPER_N, n)
    up, down, half = upper - q, q - lower, (upper - lower) / 2
    frozen = (down <= 0 and gradient > 0) or (up <= 0 and gradient < 0)
    if sense < 0:
        up, down = down, up
    for p in range(_SEEN):
        moved = tried.step_PN[p, n] * sense
        line_F[23 + p] = min(max(moved, -1.5), 1.5)
        line_F[26 + p] = _asinh(10 * moved)
    line_F[29], line_F[30], line_F[31] = _asinh(30 * gradient * sense), math.sqrt(max(diagonal, 0.0)), diagonal
    line_F[32], line_F[33] = min(up, 3.0), min(down, 3.0)
    near_up, near_down = math.exp(-2 * up), math.exp(-2 * down)
    line_F[34], line_F[35] = near_up**5, near_down**5
    line_F[36], line_F[37] = near_up, near_down
    away = (q - real(t, MIDDLE_N, n)) * sense
    line_F[38], line_F[39], line_F[40] = away / half, min(half, 3.0), 1.0
    line_F[41], line_F[42] = 0.0 if frozen else 1.0, min(max(away, -3.0), 3.0)


@njit(**INNER)
def _move(t, u, tried, room, q_N, at, out_N):
    """The network's next angles from `q_N`, by outputs from a column on, into `out_N`."""
    out_TO = room.out_TO
    for i in range(len(q_N)):
        n = whole(t, ORDER_N, i)
        most = max(max(out_TO[i, at], out_TO[i, at + 1]), out_TO[i, at + 2])
        total, moved = 0.0, 0.0
        for p in range(_SEEN):
            share = exponential(out_TO[i, at + p] - most)
            total += share
            moved += share * tried.step_PN[p, n]
        moved = moved / total + REACH * math.tanh(out_TO[i, at + 3]) * u.sense_N[n]
        out_N[n] = min(max(q_N[n] + moved, real(t, LOWER_N, n)), real(t, UPPER_N, n))


@njit(**INNER)
def _keep(t, tried, count, keep):
    """The cheapest of some hypotheses, block by block, into `kept_KN`; and the best of all."""
    q_KN, cost_KC = tried.q_KN, tried.cost_KC
    for c in range(cost_KC.shape[1]):
        for k in range(keep):
            least = 0
            for j in range(1, count):
                if cost_KC[j, c] < cost_KC[least, c]:
                    least = j
            better = k == 0 and cost_KC[least, c] < tried.best_C[c]
            if better:
                tried.best_C[c] = cost_KC[least, c]
            for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                n = whole(t, ORDER_N, x)
                tried.kept_KN[k, n] = q_KN[least, n]
                if better:
                    tried.best_N[n] = q_KN[least, n]
            cost_KC[least, c] = np.inf


@njit(**INNER)
def _take(t, work, tried, k, always):
    """`other_N` becomes the `k`th hypothesis where it costs less, block by block; or always."""
    cost(t, work, tried.other_N, tried.other_C)
    for c in range(len(tried.other_C)):
        if always or tried.other_C[c] < tried.cost_KC[k, c]:
            tried.cost_KC[k, c] = tried.other_C[c]
            for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                n = whole(t, ORDER_N, x)
                tried.q_KN[k, n] = tried.other_N[n]


@njit(**INNER)
def unroll(t, u, w, work, tried, room, q_N):
    """Five iterations for the goal in `work`; the answer stands in `q_N`.

    One after the other in a loop, as each place that calls a function is compiled by itself.
    """
    joints, blocks, count, unknown = len(q_N), len(work.cost_C), 1, False
    for n in range(joints):
        q_N[n] = tried.best_N[n] = tried.kept_KN[0, n] = (real(t, LOWER_N, n) + real(t, UPPER_N, n)) / 2
    for turn in range(_TURNS + 1):
        first, final = turn == 0, turn > len(KEPT)
        if not first:
            keep = 1 if final else KEPT[turn - 1]
            _keep(t, tried, count, min(keep, count))
            count = min(keep, count)
            if turn == _TURNS:
                break
        for k in range(count):
            kept_N = tried.kept_KN[k]
            quadratic(t, work, kept_N, work.cost_C, work.gradient_N, work.hessian_NN)
            for c in range(blocks):
                if first:
                    tried.best_C[c] = work.cost_C[c]
                for p in range(_FINAL if final else _SEEN):
                    step(t, work, tried, kept_N, c, FINAL_DAMPINGS[p] if final else DAMPINGS[p], tried.step_PN[p])
                if not final:
                    _features(t, u, work, tried, room, kept_N, c, first)
            if not final:
                answer(t, w, room, first)
            for way in range(u.hypotheses if first else 2):
                if first or not (final or way):
                    _move(t, u, tried, room, kept_N, OUTPUTS * way, tried.other_N)
                else:
                    for n in range(joints):
                        tried.other_N[n] = kept_N[n] + tried.step_PN[way if final else 0, n]
                _take(t, work, tried, way if first else k, first or way == 0)
        if first:
            count = u.hypotheses
    for n in range(joints):
        if u.known_C[whole(t, BLOCK_N, n)]:
            q_N[n] = tried.best_N[n]
        else:
            unknown = True
    if unknown:
        for n in range(joints):
            tried.other_N[n] = q_N[n]
        minimise(t, work, tried.other_N, STEPS)
        for n in range(joints):
            if not u.known_C[whole(t, BLOCK_N, n)]:
                q_N[n] = tried.other_N[n]
