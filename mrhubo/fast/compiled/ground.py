"""As `mrhubo.fast.plain.ground`, for one frame.

Legend: H points of soles, R feet, L human joints, J = 21 posed joints, Y heights, D directions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.contacts import FLOOR, KNOWN, USUAL, smooth
from mrhubo.fast.compiled.human import add, cross, dot, put, row, turn, turn_back, unit
from mrhubo.fast.compiled.soles import carrier, turned_point
from mrhubo.fast.compiled.tables import (
    BALL_BODY_J,
    BALL_J3,
    BODY_H,
    BUILT_R23,
    FOOT_R2,
    HIP_R3,
    INNER,
    JOINT_L,
    LENGTH_R2,
    LIMB_R2,
    NEAR_HJ,
    OFFSET_L3,
    PARENT_L,
    POINT_H3,
    RADIUS_J,
    SCALE_1,
    SOLE_H,
    SOLE_H3,
    START_R,
    real,
    size,
    vector,
    whole,
)
from mrhubo.fast.plain.contacts import LIES, STANDS
from mrhubo.fast.plain.ground import FREE, PLANTED, RETURN_S, RETURN_SPEED, SETTLE_S, UNDER_M, USUAL_S


class Floor(NamedTuple):
    """What is remembered of the ground, as `mrhubo.fast.plain.ground.GroundState` and
    `mrhubo.fast.plain.contacts.LiveContacts` have it, and room to work in.
    """

    place_H3: np.ndarray
    velocity_H3: np.ndarray
    speed_H: np.ndarray
    planted_H: np.ndarray
    held_H: np.ndarray
    age_H: np.ndarray
    start_H3: np.ndarray
    weight_H: np.ndarray
    slow_Y: np.ndarray
    total_Y: np.ndarray
    number_4: np.ndarray
    path_3: np.ndarray
    turn_133: np.ndarray
    off_3: np.ndarray
    pointing_H3: np.ndarray
    anchor_H3: np.ndarray
    above_H: np.ndarray
    sole_H3: np.ndarray
    """Points of the person's soles, or of the robot's from its root, in the world [m]."""
    turn_L33: np.ndarray
    place_L3: np.ndarray
    base_43: np.ndarray
    """Place [m] and rotation of the robot's base, in the robot's world."""


@njit(**INNER)
def person(t, f, local_J33, turn_33, place_3):
    """A person's root, between the legs' first joints [m]; points of soles stand in `f.sole_H3`."""
    turn_L33, place_L3 = f.turn_L33, f.place_L3
    for i in range(3):
        place_L3[0, i] = place_3[i]
        for j in range(3):
            turn_L33[0, i, j] = turn_33[i, j]
    for k in range(size(t, JOINT_L)):
        parent, joint = whole(t, PARENT_L, k), whole(t, JOINT_L, k)
        put(place_L3, k + 1, add(turn(turn_L33, parent, vector(t, OFFSET_L3, k)), row(place_L3, parent), 1.0))
        for i in range(3):
            for j in range(3):
                found = 0.0
                for x in range(3):
                    found += turn_L33[parent, i, x] * np.float64(local_J33[joint, x, j])
                turn_L33[k + 1, i, j] = found
    for h in range(size(t, SOLE_H)):
        k = whole(t, SOLE_H, h)
        put(f.sole_H3, h, add(turn(turn_L33, k, vector(t, SOLE_H3, h)), row(place_L3, k), 1.0))
    feet, root = size(t, START_R), (0.0, 0.0, 0.0)
    for r in range(feet):
        root = add(root, row(place_L3, whole(t, START_R, r)), 1 / feet)
    return root


@njit(**INNER)
def stand_flat(t, f, aim_X3):
    """Turns directions of feet, so that planted ones stand flat."""
    up = (f.turn_133[0, 1, 0], f.turn_133[0, 1, 1], f.turn_133[0, 1, 2])
    for r in range(size(t, START_R)):
        ahead, above = whole(t, FOOT_R2, 2 * r), whole(t, FOOT_R2, 2 * r + 1)
        own = row(aim_X3, above)
        share = min(f.weight_H[2 * r], f.weight_H[2 * r + 1]) * smooth((dot(own, up) - LIES) / (STANDS - LIES))
        upright = unit(add(own, add(up, own, -1.0), share))
        forward = row(aim_X3, ahead)
        forward = unit(add(forward, upright, -dot(forward, upright)))
        put(aim_X3, above, upright)
        put(aim_X3, ahead, forward)


@njit(**INNER)
def pointing(t, f, aim_X3, h):
    """Where a point of a sole is [m] from the root, along the world's axes, if legs point as directions say."""
    r = h // 2
    place = vector(t, HIP_R3, r)
    for k in range(2):
        place = add(place, row(aim_X3, whole(t, LIMB_R2, 2 * r + k)), real(t, LENGTH_R2, 2 * r + k))
    forward, up = row(aim_X3, whole(t, FOOT_R2, 2 * r)), row(aim_X3, whole(t, FOOT_R2, 2 * r + 1))
    built = vector(t, BUILT_R23, h)
    place = add(add(add(place, forward, built[0]), up, built[1]), cross(up, forward), built[2])
    return turn(f.turn_133, 0, place)


@njit(**INNER)
def ask(t, f, root, aim_X3, passed, longest_step):
    """Where the root is to go; places and weights of points of soles stand after the directions then. `root`: the
    person's [m].
    """
    points, number_4, scale = len(f.weight_H), f.number_4, real(t, SCALE_1, 0)
    first = len(aim_X3) - 2 * points
    path, last_path = (scale * root[0], scale * root[1], scale * root[2]), (f.path_3[0], f.path_3[1], f.path_3[2])
    gone = add(last_path, path, -1.0)
    known, step, total, level, moved = number_4[KNOWN] > 0, min(passed, longest_step), 0.0, 0.0, (0.0, 0.0, 0.0)
    for h in range(points):
        place, weight = pointing(t, f, aim_X3, h), f.weight_H[h]
        moved = add(moved, add(add(gone, row(f.pointing_H3, h), 1.0), place, -1.0), weight)
        level += weight * (f.above_H[h] - path[1] - place[1])
        total += weight
        put(f.pointing_H3, h, place)
    level /= max(total, 1e-9)
    scale_back = 1 / max(total, 1.0)
    moved = (moved[0] * scale_back, moved[1] * scale_back, moved[2] * scale_back)
    if passed > longest_step:
        moved = gone
    share = min(total, 1.0)
    begun = level if share > 0 else -scale * number_4[FLOOR]
    usual = number_4[USUAL] if known else begun
    usual += share * (1 - math.exp(-step / USUAL_S)) * (level - usual)
    number_4[USUAL], number_4[KNOWN] = usual, 1.0
    off = add((f.off_3[0], f.off_3[1], f.off_3[2]), moved, 1.0)
    back = 1 - math.exp(-step / RETURN_S)
    far = back * math.sqrt(off[0] * off[0] + off[2] * off[2])
    back *= min(1.0, RETURN_SPEED * step / max(far, 1e-12))
    height = usual + share * (level - usual)
    up = off[1] + (1 - math.exp(-step / SETTLE_S)) * (height - off[1])
    off = (off[0] - back * off[0], up, off[2] - back * off[2]) if known else (0.0, begun, 0.0)
    for i in range(3):
        f.path_3[i], f.off_3[i] = path[i], off[i]
    for h in range(points):
        wanted = add(add(path, off, 1.0), row(f.pointing_H3, h), 1.0)
        under = max(-wanted[1], 0.0)
        wanted = (wanted[0], f.above_H[h] if f.planted_H[h] else wanted[1] + under, wanted[2])
        if f.held_H[h]:
            wanted = (f.anchor_H3[h, 0], wanted[1], f.anchor_H3[h, 2])
        counts = max(f.weight_H[h], min(under / UNDER_M, 1.0))
        put(aim_X3, first + h, turn_back(f.turn_133, 0, add(add(wanted, path, -1.0), off, -1.0)))
        put(aim_X3, first + points + h, (FREE + (PLANTED - FREE) * counts, 0.0, 0.0))


@njit(**INNER)
def in_world(f, work, point, root):
    """A point of the base frame from the root, along the world's axes."""
    return turn(f.turn_133, 0, turn_back(work.carrier_133, 0, add(point, root, -1.0)))


@njit(**INNER)
def stand(t, work, f):
    """Takes the root along with what is planted, where the robot is placed; the base stands in `f.base_43`."""
    root, points, balls = carrier(t, work), len(f.weight_H), size(t, RADIUS_J)
    planned = (f.path_3[0] + f.off_3[0], f.path_3[1] + f.off_3[1], f.path_3[2] + f.off_3[2])
    total, lowest, rise, flat = 0.0, np.inf, 0.0, (0.0, 0.0, 0.0)
    for h in range(points):
        f.above_H[h] = np.inf
    for b in range(balls):
        place = turned_point(work, whole(t, BALL_BODY_J, b), vector(t, BALL_J3, b))
        height = in_world(f, work, place, root)[1] - real(t, RADIUS_J, b)
        lowest = min(lowest, height)
        for h in range(points):
            if whole(t, NEAR_HJ, h * balls + b):
                f.above_H[h] = min(f.above_H[h], height)
    for h in range(points):
        point = in_world(f, work, turned_point(work, whole(t, BODY_H, h), vector(t, POINT_H3, h)), root)
        put(f.sole_H3, h, point)
        low = f.above_H[h]
        f.above_H[h] = point[1] - low
        if not f.held_H[h]:
            put(f.anchor_H3, h, (planned[0] + point[0], 0.0, planned[2] + point[2]))
        weight = f.weight_H[h]
        total, rise = total + weight, rise - weight * low
        flat = add(flat, add(row(f.anchor_H3, h), point, -1.0), weight)
    rest = max(1.0 - total, 0.0)
    scale = 1 / (total + rest)
    rise = (rise + rest * planned[1]) * scale
    found = ((flat[0] + rest * planned[0]) * scale, max(rise, -lowest), (flat[2] + rest * planned[2]) * scale)
    for h in range(points):  # what is hardly planted yet, or no more, goes along; what is planted stays
        loose, anchor = 1.0 - f.weight_H[h], row(f.anchor_H3, h)
        here = add(found, row(f.sole_H3, h), 1.0)
        put(f.anchor_H3, h, (
            anchor[0] + loose * (here[0] - anchor[0]), 0.0, anchor[2] + loose * (here[2] - anchor[2]),
        ))  # fmt: skip
    for i in range(3):
        f.off_3[i] = found[i] - f.path_3[i]
    _base(work, f, found, root)


@njit(**INNER)
def _base(work, f, found, root):
    """The base of a robot whose root is there in the human's world, and so in its own frame."""
    for i in range(3):
        place = found[(i + 2) % 3]  # x forward, y left, z up
        for j in range(3):
            entry = 0.0
            for k in range(3):
                entry += f.turn_133[0, (i + 2) % 3, k] * work.carrier_133[0, j, k]
            f.base_43[1 + i, j] = entry
            place -= entry * root[j]
        f.base_43[0, i] = place
