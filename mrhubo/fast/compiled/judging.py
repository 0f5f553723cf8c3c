"""As `mrhubo.fast.plain.judging`, for one frame."""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.human import (
    bend_axis,
    cross,
    dot,
    identity,
    multiply,
    orthonormal,
    put3,
    row,
    row3,
    turn,
    turn_back,
    unit,
)
from mrhubo.fast.compiled.networks import mlp
from mrhubo.fast.compiled.tables import (
    AXIS_T33,
    COLUMN_XD,
    COUNT_6,
    DIRECTION_K3,
    EXCESS,
    GOOD,
    INNER,
    KIND_K,
    LAST_K,
    LIMIT_T32,
    MIRROR_T,
    OF_K,
    PARENT_T,
    REST_K23,
    SCALE_4,
    SEEN_D,
    SEEN_K,
    SHAKE,
    SHARE_K,
    SLOT_K,
    SLOT_XT,
    STAGES,
    USUAL_PHI,
    WEIGHT_25,
    real,
    size,
    vector,
    whole,
)
from mrhubo.fast.plain.judging import SHORT
from mrhubo.fast.sections import BEND, LIMB, ORIENT, SHARE

_TINY = 1e-12


@njit(**INNER)
def _rodrigues(axis, sine, cosine, out, k):
    """out[k]: a turn about a unit axis."""
    x, y, z = axis
    rest = 1 - cosine
    put3(out, k, 0, (1 - rest * (y * y + z * z), rest * x * y - sine * z, rest * x * z + sine * y))
    put3(out, k, 1, (rest * x * y + sine * z, 1 - rest * (x * x + z * z), rest * y * z - sine * x))
    put3(out, k, 2, (rest * x * z - sine * y, rest * y * z + sine * x, 1 - rest * (x * x + y * y)))


@njit(**INNER)
def _columns(first, second, out, k):
    third = cross(first, second)
    for i in range(3):
        out[k, i, 0], out[k, i, 1], out[k, i, 2] = first[i], second[i], third[i]


@njit(**INNER)
def _times_transposed(a, i, b, j, out, k):
    """out[k] = a[i] b[j]^T"""
    for x in range(3):
        for y in range(3):
            out[k, x, y] = dot(row3(a, i, x), row3(b, j, y))


@njit(**INNER)
def quaternion(m, k):
    """x, y, z, w with w >= 0 of a rotation m[k]."""
    xy, xz, yz = m[k, 0, 1] + m[k, 1, 0], m[k, 0, 2] + m[k, 2, 0], m[k, 1, 2] + m[k, 2, 1]
    xw, yw, zw = m[k, 2, 1] - m[k, 1, 2], m[k, 0, 2] - m[k, 2, 0], m[k, 1, 0] - m[k, 0, 1]
    a, b, c = m[k, 0, 0], m[k, 1, 1], m[k, 2, 2]
    x, y, z, w = 1 + a - b - c, 1 + b - c - a, 1 + c - a - b, 1 + a + b + c
    longest = max(max(x, y), max(z, w))
    if x == longest:
        found = (x, xy, xz, xw)
    elif y == longest:
        found = (xy, y, yz, yw)
    elif z == longest:
        found = (xz, yz, z, zw)
    else:
        found = (xw, yw, zw, w)
    scale = 1 / math.sqrt(found[0] * found[0] + found[1] * found[1] + found[2] * found[2] + found[3] * found[3])
    if found[3] < 0:
        scale = -scale
    return found[0] * scale, found[1] * scale, found[2] * scale, found[3] * scale


@njit(**INNER)
def read_pose(t, target_BD3, b, turn_T33, between_333, local_T33):
    """Local rotations of the turned joints of a person at rest but for these directions."""
    identity(turn_T33, 0)
    for k in range(size(t, KIND_K)):
        kind, before, seen = whole(t, KIND_K, k), whole(t, OF_K, k), whole(t, SEEN_K, k)
        one = turn(turn_T33, seen, row3(target_BD3, b, whole(t, DIRECTION_K3, 3 * k)))
        axis, sine, cosine = (1.0, 0.0, 0.0), 0.0, 1.0
        if kind == LIMB:
            start = turn(turn_T33, before, vector(t, REST_K23, 2 * k))
            across = cross(start, one)
            length = math.sqrt(dot(across, across))
            if length > SHORT:
                axis, sine, cosine = unit(across), length, dot(start, one)
        elif kind == BEND:
            two = turn(turn_T33, seen, row3(target_BD3, b, whole(t, DIRECTION_K3, 3 * k + 1)))
            own = turn(turn_T33, before, vector(t, REST_K23, 2 * k))
            told, third = own, whole(t, DIRECTION_K3, 3 * k + 2)
            if third >= 0:
                told = turn(turn_T33, seen, row3(target_BD3, b, third))
            bend, _ = bend_axis(t, one, two, told)
            axis, sine, cosine = one, dot(one, cross(own, bend)), dot(own, bend) - dot(own, one) * dot(bend, one)
        else:
            two = turn(turn_T33, seen, row3(target_BD3, b, whole(t, DIRECTION_K3, 3 * k + 1)))
            _columns(one, two, between_333, 0)
            _columns(vector(t, REST_K23, 2 * k), vector(t, REST_K23, 2 * k + 1), between_333, 1)
            _times_transposed(between_333, 0, between_333, 1, between_333, 2)
        if kind == SHARE:
            _times_transposed(between_333, 2, turn_T33, whole(t, LAST_K, k), between_333, 1)
            x, y, z, w = quaternion(between_333, 1)
            angle = 2 * real(t, SHARE_K, k) * math.atan2(math.sqrt(x * x + y * y + z * z), w)
            axis, sine, cosine = unit((x, y, z)), math.sin(angle), math.cos(angle)
        if kind == ORIENT:
            _times_transposed(between_333, 2, turn_T33, before, between_333, 0)
        else:
            length = math.sqrt(sine * sine + cosine * cosine)
            if length == 0:
                length, cosine = 1.0, 1.0
            _rodrigues(axis, sine / length, cosine / length, between_333, 0)
        multiply(between_333, 0, turn_T33, before, between_333, 1)
        slot = whole(t, SLOT_K, k)
        for i in range(3):
            put3(turn_T33, slot, i, row3(between_333, 1, i))
    for j in range(size(t, PARENT_T)):
        parent = whole(t, PARENT_T, j)
        for x in range(3):
            column = turn_back(turn_T33, parent, (turn_T33[j + 1, 0, x], turn_T33[j + 1, 1, x], turn_T33[j + 1, 2, x]))
            local_T33[j, 0, x], local_T33[j, 1, x], local_T33[j, 2, x] = column


@njit(**INNER)
def excess(t, j, local_T33):
    """By how much a turned joint leaves its anatomical range [rad], at its worst angle."""
    x, y, z, scalar = quaternion(local_T33, j)
    if whole(t, MIRROR_T, j):
        y, z = -y, -z
    pointing, axis = (x, y, z), vector(t, AXIS_T33, 3 * j)
    along = dot(pointing, axis)
    twist = math.atan2(along, scalar if abs(scalar) + abs(along) > 1e-6 else 1.0)
    sine, cosine = math.sin(twist), math.cos(twist)
    half = (axis[0] * sine, axis[1] * sine, axis[2] * sine)
    swing_scalar = cosine * scalar + dot(half, pointing)
    aside = cross(half, pointing)
    swing = (
        cosine * x - scalar * half[0] - aside[0],
        cosine * y - scalar * half[1] - aside[1],
        cosine * z - scalar * half[2] - aside[2],
    )
    length = math.sqrt(dot(swing, swing) + _TINY)
    scale = 2 * math.atan2(length, swing_scalar) / length
    worst = 0.0
    for i in range(3):
        angle = 2 * twist if i == 0 else scale * dot(swing, vector(t, AXIS_T33, 3 * j + i))
        low, high = real(t, LIMIT_T32, 6 * j + 2 * i), real(t, LIMIT_T32, 6 * j + 2 * i + 1)
        worst = max(worst, max(angle - high, low - angle))
    return worst


@njit(**INNER)
def prior_input(local_T33, out_BF, k):
    """What the body prior's encoder sees of the turned joints, into row k."""
    for j in range(len(local_T33)):
        for column in range(2):
            for line in range(3):
                rest = 1.0 if line == column else 0.0
                out_BF[k, 6 * j + 3 * column + line] = np.float32(local_T33[j, line, column] - rest)


@njit(**INNER)
def reconstruct(t, activation, rooms, frames):
    """The body prior's six numbers for each turned joint, of its input; both stand in the first of `make_rooms`."""
    coder = whole(t, COUNT_6, STAGES)
    mlp(t, coder, activation, 0, rooms, frames)
    mlp(t, coder + 1, activation, 0, rooms, frames)


@njit(**INNER)
def joint_error(local_T33, j, six_BF, b, between_333):
    """Mean squared error of a joint's six numbers, which stand in row b."""
    f = 6 * j
    first = (np.float64(six_BF[b, f]), np.float64(six_BF[b, f + 1]), np.float64(six_BF[b, f + 2]))
    second = (np.float64(six_BF[b, f + 3]), np.float64(six_BF[b, f + 4]), np.float64(six_BF[b, f + 5]))
    orthonormal(first, second, between_333, 0)
    found = 0.0
    for i in range(3):
        for k in range(2):
            found += (between_333[0, i, k] - local_T33[j, i, k]) ** 2
    return found / 6


@njit(**INNER)
def angle_between(a, b):
    """Angle [rad] between vectors."""
    across = cross(a, b)
    return math.atan2(math.sqrt(dot(across, across)), dot(a, b))


@njit(**INNER)
def confidence(t, moving, miss_deg, phi, excess_deg, shake_deg):
    """Probability that a branch points where the person's did."""
    w = 0 if moving else 5
    logit = (
        real(t, WEIGHT_25, w)
        - real(t, WEIGHT_25, w + 1) * max(2 * miss_deg / real(t, SCALE_4, GOOD) - 1, 0.0)
        - real(t, WEIGHT_25, w + 2) * max(math.log(max(phi, _TINY) / real(t, SCALE_4, USUAL_PHI)), 0.0)
        - real(t, WEIGHT_25, w + 3) * excess_deg / real(t, SCALE_4, EXCESS)
        - real(t, WEIGHT_25, w + 4) * shake_deg / real(t, SCALE_4, SHAKE)
    )
    found = 1 / (1 + math.exp(-logit))
    return 0.0 if math.isnan(found) else found


@njit(**INNER)
def branch_signals(t, angle_D, error_T, excess_T, x):
    """Mean miss [degrees], phi and worst excess [degrees] of a branch."""
    directions, turned = len(angle_D), len(error_T)
    miss, columns, phi, joints, worst = 0.0, 0, 0.0, 0, 0.0
    for d in range(directions):
        if whole(t, COLUMN_XD, x * directions + d):
            miss, columns = miss + angle_D[d], columns + 1
    for j in range(turned):
        if whole(t, SLOT_XT, x * turned + j):
            phi, joints, worst = phi + error_T[j], joints + 1, max(worst, excess_T[j])
    return math.degrees(miss / columns), phi / joints, math.degrees(worst)


@njit(**INNER)
def robot_angles(t, work, target_BD3, b, angle_D):
    """Angles [rad] between the robot's directions, where they are placed, and the human's."""
    for d in range(len(angle_D)):
        own = turn_back(work.view_V33, whole(t, SEEN_D, d), row(work.direction_D3, d))
        angle_D[d] = angle_between(own, row3(target_BD3, b, d))
