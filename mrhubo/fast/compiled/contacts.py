"""As `mrhubo.fast.plain.contacts`, for one person."""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.tables import INNER_EXACT
from mrhubo.fast.plain.contacts import (
    BAND_M,
    GATHERED,
    HEIGHTS_M,
    LIFTED_M,
    LIFTED_SPEED,
    MEMORY_S,
    PLANTED_M,
    PLANTED_SPEED,
    RAMP_S,
    SMOOTH_S,
    STEP_M,
    USUAL_M,
    USUAL_S,
    WANDERED_M,
)

_WIDTH = round(BAND_M / STEP_M)
HEIGHTS = round(2 * HEIGHTS_M / STEP_M)
FLOOR, FROM, USUAL, KNOWN = np.arange(4)
"""Places in `Floor.number_4`: heights [m] of the floor and from which on it is looked for; how high the root is over
the path, usually [m]; 1 where somebody has been seen."""


@njit(**INNER_EXACT)
def next_contacts(f, passed, floor, given_H, root):
    """The contacts after one more frame, whose points of soles stand in `f.sole_H3`. `floor` [m]: NaN, it is learned;
    `given_H`: empty, contacts are found; `root`: its height [m].
    """
    points, last_floor = len(f.planted_H), f.number_4[FLOOR]
    new = math.isnan(last_floor)
    lowest = np.inf
    for h in range(points):
        lowest = min(lowest, f.sole_H3[h, 1])
    if new:
        f.number_4[FROM] = lowest - HEIGHTS_M
        f.slow_Y[:] = 0.0
        if abs(lowest) < USUAL_M:
            f.slow_Y[int(-f.number_4[FROM] / STEP_M)] = USUAL_S
    _move_along(f, lowest)
    share = passed / (passed + SMOOTH_S)
    fade = math.exp(-passed / MEMORY_S)
    for y in range(HEIGHTS):
        f.slow_Y[y] *= fade
    for h in range(points):
        speed = 0.0
        for i in range(3):
            velocity = (f.sole_H3[h, i] - f.place_H3[h, i]) / passed
            velocity = f.velocity_H3[h, i] + share * (velocity - f.velocity_H3[h, i])
            f.velocity_H3[h, i] = 0.0 if new else velocity
            f.place_H3[h, i] = f.sole_H3[h, i]
            speed += f.velocity_H3[h, i] * f.velocity_H3[h, i]
        f.speed_H[h] = math.sqrt(speed)
        up = f.sole_H3[h, 1] - f.number_4[FROM]
        if f.speed_H[h] < PLANTED_SPEED and f.sole_H3[h, 1] < root and not new and 0 <= up < 2 * HEIGHTS_M:
            f.slow_Y[min(int(up / STEP_M), HEIGHTS - 1)] += passed
    height = floor
    if math.isnan(floor):
        height = f.number_4[FROM] + _lowest_band(f.slow_Y, f.total_Y)
    if not math.isfinite(height):  # nothing has been slow
        height = lowest if new else min(lowest, last_floor)
    f.number_4[FLOOR] = height
    for h in range(points):
        _next_contact(f, h, new, passed, given_H, root)


@njit(**INNER_EXACT)
def _move_along(f, lowest):
    """Lets the heights begin elsewhere, so that the lowest point is among them."""
    at = math.floor((lowest - f.number_4[FROM]) / STEP_M)
    over = max(at - (HEIGHTS - 1), 0.0) + min(at, 0.0)
    if over != 0:
        for y in range(HEIGHTS):
            f.total_Y[y] = f.slow_Y[int(y + over)] if 0 <= y + over < HEIGHTS else 0.0
        f.slow_Y[:] = f.total_Y[:HEIGHTS]
        f.number_4[FROM] += over * STEP_M


@njit(**INNER_EXACT)
def _next_contact(f, h, new, passed, given_H, root):
    """Whether a point is planted, and how much that counts."""
    above, speed, was = f.place_H3[h, 1] - f.number_4[FLOOR], f.speed_H[h], f.planted_H[h]
    planted = was
    under = f.place_H3[h, 1] < root
    if above < PLANTED_M and speed < PLANTED_SPEED and under:
        planted = True
    elif above > LIFTED_M or speed > LIFTED_SPEED or not under:
        planted = False
    leaves = min((LIFTED_SPEED - speed) / (LIFTED_SPEED - PLANTED_SPEED), (LIFTED_M - above) / (LIFTED_M - PLANTED_M))
    if len(given_H):
        planted, leaves = given_H[h], 1.0
    ahead, aside = f.place_H3[h, 0] - f.start_H3[h, 0], f.place_H3[h, 2] - f.start_H3[h, 2]
    began = planted and (not was or math.sqrt(ahead * ahead + aside * aside) > WANDERED_M)
    if began:
        f.age_H[h] = np.inf if new else passed
        for i in range(3):
            f.start_H3[h, i] = f.place_H3[h, i]
    else:
        f.age_H[h] += passed
    f.planted_H[h], f.held_H[h] = planted, was and planted and not began
    f.weight_H[h] = smooth(f.age_H[h] / RAMP_S) * smooth(leaves) if planted else 0.0


@njit(**INNER_EXACT)
def smooth(share):
    """As `mrhubo.fast.plain.human.smooth_share`."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3 - 2 * share)


@njit(**INNER_EXACT)
def _lowest_band(slow_Y, total_Y):
    """How high the floor is over the lowest of the heights [m]; NaN where nothing has been slow."""
    total_Y[0], most = 0.0, 0.0
    for y in range(HEIGHTS):
        total_Y[y + 1] = total_Y[y] + slow_Y[y]
    bands = HEIGHTS + 1 - _WIDTH
    for y in range(bands):
        most = max(most, total_Y[y + _WIDTH] - total_Y[y])
    if not most > 0:
        return np.nan
    first = 0
    while total_Y[first + _WIDTH] - total_Y[first] < GATHERED * most:
        first += 1
    fullest, found = first, -1.0
    for y in range(first, first + _WIDTH):
        band = min(y, bands - 1)
        if total_Y[band + _WIDTH] - total_Y[band] > found:
            fullest, found = y, total_Y[band + _WIDTH] - total_Y[band]
    whole = 0.0
    for y in range(fullest, fullest + _WIDTH):
        whole += slow_Y[min(y, HEIGHTS - 1)]
    below = 0.0
    for y in range(fullest, fullest + _WIDTH):
        below += slow_Y[min(y, HEIGHTS - 1)]
        if below >= whole / 2:
            return (min(y, HEIGHTS - 1) + 0.5) * STEP_M
    return (min(fullest, HEIGHTS - 1) + 0.5) * STEP_M
