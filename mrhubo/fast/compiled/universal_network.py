"""The layers of the universal network (`mrhubo.universal.network`) on the joints of one robot, float32.

All hypotheses of an iteration at a time. Arrays are as long as whole tiles are (`mrhubo.fast.compiled.tile`): what is
beyond a robot's own joints, or a layer's own numbers, is written over or multiplied by 0.

Legend: T tokens, the joints block by block, hypothesis after hypothesis; X blocks likewise, W numbers of a token,
F features, I and O of layers, H heads.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.lanes import LANES
from mrhubo.fast.compiled.networks import SILU, TANH_END, activate, tangent
from mrhubo.fast.compiled.tables import COLUMNS, FIRST_C, INNER, size, whole
from mrhubo.fast.compiled.tile import ROWS, multiply, whole_tiles
from mrhubo.fast.sections import Universal

FEATURES, SEEN, OUTPUTS = 44, 37, 4
_EPSILON = np.float32(1e-5)
_ONE, _HALF, _ZERO, _FAR = np.float32(1), np.float32(0.5), np.float32(0), np.float32(1e9)


class Weights(NamedTuple):
    """Weights lie with the numbers that come in along the first axis."""

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

    def turned(name: str) -> np.ndarray:
        return _wide(w[f"{name}.weight"].T)

    def both(name: str, kind: str) -> np.ndarray:
        return np.stack([turned(f"layers.{i}.{name}") if kind == "weight" else _wide(w[f"layers.{i}.{name}.bias"])
                         for i in range(2)])  # fmt: skip

    names = [*(f"layers.{i}.norm{k}" for i in range(2) for k in (1, 2)), "norm"]
    norms = [[w[f"{name}.weight"], w[f"{name}.bias"]] for name in names]
    return Weights(
        turned("joint"), _wide(w["joint.bias"]), turned("branch"), turned("first"), _wide(w["first.bias"]),
        turned("later"), _wide(w["later.bias"]), np.array(norms),
        both("mix", "weight"), both("mix", "bias"), both("mixed", "weight"), both("mixed", "bias"),
        both("up", "weight"), both("up", "bias"), both("down", "weight"), both("down", "bias"),
        int(universal.size_2[0]),
    )  # fmt: skip


def _wide(array: np.ndarray) -> np.ndarray:
    """With zeros behind the last axis up to whole tiles."""
    more = whole_tiles(array.shape[-1], COLUMNS) - array.shape[-1]
    return np.ascontiguousarray(np.pad(array, [(0, 0)] * (array.ndim - 1) + [(0, more)]))


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
    """Keys of a block's joints side by side, block after block, of two hypotheses."""
    score_TE: np.ndarray
    """How much a joint takes from each of its block's, head by head; each head has as many columns as `key_EN`."""
    far_CN: np.ndarray
    """0 in the columns of a block's joints, else very low."""
    none_1E: np.ndarray
    """Zeros."""
    out_TO: np.ndarray


@njit(**INNER)
def make_room(t, w, joints, outputs, several, times):
    """Room for one robot's joints and so many hypotheses at a time, and for outputs of as often so many."""
    blocks, width, wide, full = size(t, FIRST_C) - 1, w.norm_52W.shape[2], w.mix_LWO.shape[2] + COLUMNS, 0
    for c in range(blocks):
        full = max(full, whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c))
    full += -full % COLUMNS
    tokens, rows = several * joints + 2 * ROWS, several * blocks + 2 * ROWS
    answers = times * several * joints + 2 * ROWS
    far_CN = np.full((blocks, full), -_FAR, np.float32)
    for c in range(blocks):
        far_CN[c, : whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c)] = _ZERO
    return Room(
        np.zeros((tokens, FEATURES), np.float32), np.zeros((rows, SEEN), np.float32),
        np.zeros((rows, w.branch_FW.shape[1]), np.float32), np.zeros((tokens, w.joint_FW.shape[1]), np.float32),
        np.zeros((tokens, wide), np.float32), np.zeros((tokens, wide), np.float32),
        np.zeros((2 * blocks * width, full), np.float32), np.zeros((tokens, w.heads * full), np.float32),
        far_CN, np.zeros((1, wide), np.float32), np.zeros((answers, outputs + COLUMNS), np.float32),
    )  # fmt: skip


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
    top, bottom = tangent(max(x * _HALF, -TANH_END))
    return max((bottom + top) / (bottom - top), _ZERO)


@njit(**INNER)
def _turn_keys(t, w, room, at, c, key_at):
    """Keys of a block's joints, from a token on, side by side into rows of `key_EN`, with the scale of scores."""
    width, one_TE, key_EN = w.norm_52W.shape[2], room.one_TE, room.key_EN
    scale = _ONE / np.float32(math.sqrt(width // w.heads))
    for j in range(whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c)):
        for e in range(width):
            key_EN[key_at + e, j] = one_TE[at + j, width + e] * scale


@njit(**INNER)
def _score(t, w, room, at, c, key_at):
    """How well the joints of a block go together, from a token on, into `score_TE`; others' columns are far off."""
    width, full = w.norm_52W.shape[2], room.key_EN.shape[1]
    each, one_TE, wide = width // w.heads, room.one_TE, room.score_TE.shape[1]
    count = whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c)
    for h in range(w.heads):
        multiply(
            one_TE, at * one_TE.shape[1] + h * each, room.key_EN, (key_at + h * each) * full, room.far_CN, c * full, 0,
            room.score_TE, at * wide + h * full, count, count, each,
        )  # fmt: skip


@njit(**INNER)
def _soften(w, room, tokens):
    """Scores become shares, which sum up to 1."""
    full = room.key_EN.shape[1]
    score_RN = room.score_TE.reshape(len(room.score_TE) * w.heads, full)
    for r in range(tokens * w.heads):
        a, b, c, d = score_RN[r, 0], score_RN[r, 1], score_RN[r, 2], score_RN[r, 3]
        for j in range(4, full, 4):  # four at a time, as each waits for the one before
            a, b = max(a, score_RN[r, j]), max(b, score_RN[r, j + 1])
            c, d = max(c, score_RN[r, j + 2]), max(d, score_RN[r, j + 3])
        most, total = max(max(a, b), max(c, d)), _ZERO
        for j in range(full):
            score_RN[r, j] = exponential(score_RN[r, j] - most)
        for j in range(full):
            total += score_RN[r, j]
        total = _ONE / total
        for j in range(full):
            score_RN[r, j] *= total


@njit(**INNER)
def _share(t, w, room, at, c):
    """What the joints of a block take from each other, from a token on, into `two_TE`."""
    width, full = w.norm_52W.shape[2], room.key_EN.shape[1]
    each, one_TE, two_TE, wide = width // w.heads, room.one_TE, room.two_TE, room.score_TE.shape[1]
    count = whole(t, FIRST_C, c + 1) - whole(t, FIRST_C, c)
    for h in range(w.heads):  # what is beyond a head's numbers is the next one's, which writes over it
        multiply(
            room.score_TE, at * wide + h * full, one_TE, at * one_TE.shape[1] + 2 * width + h * each, room.none_1E, 0,
            0, two_TE, at * two_TE.shape[1] + h * each, count, each, count,
        )  # fmt: skip


@njit(**INNER)
def _attend(t, w, room, several):
    """Joints of a block look at each other: from queries, keys and values in `one_TE` into `two_TE`.

    Token after token, as a tile's last rows may be the next block's.
    """
    blocks = size(t, FIRST_C) - 1
    joints = whole(t, FIRST_C, blocks)
    # A processor waits where it reads at once several numbers that it has just written one by one; so keys of the next
    # hypothesis are turned before the present one's are read.
    width = w.norm_52W.shape[2]
    for k in range(several + 1):
        if k < several:
            for c in range(blocks):
                _turn_keys(t, w, room, k * joints + whole(t, FIRST_C, c), c, (k % 2 * blocks + c) * width)
        if k > 0:
            for c in range(blocks):
                key_at = ((k - 1) % 2 * blocks + c) * width
                _score(t, w, room, (k - 1) * joints + whole(t, FIRST_C, c), c, key_at)
    _soften(w, room, several * joints)
    for k in range(several):
        for c in range(blocks):
            _share(t, w, room, k * joints + whole(t, FIRST_C, c), c)


@njit(**INNER)
def answer(t, w, room, first, several, z):
    """Outputs into `room.out_TO` of what stands in `room.feature_TF` and `room.seen_XF`, for so many hypotheses, the
    `z`th time that there are as many as lanes.

    Layer after layer in a loop, as each place that calls a function is compiled by itself.
    """
    blocks, width = size(t, FIRST_C) - 1, w.norm_52W.shape[2]
    joints = whole(t, FIRST_C, blocks)
    tokens = several * joints
    tokens += -tokens % ROWS  # what is in rows beyond stays small, as it comes from the norm
    x_TW, one_TE, two_TE = room.x_TW, room.one_TE, room.two_TE
    for number in range(2 + 4 * 2 + 1):
        layer, kind = (number - 2) // 4, (number - 2) % 4
        last, rows, inputs, out_at = number == 10, tokens, width, 0
        if number < 2:
            given, weight_IO, bias, out, inputs = room.feature_TF, w.joint_FW, w.joint_bias, one_TE, FEATURES
            if number == 0:
                given, weight_IO, out = room.seen_XF, w.branch_FW, room.branch_XW
                rows, inputs = several * blocks, SEEN
        elif last:
            given, weight_IO, bias, out = two_TE, w.later_WO, w.later_bias, room.out_TO
            out_at = z * LANES * joints
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
        outputs = weight_IO.shape[1]
        adds = number >= 2 and not last and kind % 2 == 1
        if number == 1:  # on what is seen of each joint's branch
            for k in range(several):
                for c in range(blocks):
                    for i in range(whole(t, FIRST_C, c), whole(t, FIRST_C, c + 1)):
                        for o in range(outputs):
                            one_TE[k * joints + i, o] = room.branch_XW[k * blocks + c, o]
        elif adds:
            for i in range(rows):
                for o in range(outputs):
                    out[i, o] += bias[o]
        else:
            for i in range(rows):
                for o in range(outputs):
                    out[out_at + i, o] = bias[o]
        at = out_at * out.shape[1]
        multiply(given, 0, weight_IO, 0, out, at, out.shape[1], out, at, rows, outputs, inputs)
        if number == 1 or (number >= 2 and not last and kind == 2):
            activate(SILU, one_TE, x_TW if number == 1 else two_TE, tokens, width if number == 1 else 2 * width)
        elif number >= 2 and not last and kind == 0:
            _attend(t, w, room, several)
