"""As `mrhubo.fast.plain.human`, for one frame."""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.tables import (
    BEND_4,
    BEND_Z,
    INNER,
    INNER_EXACT,
    JOINT_P,
    LOWER_Z,
    NEEDED_HIGH,
    NEEDED_LOW,
    PARENT_P,
    PLACE_D,
    PLANE_HIGH,
    PLANE_LOW,
    REST_D3,
    SEEN_D,
    UPPER_Z,
    VIEW_V,
    real,
    size,
    vector,
    whole,
)

_TINY, _SHORT = 1e-12, 1e-12


# Views of arrays are what numba takes longest to compile, so functions take an array and a place in it.


@njit(**INNER)
def multiply(a, i, b, j, out, k):
    """out[k] = a[i] b[j], matrices (3, 3)."""
    for x in range(3):
        for y in range(3):
            out[k, x, y] = a[i, x, 0] * b[j, 0, y] + a[i, x, 1] * b[j, 1, y] + a[i, x, 2] * b[j, 2, y]


@njit(**INNER)
def turn(a, i, v):
    """The three numbers of a[i] v."""
    return (
        a[i, 0, 0] * v[0] + a[i, 0, 1] * v[1] + a[i, 0, 2] * v[2],
        a[i, 1, 0] * v[0] + a[i, 1, 1] * v[1] + a[i, 1, 2] * v[2],
        a[i, 2, 0] * v[0] + a[i, 2, 1] * v[1] + a[i, 2, 2] * v[2],
    )


@njit(**INNER)
def turn_back(a, i, v):
    """The three numbers of a[i]^T v."""
    return (
        a[i, 0, 0] * v[0] + a[i, 1, 0] * v[1] + a[i, 2, 0] * v[2],
        a[i, 0, 1] * v[0] + a[i, 1, 1] * v[1] + a[i, 2, 1] * v[2],
        a[i, 0, 2] * v[0] + a[i, 1, 2] * v[1] + a[i, 2, 2] * v[2],
    )


@njit(**INNER)
def put(a, i, v):
    """a[i] = v, a row of three."""
    a[i, 0], a[i, 1], a[i, 2] = v


@njit(**INNER)
def identity(a, i):
    """a[i] becomes the identity."""
    for x in range(3):
        for y in range(3):
            a[i, x, y] = 1.0 if x == y else 0.0


@njit(**INNER)
def row(a, k):
    """Three numbers of an array (..., 3)."""
    return a[k, 0], a[k, 1], a[k, 2]


@njit(**INNER)
def add(a, b, scale):
    """a + scale b"""
    return a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]


@njit(**INNER)
def cross(a, b):
    """The three numbers of a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(**INNER)
def dot(a, b):
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INNER)
def unit(a):
    """a / |a|; 0 stays 0."""
    scale = 1 / max(math.sqrt(dot(a, a)), _SHORT)
    return a[0] * scale, a[1] * scale, a[2] * scale


@njit(**INNER)
def orthonormal(first, second, out, k):
    """Gram-Schmidt on two columns, into out[k]."""
    scale = 1 / math.sqrt(dot(first, first) + _TINY)
    x = (first[0] * scale, first[1] * scale, first[2] * scale)
    y = (second[0], second[1], second[2])
    for _ in range(2):
        along = dot(x, y)
        y = (y[0] - along * x[0], y[1] - along * x[1], y[2] - along * x[2])
    scale = 1 / math.sqrt(dot(y, y) + _TINY)
    y = (y[0] * scale, y[1] * scale, y[2] * scale)
    z = cross(x, y)
    for i in range(3):
        out[k, i, 0], out[k, i, 1], out[k, i, 2] = x[i], y[i], z[i]


@njit(**INNER)
def _rising(bend, low, high):
    share = min(max((bend - low) / (high - low), 0.0), 1.0)
    return share * share * (3 - 2 * share)


@njit(**INNER)
def bend_axis(t, upper, lower, own):
    """About which axis a limb bends, and how much that counts."""
    across = cross(upper, lower)
    bend = math.atan2(math.sqrt(dot(across, across)), dot(upper, lower))
    plane = _rising(bend, real(t, BEND_4, PLANE_LOW), real(t, BEND_4, PLANE_HIGH))
    along = dot(upper, own)
    own = unit((own[0] - along * upper[0], own[1] - along * upper[1], own[2] - along * upper[2]))
    across = unit(across)
    rest = 1 - plane
    axis = (
        plane * across[0] + rest * own[0],
        plane * across[1] + rest * own[1],
        plane * across[2] + rest * own[2],
    )
    return axis, 1 - _rising(bend, real(t, BEND_4, NEEDED_LOW), real(t, BEND_4, NEEDED_HIGH))


@njit(**INNER)
def directions(t, local_BJ33, b, places_L33, out_BD3):
    """Directions of a pose, and where its joints are turned. The last of the places is for what comes between."""
    identity(places_L33, 0)
    spare = size(t, JOINT_P) + 1
    for k in range(size(t, JOINT_P)):
        j = whole(t, JOINT_P, k)
        first = (
            np.float64(local_BJ33[b, j, 0, 0]), np.float64(local_BJ33[b, j, 1, 0]), np.float64(local_BJ33[b, j, 2, 0])
        )  # fmt: skip
        second = (
            np.float64(local_BJ33[b, j, 0, 1]), np.float64(local_BJ33[b, j, 1, 1]), np.float64(local_BJ33[b, j, 2, 1])
        )  # fmt: skip
        orthonormal(first, second, places_L33, spare)
        multiply(places_L33, whole(t, PARENT_P, k), places_L33, spare, places_L33, k + 1)
    directions = size(t, PLACE_D)
    for d in range(directions):
        put3(out_BD3, b, d, turn(places_L33, whole(t, PLACE_D, d), vector(t, REST_D3, d)))
    for z in range(size(t, BEND_Z)):
        d = whole(t, BEND_Z, z)
        upper, lower = row3(out_BD3, b, whole(t, UPPER_Z, z)), row3(out_BD3, b, whole(t, LOWER_Z, z))
        axis, needed = bend_axis(t, upper, lower, row3(out_BD3, b, d))
        put3(out_BD3, b, d, (axis[0] * needed, axis[1] * needed, axis[2] * needed))
    for d in range(directions):
        view = whole(t, VIEW_V, whole(t, SEEN_D, d))
        put3(out_BD3, b, d, turn_back(places_L33, view, row3(out_BD3, b, d)))


@njit(**INNER)
def row3(a, b, d):
    """Three numbers of an array (B, D, 3)."""
    return a[b, d, 0], a[b, d, 1], a[b, d, 2]


@njit(**INNER)
def put3(a, b, d, v):
    """a[b, d] = v."""
    a[b, d, 0], a[b, d, 1], a[b, d, 2] = v


@njit(**INNER)
def oblique(local_BJ33, b, j):
    """How far a matrix is from a rotation: the largest number of R^T R - 1, and infinitely far if it mirrors."""
    columns = (
        (local_BJ33[b, j, 0, 0], local_BJ33[b, j, 1, 0], local_BJ33[b, j, 2, 0]),
        (local_BJ33[b, j, 0, 1], local_BJ33[b, j, 1, 1], local_BJ33[b, j, 2, 1]),
        (local_BJ33[b, j, 0, 2], local_BJ33[b, j, 1, 2], local_BJ33[b, j, 2, 2]),
    )
    if dot(cross(columns[0], columns[1]), columns[2]) < 0:
        return np.inf
    found = 0.0
    for x in range(3):
        for y in range(x + 1):
            found = max(found, abs(dot(columns[x], columns[y]) - (1.0 if x == y else 0.0)))
    return found


@njit(**INNER_EXACT)
def flaw(local_BJ33, b, skew):
    """0: a pose holds rotations; 1: a matrix that is none; 2: a number that is not finite."""
    found = 0
    for j in range(local_BJ33.shape[1]):
        for x in range(3):
            for y in range(3):
                if not math.isfinite(local_BJ33[b, j, x, y]):
                    return 2
        if oblique(local_BJ33, b, j) > skew:
            found = 1
    return found
