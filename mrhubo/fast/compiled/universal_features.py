"""What the universal network (`mrhubo.universal.network`) sees of a robot, and how its outputs are read.

Legend: N joints, C blocks, D directions, S = 5 slots, P damped steps; T tokens and X blocks of
`mrhubo.fast.compiled.universal_network`; Z and L as in `mrhubo.fast.compiled.universal`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.functions import asinh, exponential, logarithm, tanh
from mrhubo.fast.compiled.human import add, dot, row, row3, turn_back
from mrhubo.fast.compiled.lane_arrays import inside, scatter
from mrhubo.fast.compiled.lanes import LANES, alike, choose
from mrhubo.fast.compiled.tables import (
    FIRST_C,
    INNER,
    LOWER_N,
    MIDDLE_N,
    ORDER_N,
    SEEN_D,
    UPPER_N,
    real,
    whole,
)
from mrhubo.fast.compiled.universal_network import OUTPUTS
from mrhubo.fast.description import Description
from mrhubo.fast.plain.universal import DAMPINGS, REACH
from mrhubo.fast.sections import Universal

SEEN_STEPS = len(DAMPINGS)
"""How many steps the network sees."""


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


@njit(**INNER)
def see(t, u, work, room, step_ZPN, z, c, first):
    """Features of a block and its joints, whose model stands in `work`, where the hypotheses in `work.start_N` are."""
    blocks, joints = len(work.cost_C), len(work.start_N)
    for s in range(5):
        d = u.slot_CS[c, s]
        weight = work.weight_D[max(d, 0)] * (1.0 if d >= 0 else 0.0)
        own = turn_back(work.view_V33, whole(t, SEEN_D, max(d, 0)), row(work.direction_D3, max(d, 0)))
        goal, there = row(work.goal_D3, max(d, 0)), choose(weight > 0, 1.0, 0.0)
        for j in range(3):
            scatter(own[j] * there * u.flip_CS3[c, s, j], room.seen_XF, c, blocks, 3 * s + j)
            scatter(goal[j] * there * u.flip_CS3[c, s, j], room.seen_XF, c, blocks, 15 + 3 * s + j)
        root = math.sqrt(weight)
        scatter(root, room.seen_XF, c, blocks, 30 + s)
        for x in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
            n = whole(t, ORDER_N, x)
            turned = turn_back(work.view_V33, whole(t, SEEN_D, max(d, 0)), row3(work.jacobian_DN3, max(d, 0), n))
            pull = dot(turned, add(own, goal, -1.0)) * weight * u.sense_N[n]
            for j in range(3):
                scatter(
                    turned[j] * root * (u.flip_CS3[c, s, j] * u.sense_N[n]), room.feature_TF, x, joints, 3 + 3 * s + j
                )
            scatter(pull, room.feature_TF, x, joints, 18 + s)
    scatter(logarithm(work.cost_C[c] + 1e-4) * 0.2, room.seen_XF, c, blocks, 35)
    scatter(alike(work.cost_C[c], 1.0 if first else 0.0), room.seen_XF, c, blocks, 36)
    begin, end = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
    for x in range(begin, end):
        n = whole(t, ORDER_N, x)
        axis = turn_back(work.view_V33, u.view_C[c], row(work.axis_A3, u.joint_N[n]))
        for j in range(3):
            scatter(axis[j] * (u.axial_C3[c, j] * u.sense_N[n]), room.feature_TF, x, joints, j)
        for p in range(SEEN_STEPS):
            moved = step_ZPN[z, p, n] * u.sense_N[n]
            scatter(min(max(moved, -1.5), 1.5), room.feature_TF, x, joints, 23 + p)
            scatter(asinh(10 * moved), room.feature_TF, x, joints, 26 + p)
        _see_joint(t, u, work, room.feature_TF, x, n)
        scatter(alike(work.cost_C[c], 1 / (end - begin)), room.feature_TF, x, joints, 43)


@njit(**INNER)
def _see_joint(t, u, work, feature_TF, x, n):
    q, gradient, diagonal, sense = work.start_N[n], work.gradient_N[n], work.hessian_NN[n, n], u.sense_N[n]
    lower, upper, joints = real(t, LOWER_N, n), real(t, UPPER_N, n), len(work.start_N)
    above, below, half = upper - q, q - lower, (upper - lower) / 2
    frozen = ((below <= 0) & (gradient > 0)) | ((above <= 0) & (gradient < 0))
    up, down = above, below
    if sense < 0:
        up, down = below, above
    near_up, near_down = exponential(max(-2 * up, -100.0)), exponential(max(-2 * down, -100.0))
    away = (q - real(t, MIDDLE_N, n)) * sense
    numbers = (
        asinh(30 * gradient * sense), math.sqrt(max(diagonal, 0.0)), diagonal, min(up, 3.0), min(down, 3.0),
        _fifth(near_up), _fifth(near_down), near_up, near_down, away * (1 / half), alike(q, min(half, 3.0)),
        alike(q, 1.0), choose(frozen, 0.0, 1.0), min(max(away, -3.0), 3.0),
    )  # fmt: skip
    for k in range(len(numbers)):
        scatter(numbers[k], feature_TF, x, joints, 29 + k)


@njit(**INNER)
def _fifth(x):
    return x * x * (x * x) * x


@njit(**INNER)
def move(t, u, room, step_ZPN, kept_ZN, z, frames, out_4, step_P, other_N):
    """The network's next angles, from outputs of what is kept, into `other_N`. Of so many frames, the first of whose
    hypotheses they are, a lane is the hypothesis after those in the lanes and packs before it; 0: it is its own one's
    only answer. `out_4` and `step_P`: room.
    """
    joints, lane_OL, lane_PL = len(other_N), inside(out_4), inside(step_P)
    out_TO, step_ZPNL = room.out_TO, inside(step_ZPN)
    for place in range(joints):
        n = whole(t, ORDER_N, place)
        begin = kept_ZN[0 if frames else z, n]
        for lane in range(LANES):
            from_z, from_lane, at = z, lane, 0
            if frames:
                from_z, from_lane = 0, lane % frames
                at = OUTPUTS * min((z * LANES + lane) // frames, u.hypotheses - 1)
            i = (from_z * LANES + from_lane) * joints + place
            for o in range(OUTPUTS):
                lane_OL[o, lane] = out_TO[i, at + o]
            for p in range(SEEN_STEPS):
                lane_PL[p, lane] = step_ZPNL[from_z, p, n, from_lane]
        most = max(max(out_4[0], out_4[1]), out_4[2])
        total, moved = alike(most, 0.0), alike(most, 0.0)
        for p in range(SEEN_STEPS):
            share = exponential(max(out_4[p] - most, -100.0))
            total += share
            moved += share * step_P[p]
        moved = moved / total + REACH * tanh(out_4[3]) * u.sense_N[n]
        other_N[n] = min(max(begin + moved, real(t, LOWER_N, n)), real(t, UPPER_N, n))
