"""The layers of the universal network (`mrhubo.universal.network`) on the joints of one robot, float32.

One hypothesis at a time, as its numbers then stay in the processor's nearest memory beside a layer's weights.

Legend: T tokens, the joints block by block; X blocks, W numbers of a token, F features, R rows, I and O of layers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.networks import P0, P1, P2, P3, P4, P5, Q1, Q2, Q3, Q4, SILU, TANH_END, activate
from mrhubo.fast.compiled.tables import FIRST_C, INNER, size, whole
from mrhubo.fast.sections import Universal

FEATURES, SEEN, OUTPUTS = 44, 37, 4
_FEATURES_4, _SEEN_4 = 44, 40
"""The same, rounded up to a multiple of 4."""
_EPSILON = np.float32(1e-5)
_ONE, _HALF, _ZERO, _FAR = np.float32(1), np.float32(0.5), np.float32(0), np.float32(1e9)
_LANES = 8
"""Numbers that a processor works on at once."""


class Weights(NamedTuple):
    """Weights lie with the numbers that come in along the first axis, whose length is a multiple of 4."""

    joint_FW: np.ndarray
    joint_bias: np.ndarray
    branch_FW: np.ndarray
    first_WO: np.ndarray
    first_bias: np.ndarray
    later_WO: np.ndarray
    later_bias: np.ndarray
    norm_52W: np.ndarray
    """Weight and bias of both norms of each layer, and of the last norm."""
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

    names = [*(f"layers.{i}.norm{k}" for i in range(2) for k in (1, 2)), "norm"]
    norms = [[w[f"{name}.weight"], w[f"{name}.bias"]] for name in names]
    return Weights(
        turned("joint"), w["joint.bias"], turned("branch"), turned("first"), w["first.bias"], turned("later"),
        w["later.bias"], np.array(norms),
        both("mix", "weight"), both("mix", "bias"), both("mixed", "weight"), both("mixed", "bias"),
        both("up", "weight"), both("up", "bias"), both("down", "weight"), both("down", "bias"),
        int(universal.size_2[0]),
    )  # fmt: skip


class Room(NamedTuple):
    """Where tokens are while they are worked on."""

    feature_TF: np.ndarray
    seen_XF: np.ndarray
    """Of each block."""
    branch_XW: np.ndarray
    x_TW: np.ndarray
    one_TE: np.ndarray
    two_TE: np.ndarray
    key_EN: np.ndarray
    score_RN: np.ndarray
    """Rows: joints of all blocks, head by head."""
    out_TO: np.ndarray


@njit(**INNER)
def make_room(t, w, joints, outputs):
    """Room for one robot's joints."""
    blocks, width, full = size(t, FIRST_C) - 1, len(w.joint_bias), 0
    for c in range(blocks):
        full = max(full, whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c))
    full += -full % _LANES
    return Room(
        np.zeros((joints, _FEATURES_4), np.float32), np.zeros((blocks, _SEEN_4), np.float32),
        np.empty((blocks, width), np.float32), np.empty((joints, width), np.float32),
        np.zeros((joints + _LANES, 4 * width), np.float32), np.zeros((joints, 4 * width), np.float32),
        np.zeros((width, full), np.float32), np.zeros((joints * w.heads, full), np.float32),
        np.empty((joints, outputs), np.float32),
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
    """exp(x) of a number that is not positive, float32: (1 + tanh(x / 2)) / (1 - tanh(x / 2)), within 1e-7 (and not
    within so small a share of itself, which sums of such numbers do not need).
    """
    z = max(x * _HALF, -TANH_END)
    s = z * z
    top = (((((P5 * s + P4) * s + P3) * s + P2) * s + P1) * s + P0) * z
    bottom = (((Q4 * s + Q3) * s + Q2) * s + Q1) * s + _ONE
    return max((bottom + top) / (bottom - top), _ZERO)


@njit(**INNER)
def _score(t, w, room, c):
    """Scores of the joints of a block, each row less its largest, into `score_RN`."""
    width = len(w.joint_bias)
    each, one_TE, key_EN, score_RN = width // w.heads, room.one_TE, room.key_EN, room.score_RN
    scale = _ONE / np.float32(math.sqrt(each))
    first, count = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c)
    for e in range(width):
        for j in range(count):
            key_EN[e, j] = one_TE[first + j, width + e] * scale
    for i in range(count):
        for h in range(w.heads):
            r, most = (first + i) * w.heads + h, -_FAR
            for j in range(0, count, 8):  # as many sums as the processor has room for
                s0, s1, s2, s3, s4, s5, s6, s7 = _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO
                for e in range(h * each, (h + 1) * each):
                    own = one_TE[first + i, e]
                    s0, s1 = s0 + own * key_EN[e, j], s1 + own * key_EN[e, j + 1]
                    s2, s3 = s2 + own * key_EN[e, j + 2], s3 + own * key_EN[e, j + 3]
                    s4, s5 = s4 + own * key_EN[e, j + 4], s5 + own * key_EN[e, j + 5]
                    s6, s7 = s6 + own * key_EN[e, j + 6], s7 + own * key_EN[e, j + 7]
                score_RN[r, j], score_RN[r, j + 1], score_RN[r, j + 2], score_RN[r, j + 3] = s0, s1, s2, s3
                score_RN[r, j + 4], score_RN[r, j + 5], score_RN[r, j + 6], score_RN[r, j + 7] = s4, s5, s6, s7
            for j in range(count):
                most = max(most, score_RN[r, j])
            for j in range(count):
                score_RN[r, j] -= most
            for j in range(count, count + -count % 8):
                score_RN[r, j] = -_FAR


@njit(**INNER)
def _share(t, w, room, c):
    """What the joints of a block take from each other, by exponentials in `score_RN`, into `two_TE`."""
    width = len(w.joint_bias)
    each, one_TE, two_TE, score_RN = width // w.heads, room.one_TE, room.two_TE, room.score_RN
    first, count = whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c)
    for i in range(count):
        for h in range(w.heads):
            r, total = (first + i) * w.heads + h, _ZERO
            for j in range(count):
                total += score_RN[r, j]
            total = _ONE / total
            for j in range(count, count + -count % 8):
                score_RN[r, j] = _ZERO
            for e in range(h * each, (h + 1) * each):
                two_TE[first + i, e] = _ZERO
            for j in range(0, count, 8):  # beyond the block, another's joints or nobody's, with a share of 0
                a, b, c4, d = score_RN[r, j], score_RN[r, j + 1], score_RN[r, j + 2], score_RN[r, j + 3]
                p, q, u, v = score_RN[r, j + 4], score_RN[r, j + 5], score_RN[r, j + 6], score_RN[r, j + 7]
                at = first + j
                for e in range(h * each, (h + 1) * each):
                    o = 2 * width + e
                    two_TE[first + i, e] += total * (
                        ((a * one_TE[at, o] + b * one_TE[at + 1, o]) + (c4 * one_TE[at + 2, o] + d * one_TE[at + 3, o]))
                        + (
                            (p * one_TE[at + 4, o] + q * one_TE[at + 5, o])
                            + (u * one_TE[at + 6, o] + v * one_TE[at + 7, o])
                        )
                    )


@njit(**INNER)
def _attend(t, w, room):
    """Joints of a block look at each other: from queries, keys and values in `one_TE` into `two_TE`."""
    for c in range(size(t, FIRST_C) - 1):
        _score(t, w, room, c)
    numbers_X = room.score_RN.reshape(room.score_RN.size)
    for x in range(len(numbers_X)):
        numbers_X[x] = exponential(numbers_X[x])
    for c in range(size(t, FIRST_C) - 1):
        _share(t, w, room, c)


@njit(**INNER)
def answer(t, w, room, first):
    """Outputs into `room.out_TO` of what stands in `room.feature_TF` and `room.seen_XF`.

    Layer after layer in a loop, as each place that calls a function is compiled by itself.
    """
    tokens, blocks, width = len(room.x_TW), size(t, FIRST_C) - 1, len(w.joint_bias)
    x_TW, one_TE, two_TE = room.x_TW, room.one_TE, room.two_TE
    for number in range(2 + 4 * 2 + 1):
        layer, kind = (number - 2) // 4, (number - 2) % 4
        last, rows, inputs = number == 10, tokens, width
        if number < 2:
            given, weight_IO, bias, out = room.feature_TF, w.joint_FW, w.joint_bias, one_TE
            inputs = _FEATURES_4
            if number == 0:
                given, weight_IO, out = room.seen_XF, w.branch_FW, room.branch_XW
                rows, inputs = blocks, _SEEN_4
        elif last:
            given, weight_IO, bias, out = two_TE, w.later_WO, w.later_bias, room.out_TO
            if first:
                weight_IO, bias = w.first_WO, w.first_bias
        elif kind == 0:
            given, weight_IO, bias, out = two_TE, w.mix_LWO[layer], w.mix_bias[layer], one_TE
        elif kind == 1:
            given, weight_IO, bias, out = two_TE, w.mixed_LWO[layer], w.mixed_bias[layer], x_TW
        elif kind == 2:
            given, weight_IO, bias, out = two_TE, w.up_LWO[layer], w.up_bias[layer], one_TE
        else:
            given, weight_IO, bias, out, inputs = two_TE, w.down_LWO[layer], w.down_bias[layer], x_TW, 2 * width
        if last or (number >= 2 and kind % 2 == 0):
            norm_2W = w.norm_52W[4 if last else 2 * layer + kind // 2]
            _norm(x_TW, norm_2W[0], norm_2W[1], two_TE, tokens)
        adds = number >= 2 and not last and kind % 2 == 1
        if number == 1:  # on what is seen of each joint's branch
            for c in range(blocks):
                for i in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                    for o in range(width):
                        one_TE[i, o] = room.branch_XW[c, o]
        else:
            for i in range(rows):
                for o in range(weight_IO.shape[1]):
                    out[i, o] = (out[i, o] if adds else _ZERO) + bias[o]
        _multiply(given, weight_IO, out, rows, inputs)
        if number == 1 or (number >= 2 and not last and kind == 2):
            activate(SILU, one_TE, x_TW if number == 1 else two_TE, tokens, width if number == 1 else 2 * width)
        elif number >= 2 and not last and kind == 0:
            _attend(t, w, room)
