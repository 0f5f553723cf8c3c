"""As `mrhubo.fast.plain.universal`, for one frame.

Legend: K hypotheses, P damped steps, N joints, C blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.cost import quadratic
from mrhubo.fast.compiled.human import add, dot, row, turn_back
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
from mrhubo.fast.compiled.universal_steps import Stepping, make_stepping, step
from mrhubo.fast.plain.universal import DAMPINGS, FINAL_DAMPINGS, KEPT, REFINED, STEPS

_MOST, _FINAL, _TURNS = max(KEPT), len(FINAL_DAMPINGS), 1 + len(KEPT)


class Tried(NamedTuple):
    """Hypotheses, the ways that they may go, and the best so far."""

    q_KN: np.ndarray
    cost_KC: np.ndarray
    kept_KN: np.ndarray
    step_KPN: np.ndarray
    best_N: np.ndarray
    best_C: np.ndarray
    other_N: np.ndarray
    other_C: np.ndarray
    miss_S3: np.ndarray
    stepping: Stepping


@njit(**INNER)
def make_tried(t, u):
    """Room for one frame."""
    joints, blocks, most = size(t, BLOCK_N), size(t, FIRST_C) - 1, max(u.hypotheses, _MOST)
    return Tried(
        np.empty((most, joints)), np.empty((most, blocks)), np.empty((_MOST, joints)),
        np.zeros((_MOST, SEEN_STEPS, joints)), np.empty(joints), np.empty(blocks), np.empty(joints), np.empty(blocks),
        np.empty((5, 3)), make_stepping(t),
    )  # fmt: skip


@njit(**INNER)
def make_layers(t, u, w):
    """Room for the network's layers."""
    return make_room(t, w, size(t, BLOCK_N), OUTPUTS * u.hypotheses, _MOST)


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
        first, learnt = turn == 0, turn <= REFINED
        if not first:
            keep = KEPT[min(turn, len(KEPT)) - 1]
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
                for p in range(SEEN_STEPS if learnt else _FINAL):
                    damping = DAMPINGS[p] if learnt else FINAL_DAMPINGS[min(p, _FINAL - 1)]
                    step(t, work, tried.stepping, kept_N, c, damping, tried.step_KPN[k, p])
                if learnt:
                    see(t, u, work, room, tried.miss_S3, tried.step_KPN[k], kept_N, k, c, first)
        if learnt:
            answer(t, w, room, first, count)
        for k in range(count):
            kept_N = tried.kept_KN[k]
            for way in range(u.hypotheses if first else 2):
                if first or (learnt and way == 0):
                    move(t, u, room, tried.step_KPN[k], kept_N, k, OUTPUTS * way, tried.other_N)
                else:
                    for n in range(joints):
                        tried.other_N[n] = kept_N[n] + tried.step_KPN[k, 0 if learnt else way, n]
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
