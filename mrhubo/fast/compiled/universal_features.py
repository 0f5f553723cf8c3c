"""What the universal network (`mrhubo.universal.network`) sees of a robot, and how its outputs are read.

Legend: N joints, C blocks, D directions, S = 5 slots, P damped steps; T tokens and X blocks of
`mrhubo.fast.compiled.universal_network`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.human import add, dot, put, row, row3, turn_back
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
from mrhubo.fast.compiled.universal_network import exponential
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
def see(t, u, work, room, miss_S3, step_PN, q_N, k, c, first):
    """Features of a block and its joints, whose model stands in `work`, as the `k`th hypothesis. `miss_S3`: room."""
    seen_XF, blocks = room.seen_XF, len(work.cost_C)
    x, token = k * blocks + c, k * len(q_N)
    for s in range(5):
        d = u.slot_CS[c, s]
        weight = work.weight_D[d] if d >= 0 else 0.0
        own, goal = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if weight > 0:
            own = turn_back(work.view_V33, whole(t, SEEN_D, d), row(work.direction_D3, d))
            goal = row(work.goal_D3, d)
        put(miss_S3, s, add(own, goal, -1.0))
        for j in range(3):
            seen_XF[x, 3 * s + j] = own[j] * u.flip_CS3[c, s, j]
            seen_XF[x, 15 + 3 * s + j] = goal[j] * u.flip_CS3[c, s, j]
        seen_XF[x, 30 + s] = math.sqrt(weight)
    seen_XF[x, 35] = math.log(work.cost_C[c] + 1e-4) / 5
    seen_XF[x, 36] = 1.0 if first else 0.0
    begin, end = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)
    for i in range(begin, end):
        n = whole(t, ORDER_N, i)
        line_F, sense = room.feature_TF[token + i], u.sense_N[n]
        axis = turn_back(work.view_V33, u.view_C[c], row(work.axis_A3, u.joint_N[n]))
        for j in range(3):
            line_F[j] = axis[j] * u.axial_C3[c, j] * sense
        for s in range(5):
            d = u.slot_CS[c, s]
            if d >= 0:
                root = seen_XF[x, 30 + s] * sense
                own = turn_back(work.view_V33, whole(t, SEEN_D, d), row3(work.jacobian_DN3, d, n))
                for j in range(3):
                    line_F[3 + 3 * s + j] = own[j] * u.flip_CS3[c, s, j] * root
                line_F[18 + s] = dot(own, row(miss_S3, s)) * work.weight_D[d] * sense
        _see_joint(t, work, step_PN, line_F, q_N[n], n, sense)
        line_F[43] = 1.0 / (end - begin)


@njit(**INNER)
def _asinh(x):
    return math.copysign(math.log(abs(x) + math.sqrt(x * x + 1)), x)


@njit(**INNER)
def _see_joint(t, work, step_PN, line_F, q, n, sense):
    gradient, diagonal = work.gradient_N[n], work.hessian_NN[n, n]
    lower, upper = real(t, LOWER_N, n), real(t, UPPER_N, n)
    up, down, half = upper - q, q - lower, (upper - lower) / 2
    frozen = (down <= 0 and gradient > 0) or (up <= 0 and gradient < 0)
    if sense < 0:
        up, down = down, up
    for p in range(SEEN_STEPS):
        moved = step_PN[p, n] * sense
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
def move(t, u, room, step_PN, q_N, k, at, out_N):
    """The network's next angles from `q_N`, the `k`th hypothesis, by outputs from a column on, into `out_N`."""
    out_TO = room.out_TO
    for place in range(len(q_N)):
        n, i = whole(t, ORDER_N, place), k * len(q_N) + place
        most = max(max(out_TO[i, at], out_TO[i, at + 1]), out_TO[i, at + 2])
        total, moved = 0.0, 0.0
        for p in range(SEEN_STEPS):
            share = exponential(out_TO[i, at + p] - most)
            total += share
            moved += share * step_PN[p, n]
        moved = moved / total + REACH * math.tanh(out_TO[i, at + 3]) * u.sense_N[n]
        out_N[n] = min(max(q_N[n] + moved, real(t, LOWER_N, n)), real(t, UPPER_N, n))
