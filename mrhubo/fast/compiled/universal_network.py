"""The layers of the universal network (`mrhubo.universal.network`) on the joints of one robot, float32.

Legend: T tokens, hypothesis by hypothesis and block by block of joints; W numbers of a token, F features.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.networks import SILU, activate
from mrhubo.fast.compiled.tables import FIRST_C, INNER, size, whole
from mrhubo.fast.sections import Universal

FEATURES, SEEN, OUTPUTS = 44, 37, 4
_FEATURES_4, _SEEN_4 = 44, 40
"""The same, rounded up to a multiple of 4."""
_EPSILON = np.float32(1e-5)
_LOG2E, _LN2_HIGH, _LN2_LOW = np.float32(1.4426950408889634), np.float32(0.693359375), np.float32(-2.12194440e-4)
_E2, _E3, _E4, _E5, _E6 = (np.float32(1 / math.factorial(n)) for n in range(2, 7))
_ONE, _HALF, _ZERO, _LEAST = np.float32(1), np.float32(0.5), np.float32(0), np.float32(-87)
_POWERS = np.float32(2.0) ** np.arange(-127, 1, dtype=np.float32)
"""Of 2, the last one is 1."""


class Weights(NamedTuple):
    """Weights lie with the numbers that come in along the first axis, whose length is a multiple of 4."""

    joint_FW: np.ndarray
    joint_bias: np.ndarray
    branch_FW: np.ndarray
    norm_2W: np.ndarray
    first_WO: np.ndarray
    first_bias: np.ndarray
    later_WO: np.ndarray
    later_bias: np.ndarray
    norm_44W: np.ndarray
    """Of each layer: weight and bias of the first norm, and of the second."""
    mix_LWO: np.ndarray
    mix_bias: np.ndarray
    mixed_LWO: np.ndarray
    mixed_bias: np.ndarray
    up_LWO: np.ndarray
    up_bias: np.ndarray
    down_LWO: np.ndarray
    down_bias: np.ndarray
    heads: int


def lay_out(universal: Universal) -> Weights:
    """The weights as the functions here read them."""
    w = universal.weights

    def turned(name: str, rows: int = 0) -> np.ndarray:
        found_IO = w[f"{name}.weight"].T
        return np.ascontiguousarray(np.pad(found_IO, ((0, (-len(found_IO)) % 4), (0, 0))))

    def both(name: str, kind: str) -> np.ndarray:
        return np.stack([turned(f"layers.{i}.{name}") if kind == "weight" else w[f"layers.{i}.{name}.bias"]
                         for i in range(2)])  # fmt: skip

    norms = [[w[f"layers.{i}.norm{k}.{kind}"] for k in (1, 2) for kind in ("weight", "bias")] for i in range(2)]
    return Weights(
        turned("joint"), w["joint.bias"], turned("branch"), np.stack([w["norm.weight"], w["norm.bias"]]),
        turned("first"), w["first.bias"], turned("later"), w["later.bias"], np.array(norms),
        *(both(name, kind) for name in ("mix", "mixed", "up", "down") for kind in ("weight", "bias")),
        int(universal.size_2[0]),
    )  # fmt: skip


class Room(NamedTuple):
    """Where tokens are while they are worked on."""

    feature_TF: np.ndarray
    seen_XF: np.ndarray
    """Branch by branch, hypothesis by hypothesis."""
    branch_XW: np.ndarray
    x_TW: np.ndarray
    one_TE: np.ndarray
    two_TE: np.ndarray
    score_N: np.ndarray
    out_TO: np.ndarray


@njit(**INNER)
def make_room(w, joints, blocks, several, outputs):
    """Room for as many hypotheses at a time."""
    tokens, width = joints * several, len(w.joint_bias)
    wide = max(4 * width, outputs)
    return Room(
        np.zeros((tokens, _FEATURES_4), np.float32), np.zeros((blocks * several, _SEEN_4), np.float32),
        np.empty((blocks * several, width), np.float32), np.empty((tokens, width), np.float32),
        np.zeros((tokens, wide), np.float32), np.zeros((tokens, wide), np.float32), np.empty(joints, np.float32),
        np.empty((tokens, outputs), np.float32),
    )  # fmt: skip


@njit(**INNER)
def _multiply(x_TI, weight_IO, out_TO, tokens, inputs):
    """Adds x W to what stands in `out_TO`: four rows of W at a time, each number of the output loaded once for them."""
    outputs = weight_IO.shape[1]
    for t in range(tokens):
        for i in range(0, inputs, 4):
            a, b, c, d = x_TI[t, i], x_TI[t, i + 1], x_TI[t, i + 2], x_TI[t, i + 3]
            for o in range(outputs):
                out_TO[t, o] += (a * weight_IO[i, o] + b * weight_IO[i + 1, o]) + (
                    c * weight_IO[i + 2, o] + d * weight_IO[i + 3, o]
                )


@njit(**INNER)
def _fill(bias_O, out_TO, tokens):
    for t in range(tokens):
        for o in range(len(bias_O)):
            out_TO[t, o] = bias_O[o]


@njit(**INNER)
def _norm(x_TW, weight_W, bias_W, out_TW, tokens):
    width = len(weight_W)
    scale = _ONE / np.float32(width)
    for t in range(tokens):
        total = _ZERO
        for k in range(width):
            total += x_TW[t, k]
        mean, square = total * scale, _ZERO
        for k in range(width):
            square += (x_TW[t, k] - mean) * (x_TW[t, k] - mean)
        factor = _ONE / np.float32(math.sqrt(square * scale + _EPSILON))
        for k in range(width):
            out_TW[t, k] = (x_TW[t, k] - mean) * factor * weight_W[k] + bias_W[k]


@njit(**INNER)
def exponential(x):
    """exp(x) of a number that is not positive, float32."""
    x = max(x, _LEAST)
    n = np.float32(math.floor(x * _LOG2E + _HALF))
    r = (x - n * _LN2_HIGH) - n * _LN2_LOW
    found = ((((_E6 * r + _E5) * r + _E4) * r + _E3) * r + _E2) * r * r + r + _ONE
    return found * _POWERS[int(n) + 127]


@njit(**INNER)
def _attend(t, w, room, several):
    """Joints of a block look at each other: from queries, keys and values in `one_TE` into `two_TE`."""
    width, joints, blocks = len(w.joint_bias), len(room.score_N), size(t, FIRST_C) - 1
    each = width // w.heads
    one_TE, two_TE, score_N = room.one_TE, room.two_TE, room.score_N
    scale = _ONE / np.float32(math.sqrt(each))
    for k in range(several):
        for c in range(blocks):
            first, last = k * joints + whole(t, FIRST_C, c), k * joints + whole(t, FIRST_C, c + 1)
            for h in range(w.heads):
                at = h * each
                for i in range(first, last):
                    most = np.float32(-np.inf)
                    for j in range(first, last):
                        found = _ZERO
                        for e in range(at, at + each):
                            found += one_TE[i, e] * one_TE[j, width + e]
                        score_N[j - first] = found * scale
                        most = max(most, found * scale)
                    total = _ZERO
                    for j in range(last - first):
                        score_N[j] = exponential(score_N[j] - most)
                        total += score_N[j]
                    for e in range(at, at + each):
                        two_TE[i, e] = _ZERO
                    for j in range(first, last):
                        share = score_N[j - first] / total
                        for e in range(at, at + each):
                            two_TE[i, e] += share * one_TE[j, 2 * width + e]


@njit(**INNER)
def answer(t, w, room, several, first):
    """Outputs into `room.out_TO` of what stands in `room.feature_TF` and `room.seen_XF`."""
    joints, blocks, width = len(room.score_N), size(t, FIRST_C) - 1, len(w.joint_bias)
    tokens, x_TW, one_TE, two_TE = joints * several, room.x_TW, room.one_TE, room.two_TE
    for x in range(blocks * several):
        for o in range(width):
            room.branch_XW[x, o] = w.joint_bias[o]
    _multiply(room.seen_XF, w.branch_FW, room.branch_XW, blocks * several, _SEEN_4)
    for k in range(several):
        for c in range(blocks):
            for i in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                for o in range(width):
                    one_TE[k * joints + i, o] = room.branch_XW[k * blocks + c, o]
    _multiply(room.feature_TF, w.joint_FW, one_TE, tokens, _FEATURES_4)
    activate(SILU, one_TE, x_TW, tokens, width)
    for layer in range(2):
        _norm(x_TW, w.norm_44W[layer, 0], w.norm_44W[layer, 1], two_TE, tokens)
        _fill(w.mix_bias[layer], one_TE, tokens)
        _multiply(two_TE, w.mix_LWO[layer], one_TE, tokens, width)
        _attend(t, w, room, several)
        for i in range(tokens):
            for o in range(width):
                x_TW[i, o] += w.mixed_bias[layer, o]
        _multiply(two_TE, w.mixed_LWO[layer], x_TW, tokens, width)
        _norm(x_TW, w.norm_44W[layer, 2], w.norm_44W[layer, 3], two_TE, tokens)
        _fill(w.up_bias[layer], one_TE, tokens)
        _multiply(two_TE, w.up_LWO[layer], one_TE, tokens, width)
        activate(SILU, one_TE, two_TE, tokens, 2 * width)
        for i in range(tokens):
            for o in range(width):
                x_TW[i, o] += w.down_bias[layer, o]
        _multiply(two_TE, w.down_LWO[layer], x_TW, tokens, 2 * width)
    _norm(x_TW, w.norm_2W[0], w.norm_2W[1], two_TE, tokens)
    if first:
        _fill(w.first_bias, room.out_TO, tokens)
        _multiply(two_TE, w.first_WO, room.out_TO, tokens, width)
    else:
        _fill(w.later_bias, room.out_TO, tokens)
        _multiply(two_TE, w.later_WO, room.out_TO, tokens, width)
