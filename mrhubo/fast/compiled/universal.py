"""As `mrhubo.fast.plain.universal`, for some frames side by side (`mrhubo.fast.compiled.lanes`).

Legend: F frames, Z times as many hypotheses as there are lanes, L lanes, P damped steps, N joints, C blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.cost import quadratic
from mrhubo.fast.compiled.human import add, dot, row, turn_back
from mrhubo.fast.compiled.lane_arrays import inside, zeros
from mrhubo.fast.compiled.lanes import LANES, alike, choose, filled
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
from mrhubo.fast.compiled.universal_features import SEEN_STEPS, move, see
from mrhubo.fast.compiled.universal_network import OUTPUTS, answer, make_room
from mrhubo.fast.compiled.universal_steps import step
from mrhubo.fast.plain.universal import DAMPINGS, FINAL_DAMPINGS, KEPT, REFINED, STEPS

_MOST, _FINAL, _TURNS = max(KEPT), len(FINAL_DAMPINGS), 1 + len(KEPT)


class Tried(NamedTuple):
    """Hypotheses of some frames, as many side by side as there are lanes: one of each frame, then the next of each. How
    many frames there are divides the lanes, so that a lane is of one frame always.
    """

    kept_ZN: np.ndarray
    step_ZPN: np.ndarray
    """The ways that the kept ones may go."""
    q_ZN: np.ndarray
    cost_ZC: np.ndarray
    other_N: np.ndarray
    other_C: np.ndarray
    best_FN: np.ndarray
    best_FC: np.ndarray
    """The best so far of each frame, one after the other."""
    out_4: np.ndarray
    step_P: np.ndarray
    """What hypotheses that go on from different ones see."""


@njit(**INNER)
def make_tried(t, u):
    """Room for as many frames as there are lanes."""
    joints, blocks, most = size(t, BLOCK_N), size(t, FIRST_C) - 1, max(u.hypotheses, _MOST)
    kind = filled(0.0)
    return Tried(
        zeros(kind, (_MOST, joints)), zeros(kind, (_MOST, SEEN_STEPS, joints)), zeros(kind, (most, joints)),
        zeros(kind, (most, blocks)), zeros(kind, (joints,)), zeros(kind, (blocks,)), np.zeros((LANES, joints)),
        np.zeros((LANES, blocks)), zeros(kind, (OUTPUTS,)), zeros(kind, (SEEN_STEPS,)),
    )  # fmt: skip


@njit(**INNER)
def make_layers(t, u, w):
    """Room for the network's layers."""
    return make_room(t, w, size(t, BLOCK_N), OUTPUTS * u.hypotheses, LANES, _MOST)


@njit(**INNER)
def cost(t, work, q_N, cost_C):
    """What each block costs at joint angles, for the goal in `work`."""
    place(t, work, q_N)
    for c in range(len(cost_C)):
        found = alike(cost_C[0], 0.0)
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
def _keep(t, tried, frames, count, keep):
    """The cheapest of so many hypotheses of each frame, block by block, into `kept_ZN`; and the best of all."""
    cost_ZCL, q_ZNL, kept_ZNL = inside(tried.cost_ZC), inside(tried.q_ZN), inside(tried.kept_ZN)
    for f in range(frames):
        for c in range(size(t, FIRST_C) - 1):
            for k in range(keep):
                least, lowest = 0, np.inf
                for j in range(count):
                    z = j * frames + f
                    own = cost_ZCL[z // LANES, c, z % LANES]
                    if own < lowest or j == 0:
                        least, lowest = z, own
                better = k == 0 and lowest < tried.best_FC[f, c]
                if better:
                    tried.best_FC[f, c] = lowest
                cost_ZCL[least // LANES, c, least % LANES] = np.inf
                z = k * frames + f
                for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                    n = whole(t, ORDER_N, x)
                    kept_ZNL[z // LANES, n, z % LANES] = q_ZNL[least // LANES, n, least % LANES]
                    if better:
                        tried.best_FN[f, n] = q_ZNL[least // LANES, n, least % LANES]


@njit(**INNER)
def _look(t, u, work, tried, room, z, first, learnt):
    """Steps from what is kept, and what the network sees there."""
    for n in range(len(work.start_N)):
        work.start_N[n] = tried.kept_ZN[z, n]
    quadratic(t, work, work.start_N, work.cost_C, work.gradient_N, work.hessian_NN)
    for c in range(len(work.cost_C)):
        for p in range(SEEN_STEPS if learnt else _FINAL):
            step(t, work, work.start_N, c, DAMPINGS[p] if learnt else FINAL_DAMPINGS[min(p, _FINAL - 1)])
            for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                n = whole(t, ORDER_N, x)
                tried.step_ZPN[z, p, n] = work.step_N[n]
        if learnt:
            see(t, u, work, room, tried.step_ZPN, z, c, first)


@njit(**INNER)
def _go(t, u, work, tried, room, z, frames, first, way):
    """Goes from what is kept as the network says, or, beyond its ways, by a step; what costs less is taken."""
    if way < 0:
        for n in range(len(tried.other_N)):
            tried.other_N[n] = tried.kept_ZN[z, n] + tried.step_ZPN[z, -1 - way, n]
    else:
        move(t, u, room, tried.step_ZPN, tried.kept_ZN, z, frames if first else 0, tried.out_4, tried.step_P,
             tried.other_N)  # fmt: skip
    cost(t, work, tried.other_N, tried.other_C)


@njit(**INNER)
def unroll(t, u, w, work, tried, room, frames):
    """Five iterations for the goals in `work`; the answers stand in `tried.best_FN`. How many frames there are divides
    the lanes.

    One after the other in a loop, as each place that calls a function is compiled by itself.
    """
    joints, blocks, count = len(work.start_N), len(work.cost_C), 1
    for n in range(joints):
        tried.kept_ZN[0, n] = (real(t, LOWER_N, n) + real(t, UPPER_N, n)) / 2
    for turn in range(_TURNS + 1):
        first, learnt = turn == 0, turn <= REFINED
        if not first:
            keep = min(KEPT[min(turn, len(KEPT)) - 1], count)
            _keep(t, tried, frames, count, keep)
            count = keep
            if turn == _TURNS:
                break
        packs = -(-count * frames // LANES)
        for z in range(packs):
            _look(t, u, work, tried, room, z, first, learnt)
            if first:
                for f in range(frames):
                    for c in range(blocks):
                        tried.best_FC[f, c] = inside(work.cost_C)[c, f]
                    for n in range(joints):
                        tried.best_FN[f, n] = inside(work.start_N)[n, f]
            if learnt:
                answer(t, w, room, first, min(LANES, count * frames - z * LANES), z)
        if first:
            count = u.hypotheses
        for z in range(-(-count * frames // LANES)):
            for way in range(1 if first else 2):
                _go(t, u, work, tried, room, z, frames, first, 0 if learnt and way == 0 else -1 if learnt else -1 - way)
                for c in range(blocks):
                    better = (tried.other_C[c] < tried.cost_ZC[z, c]) | (way == 0)
                    tried.cost_ZC[z, c] = choose(better, tried.other_C[c], tried.cost_ZC[z, c])
                    for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                        n = whole(t, ORDER_N, x)
                        tried.q_ZN[z, n] = choose(better, tried.other_N[n], tried.q_ZN[z, n])
    unknown = False
    for n in range(joints):
        work.start_N[n] = (real(t, LOWER_N, n) + real(t, UPPER_N, n)) / 2
        unknown |= not u.known_C[whole(t, BLOCK_N, n)]
    if unknown:
        minimise(t, work, work.start_N, STEPS)
        for n in range(joints):
            if not u.known_C[whole(t, BLOCK_N, n)]:
                for f in range(frames):
                    tried.best_FN[f, n] = inside(work.start_N)[n, f]
