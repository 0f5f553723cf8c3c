"""As `mrhubo.fast.plain.robot`, for one frame, or for several side by side (`mrhubo.fast.compiled.lanes`)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.functions import sine_cosine
from mrhubo.fast.compiled.human import add, cross, dot, identity, put, put3, row, row3, turn
from mrhubo.fast.compiled.lane_arrays import room, zeros
from mrhubo.fast.compiled.lanes import alike, filled
from mrhubo.fast.compiled.tables import (
    ACROSS_A33,
    AXIS_A3,
    BLOCK_N,
    BODY_G,
    BODY_H,
    BODY_S,
    CLEAR_Y,
    COLUMN_A,
    COLUMN_Q,
    DIRECTION_Q,
    END_BODY_D,
    END_D3,
    FACTOR_Q4,
    FIRST_C,
    INNER,
    JOINT_Q,
    LIMB_D,
    LOWER_N,
    OFFSET_A,
    ORIGIN_A33,
    PARENT_A,
    POOL_CU,
    POSITION_A3,
    RATIO_A,
    ROTARY_A,
    START_BODY_D,
    START_D3,
    TWICE_A33,
    UPPER_N,
    VIEW_BODY_V,
    VIEW_V33,
    real,
    size,
    vector,
    whole,
)


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
    ends_S3: np.ndarray
    """Both ends of each capsule, then twice the middle of each."""
    centre_G3: np.ndarray
    """Middles of the balls."""
    contact_N: np.ndarray
    wanted_H3: np.ndarray
    """Where points of soles are to be [m], seen from what carries the legs,"""
    counts_H: np.ndarray
    """and how much that counts [1/m^2]; 0: not at all."""
    sole_N3: np.ndarray
    carrier_133: np.ndarray
    """Human axes of what carries the legs, base frame."""
    score_U: np.ndarray
    """What poses of the pool cost, float32."""
    right_N: np.ndarray
    """Right side and solution of a block's system, in its order;"""
    free_N: np.ndarray
    """1 for its joints that move, 0 for those that are held."""
    short_Y: np.ndarray
    """Pairs within reach (`mrhubo.fast.compiled.contact_steps`): the root of what each costs,"""
    rows_YN: np.ndarray
    """how that changes with the joints [1/rad],"""
    along_Y: np.ndarray
    """how it changes with a turn,"""
    lack_Y: np.ndarray
    """and what it is after the turns before."""
    slope_N: np.ndarray
    """Of what has no bend there;"""
    extra_N: np.ndarray
    """what damping adds to the Hessian's diagonal;"""
    bent_N: np.ndarray
    """and how the slope changes with a turn."""


@njit(**INNER)
def make_work(t):
    """Room for one frame."""
    return _make_work(t, 0.0)


@njit(**INNER)
def make_lane_work(t):
    """Room for as many frames as there are lanes, on which the same functions work."""
    return _make_work(t, filled(0.0))


@njit(**INNER)
def _make_work(t, kind):
    bodies, joints, directions = size(t, PARENT_A) + 1, size(t, BLOCK_N), size(t, LIMB_D)
    blocks, soles, pairs = size(t, FIRST_C) - 1, size(t, BODY_H), size(t, CLEAR_Y)
    rotation_L33 = zeros(kind, (bodies, 3, 3))
    identity(rotation_L33, 0)
    lower_N, upper_N = zeros(kind, (joints,)), zeros(kind, (joints,))
    for n in range(joints):
        lower_N[n], upper_N[n] = real(t, LOWER_N, n), real(t, UPPER_N, n)
    return Work(
        rotation_L33,
        zeros(kind, (bodies, 3)),
        zeros(kind, (bodies - 1, 3)),
        zeros(kind, (directions, 3)),
        zeros(kind, (directions, 3)),
        zeros(kind, (directions, 3)),
        zeros(kind, (directions,)),
        zeros(kind, (size(t, VIEW_BODY_V), 3, 3)),
        zeros(kind, (directions, joints, 3)),
        zeros(kind, (directions, 3)),
        zeros(kind, (directions,)),
        zeros(kind, (blocks,)),
        zeros(kind, (joints,)),
        zeros(kind, (joints, joints)),
        zeros(kind, (blocks,)),
        zeros(kind, (joints,)),
        zeros(kind, (joints, joints)),
        zeros(kind, (joints,)),
        zeros(kind, (blocks,)),
        zeros(kind, (joints, joints)),
        zeros(kind, (joints,)),
        zeros(kind, (blocks,)),
        lower_N,
        upper_N,
        zeros(kind, (blocks,)),
        zeros(kind, (blocks,)),
        zeros(kind, (joints,)),
        zeros(kind, (joints,)),
        zeros(kind, (3 * size(t, BODY_S), 3)),
        zeros(kind, (size(t, BODY_G), 3)),
        zeros(kind, (joints,)),
        zeros(kind, (soles, 3)),
        zeros(kind, (soles,)),
        zeros(kind, (joints, 3)),
        zeros(kind, (1, 3, 3)),
        np.empty(size(t, POOL_CU) // blocks, np.float32),
        zeros(kind, (joints,)),
        zeros(kind, (joints,)),
        room(kind, (pairs,)),
        room(kind, (pairs, joints)),
        room(kind, (pairs,)),
        room(kind, (pairs,)),
        zeros(kind, (joints,)),
        zeros(kind, (joints,)),
        zeros(kind, (joints,)),
    )


@njit(**INNER)
def _column(t, key, place):
    """Three numbers of a table of float64 that stand below each other in a matrix (3, 3)."""
    return real(t, key, place), real(t, key, place + 3), real(t, key, place + 6)


@njit(**INNER)
def place(t, work, q_N):
    """Bodies and directions at joint angles [rad], base frame."""
    rotation_L33, position_L3 = work.rotation_L33, work.position_L3
    for a in range(size(t, PARENT_A)):
        angle = q_N[whole(t, COLUMN_A, a)] * real(t, RATIO_A, a) + real(t, OFFSET_A, a)
        parent = whole(t, PARENT_A, a)
        sine, rest, slide = alike(angle, 0.0), alike(angle, 0.0), angle
        if whole(t, ROTARY_A, a):
            sine, cosine = sine_cosine(angle)
            rest, slide = 1 - cosine, alike(angle, 0.0)
        for j in range(3):
            x = 9 * a + j
            column = add(_column(t, ORIGIN_A33, x), _column(t, ACROSS_A33, x), sine)
            column = turn(rotation_L33, parent, add(column, _column(t, TWICE_A33, x), rest))
            rotation_L33[a + 1, 0, j], rotation_L33[a + 1, 1, j], rotation_L33[a + 1, 2, j] = column
        moved = turn(rotation_L33, parent, vector(t, POSITION_A3, a))
        axis = turn(rotation_L33, a + 1, vector(t, AXIS_A3, a))
        put(work.axis_A3, a, axis)
        above = row(position_L3, parent)
        put(position_L3, a + 1, (
            above[0] + moved[0] + slide * axis[0], above[1] + moved[1] + slide * axis[1],
            above[2] + moved[2] + slide * axis[2],
        ))  # fmt: skip
    for v in range(size(t, VIEW_BODY_V)):
        for j in range(3):
            column = turn(rotation_L33, whole(t, VIEW_BODY_V, v), _column(t, VIEW_V33, 9 * v + j))
            work.view_V33[v, 0, j], work.view_V33[v, 1, j], work.view_V33[v, 2, j] = column
    for d in range(size(t, LIMB_D)):
        end_body = whole(t, END_BODY_D, d)
        end = turn(rotation_L33, end_body, vector(t, END_D3, d))
        along = end
        if whole(t, LIMB_D, d):  # others begin at 0
            start_body = whole(t, START_BODY_D, d)
            start = add(turn(rotation_L33, start_body, vector(t, START_D3, d)), row(position_L3, start_body), 1.0)
            end = add(end, row(position_L3, end_body), 1.0)
            along = add(end, start, -1.0)
            put(work.start_D3, d, start)
        put(work.end_D3, d, end)
        length = math.sqrt(dot(along, along))
        work.length_D[d] = length
        put(work.direction_D3, d, (along[0] / length, along[1] / length, along[2] / length))


@njit(**INNER)
def jacobian(t, work):
    """How directions change by joints [1/rad], as they are seen from their parts, base frame."""
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
