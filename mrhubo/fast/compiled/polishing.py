"""As `mrhubo.fast.compiled.steps.polish` and `mrhubo.fast.compiled.avoidance.avoid`, for many frames, as many side by
side as there are lanes.

Legend: B frames, D directions, N joints, C blocks, L lanes, F lanes that have a frame of their own.
"""

from __future__ import annotations

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.avoidance import avoid
from mrhubo.fast.compiled.collision import touches
from mrhubo.fast.compiled.lane_arrays import inside, zeros
from mrhubo.fast.compiled.lanes import LANES, choose, filled
from mrhubo.fast.compiled.robot import make_lane_work, make_work, place
from mrhubo.fast.compiled.steps import aim, minimise, near
from mrhubo.fast.compiled.tables import (
    BLOCK_N,
    FAR,
    FIRST_C,
    FIRST_STEPS,
    GAIN,
    INNER,
    POLISH_4,
    STARTS,
    real,
    size,
    whole,
)


@njit(**INNER)
def aim_at(t, work, target_1D3, target_BD3, frame_L):
    """Takes as goals the directions of a frame in each lane. `target_1D3`: room."""
    target_1D3L = inside(target_1D3)
    for lane in range(LANES):
        for d in range(target_BD3.shape[1]):
            for i in range(3):
                target_1D3L[0, d, i, lane] = target_BD3[frame_L[lane], d, i]
    aim(t, work, target_1D3, 0)


@njit(**INNER)
def _begin(work, q_BN, frame_L):
    start_NL = inside(work.start_N)
    for lane in range(LANES):
        for n in range(q_BN.shape[1]):
            start_NL[n, lane] = q_BN[frame_L[lane], n]


@njit(**INNER)
def polish_all(t, target_BD3, q_BN, steps):
    """Steps from `q_BN` [rad], and from other places for blocks that are far off then; the answers stand in `q_BN`."""
    work, alone, target_1D3 = make_lane_work(t), make_work(t), zeros(filled(0.0), (1, target_BD3.shape[1], 3))
    frames, joints, blocks = len(q_BN), q_BN.shape[1], size(t, FIRST_C) - 1
    far_B, far, frame_L = np.empty(frames, np.intp), 0, np.empty(LANES, np.intp)
    enough_BC = np.empty((frames, blocks))
    for first in range(0, frames, LANES):
        for lane in range(LANES):
            frame_L[lane] = min(first + lane, frames - 1)
        aim_at(t, work, target_1D3, target_BD3, frame_L)
        _begin(work, q_BN, frame_L)
        minimise(t, work, work.start_N, steps)
        cost_CL, weight_CL, start_NL = inside(work.cost_C), inside(work.weight_C), inside(work.start_N)
        for lane in range(min(LANES, frames - first)):
            b, is_far = first + lane, False
            for n in range(joints):
                q_BN[b, n] = start_NL[n, lane]
            for c in range(blocks):
                enough_BC[b, c] = -np.inf
                if cost_CL[c, lane] > weight_CL[c, lane] * real(t, POLISH_4, FAR):
                    enough_BC[b, c] = cost_CL[c, lane] - weight_CL[c, lane] * real(t, POLISH_4, GAIN)
                    is_far = True
            if is_far and steps:
                far_B[far] = b
                far += 1
    for first in range(0, far, LANES):
        for lane in range(LANES):
            frame_L[lane] = far_B[min(first + lane, far - 1)]
        aim_at(t, work, target_1D3, target_BD3, frame_L)
        _start_again(t, work, alone, target_BD3, q_BN, enough_BC, frame_L, steps, min(LANES, far - first))


@njit(**INNER)
def _start_again(t, work, alone, target_BD3, q_BN, enough_BC, frame_L, steps, count):
    """From other places, for the goals in `work`: a few steps from each; on from the best of them."""
    joints, blocks, starts = q_BN.shape[1], enough_BC.shape[1], int(real(t, POLISH_4, STARTS))
    start_NL, begin_NL = inside(work.start_N), inside(work.begin_N)
    best_CL, cost_CL = inside(work.best_C), inside(work.cost_C)
    best_CL[:] = np.inf
    for number in range(starts + 1):
        last = number == starts
        for lane in range(count):
            b = frame_L[lane]
            for n in range(joints):
                start_NL[n, lane] = begin_NL[n, lane] if last else q_BN[b, n]
            if last:
                continue
            for c in range(blocks):
                if enough_BC[b, c] > -np.inf:
                    near(t, alone, target_BD3, b, c, number, alone.start_N)
                    for n in range(joints):
                        if whole(t, BLOCK_N, n) == c:
                            start_NL[n, lane] = alone.start_N[n]
        for lane in range(count, LANES):
            for n in range(joints):
                start_NL[n, lane] = start_NL[n, count - 1]
        minimise(t, work, work.start_N, steps if last else min(steps, int(real(t, POLISH_4, FIRST_STEPS))))
        for lane in range(count):
            b = frame_L[lane]
            for c in range(blocks):
                found = cost_CL[c, lane]
                if not last and found < best_CL[c, lane]:
                    best_CL[c, lane] = found
                    for n in range(joints):
                        if whole(t, BLOCK_N, n) == c:
                            begin_NL[n, lane] = start_NL[n, lane]
                if last and found < enough_BC[b, c]:
                    for n in range(joints):
                        if whole(t, BLOCK_N, n) == c:
                            q_BN[b, n] = start_NL[n, lane]


@njit(**INNER)
def avoid_all(t, target_BD3, q_BN, near_B):
    """Steps away from self-collision from `q_BN` [rad], where the answers will stand, of the frames that need them;
    `near_B` tells which those are.
    """
    work, target_1D3 = make_lane_work(t), zeros(filled(0.0), (1, target_BD3.shape[1], 3))
    frames, joints = len(q_BN), q_BN.shape[1]
    near_F, near, frame_L = np.empty(frames, np.intp), 0, np.empty(LANES, np.intp)
    start_NL, near_CL = inside(work.start_N), inside(work.own_cost_C)
    for first in range(0, frames, LANES):
        for lane in range(LANES):
            frame_L[lane] = min(first + lane, frames - 1)
        _begin(work, q_BN, frame_L)
        place(t, work, work.start_N)
        work.own_cost_C[0] = choose(touches(t, work, True), filled(1.0), 0.0)
        for lane in range(min(LANES, frames - first)):
            b = first + lane
            near_B[b] = near_CL[0, lane] > 0
            if near_B[b]:
                near_F[near] = b
                near += 1
    for first in range(0, near, LANES):
        for lane in range(LANES):
            frame_L[lane] = near_F[min(first + lane, near - 1)]
        aim_at(t, work, target_1D3, target_BD3, frame_L)
        _begin(work, q_BN, frame_L)
        avoid(t, work, work.start_N, False)
        for lane in range(min(LANES, near - first)):
            for n in range(joints):
                q_BN[frame_L[lane], n] = start_NL[n, lane]
