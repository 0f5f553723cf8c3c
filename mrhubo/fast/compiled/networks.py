"""As `mrhubo.fast.plain.networks`, for some frames at a time, so that weights are read once for all of them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.human import add, cross, dot, put, row, row3, unit
from mrhubo.fast.compiled.tables import (
    AXIS_M,
    BEND_W,
    CENTER_F,
    COLUMN,
    COLUMNS,
    COUNT_6,
    FIRST_O,
    FIRST_STAGE,
    INNER,
    INPUT_I,
    INPUTS,
    LAYER_G6,
    LIMB_M,
    LINEAR,
    LONG_AT,
    LOWER_N,
    LOWER_W,
    NET_H6,
    NUMBER,
    OUTPUTS,
    RESIDUAL,
    SCALE_F,
    SCALED_AT,
    SECOND_O,
    SEEN_M,
    SEES_DIRECTIONS,
    SHORT_AT,
    STAGES,
    TANH_BOUND,
    TURNED,
    UPPER_N,
    UPPER_W,
    real,
    single,
    size,
    spaced,
    whole,
)
from mrhubo.fast.compiled.tile import ROWS, multiply, multiply_row, multiply_short_row, unpack
from mrhubo.fast.plain.networks import ERF_BOTTOM, ERF_END, ERF_TOP

_ONE, _HALF, _END = np.float32(1), np.float32(0.5), np.float32(ERF_END * math.sqrt(2))
# GELU is x (erf(x / sqrt 2) / 2 + 1 / 2), and its constants stand in those of erf's polynomials, of x^2.
_T0, _T1, _T2, _T3, _T4, _T5 = (np.float32(c * math.sqrt(0.125) * 0.5**k) for k, c in enumerate(ERF_TOP))
_B1, _B2, _B3, _B4, _B5 = (np.float32(c * 0.5**k) for k, c in enumerate(ERF_BOTTOM[1:], start=1))
# SiLU is x (1 + tanh(x / 2)) / 2, and tanh(x) = x P(x^2) / Q(x^2) up to |x| = 9, within 2e-9; found as erf.
_P0, _P1, _P2 = np.float32(0.999999993874719), np.float32(0.1367634767328113), np.float32(0.0038639344509989746)
_P3, _P4, _P5 = (
    np.float32(2.7923397012698077e-05),
    np.float32(3.040097713206052e-08),
    np.float32(-1.2083086259850131e-11),
)
_Q1, _Q2 = np.float32(0.4700967835194308), np.float32(0.0272295624610154)
_Q3, _Q4 = np.float32(0.00039310490211471395), np.float32(1.2817356684709363e-06)
TANH_END = np.float32(9)
GELU, SILU, LEAKY, TANH = range(4)
ACTIVATIONS = {"gelu": GELU, "silu": SILU, "leaky_relu": LEAKY, "tanh": TANH}


@njit(**INNER)
def tangent(z):
    """The hyperbolic tangent of z, from -TANH_END to TANH_END: top and bottom of the fraction that it is."""
    s = z * z
    top = (((((_P5 * s + _P4) * s + _P3) * s + _P2) * s + _P1) * s + _P0) * z
    return top, (((_Q4 * s + _Q3) * s + _Q2) * s + _Q1) * s + _ONE


@njit(**INNER)
def activate(kind, x_BE, out_BE, frames, count):
    """An activation of the first numbers of frames, written so that several are done at once."""
    for b in range(frames):
        if kind == GELU:
            for e in range(count):
                z = min(max(x_BE[b, e], -_END), _END)
                s = z * z
                top = ((((_T5 * s + _T4) * s + _T3) * s + _T2) * s + _T1) * s + _T0
                bottom = ((((_B5 * s + _B4) * s + _B3) * s + _B2) * s + _B1) * s + _ONE
                out_BE[b, e] = (z * top / bottom + _HALF) * x_BE[b, e]
        elif kind == SILU:
            for e in range(count):
                top, bottom = tangent(min(max(x_BE[b, e] * _HALF, -TANH_END), TANH_END))
                out_BE[b, e] = (top / bottom + _ONE) * x_BE[b, e] * _HALF
        elif kind == LEAKY:
            for e in range(count):
                out_BE[b, e] = max(x_BE[b, e], np.float32(0.01) * x_BE[b, e])
        else:
            for e in range(count):
                x = x_BE[b, e]
                top, bottom = tangent(min(max(x, -TANH_END), TANH_END))
                out_BE[b, e] = top / bottom if x == x else x  # NaN stays


@njit(**INNER)
def of_layer(t, layer, place):
    """A number of a layer's row of layer_G6."""
    return whole(t, LAYER_G6, 6 * layer + place)


@njit(**INNER)
def affine(t, layer, x_BI, out_BO, loose_X, adds, frames):
    """A layer: weights x + biases, added to what is there where it `adds`. Arrays are as long and as wide as whole
    tiles are, and `x_BI` a number wider than what comes in. In `loose_X` stand one frame's sums with weights of 16
    bits; for more frames, of a layer that has no others and adds nothing, they are unpacked into it, a tile's columns
    at a time.
    """
    inputs, outputs = of_layer(t, layer, INPUTS), of_layer(t, layer, OUTPUTS)
    number, begin, begin_turned, wide = t[2], t[0][2 * NUMBER], t[0][2 * TURNED], spaced(outputs)
    long_at, short_at = of_layer(t, layer, LONG_AT), of_layer(t, layer, SHORT_AT)
    # A view tells that places are not negative, without which numba is five times slower.
    if short_at < 0 or (frames > 1 and long_at >= 0):
        at = begin_turned + long_at
        weight_IO = number[at : at + inputs * wide].reshape(inputs, wide)
        begin_BO, step = number[at + inputs * wide : at + (inputs + 1) * wide].reshape(1, wide), 0
        if adds:  # biases, which stand after the weights, are then those of an input that is 1
            for b in range(frames):
                x_BI[b, inputs] = 1
            weight_IO = number[at : at + (inputs + 1) * wide].reshape(inputs + 1, wide)
            begin_BO, step = out_BO, out_BO.shape[1]
        if frames == 1:
            multiply_row(x_BI, weight_IO, begin_BO, out_BO, outputs)
        else:
            multiply(x_BI, 0, weight_IO, 0, begin_BO, 0, step, out_BO, 0, frames, outputs, len(weight_IO))
        return
    short_IO = t[3][short_at : short_at + inputs * wide].reshape(inputs, wide)
    at = begin + of_layer(t, layer, SCALED_AT)
    bias_O, scale_O = number[at : at + wide], number[at + wide : at + 2 * wide]
    if frames == 1:
        sum_BO = loose_X[:wide].reshape(1, wide)
        sum_BO[:] = 0
        multiply_short_row(x_BI, short_IO, sum_BO, sum_BO, outputs)
        for o in range(outputs):
            out_BO[0, o] = sum_BO[0, o] * scale_O[o] + (bias_O[o] + out_BO[0, o] if adds else bias_O[o])
        return
    loose_IC = loose_X[: inputs * COLUMNS].reshape(inputs, COLUMNS)
    for first in range(0, outputs, COLUMNS):
        unpack(short_IO, first, wide, scale_O, first, loose_IC, inputs)
        multiply(x_BI, 0, loose_IC, 0, bias_O, first, 0, out_BO, first, frames, COLUMNS, inputs)


@njit(**INNER)
def mlp(t, net, kind, residual, rooms, frames):
    """A network of what stands in the first of `make_rooms`, with these activations; the output stands there again.
    Hidden layers after the first are added to what came in where it is residual.
    """
    one_BE, two_BE, three_BE, loose_X = rooms
    first, layers = whole(t, NET_H6, 6 * net), whole(t, NET_H6, 6 * net + 1)
    width = of_layer(t, first, OUTPUTS)
    affine(t, first, one_BE, three_BE, loose_X, False, frames)
    own_BE, other_BE = three_BE, one_BE
    for layer in range(first + 1, first + layers):
        before, width = width, of_layer(t, layer, OUTPUTS)
        given_BE = own_BE
        if not of_layer(t, layer, LINEAR):
            activate(kind, own_BE, two_BE, frames, before)
            given_BE = two_BE
        if residual and layer < first + layers - 1:
            affine(t, layer, given_BE, own_BE, loose_X, True, frames)
        else:
            affine(t, layer, given_BE, other_BE, loose_X, False, frames)
            own_BE, other_BE = other_BE, own_BE
    for b in range(frames):
        for e in range(width):
            one_BE[b, e] = own_BE[b, e]


@njit(**INNER)
def joint_angles(t, feature_BF, link_BM, rooms, out_BN, first, frames):
    """Joint angles [rad], inside the limits, of what the networks see (B, F), from a first frame of the output on."""
    first_stage, one_BE, columns = whole(t, COUNT_6, FIRST_STAGE), rooms[0], t[0][2 * COLUMN]
    for net in range(whole(t, COUNT_6, STAGES)):
        begin, inputs = columns + whole(t, NET_H6, 6 * net + 2), whole(t, NET_H6, 6 * net + 3)
        column_I, last = t[0][begin : begin + inputs], net >= first_stage
        seen_BX = link_BM if last and first_stage else feature_BF
        for b in range(frames):
            for i, c in enumerate(column_I):
                one_BE[b, i] = seen_BX[b, c]
        mlp(t, net, GELU, whole(t, COUNT_6, RESIDUAL), rooms, frames)
        begin, outputs = columns + whole(t, NET_H6, 6 * net + 4), whole(t, NET_H6, 6 * net + 5)
        column_O = t[0][begin : begin + outputs]
        if last and whole(t, COUNT_6, TANH_BOUND):
            activate(TANH, one_BE, one_BE, frames, outputs)
        given_BX, at = (out_BN, first) if last else (link_BM, 0)
        for b in range(frames):
            for o, c in enumerate(column_O):
                given_BX[at + b, c] = one_BE[b, o]
    for b in range(first, first + frames):
        for n in range(out_BN.shape[1]):
            low, high, raw = np.float32(real(t, LOWER_N, n)), np.float32(real(t, UPPER_N, n)), out_BN[b, n]
            angle = (high + low) * _HALF + (high - low) * _HALF * raw
            if math.isnan(angle):
                angle = np.float32(0)
            out_BN[b, n] = min(max(angle, low), high)


@njit(**INNER)
def features(t, local_BJ33, target_BD3, b, unit_I3, feature_BF, k):
    """What the networks see of a pose and its directions, into row k. `unit_I3`: room for directions in full length."""
    inputs = size(t, INPUT_I)
    if whole(t, COUNT_6, SEES_DIRECTIONS):
        for i in range(inputs):
            own = row3(target_BD3, b, whole(t, INPUT_I, i))
            put(unit_I3, i, own)
            feature_BF[k, 3 * i], feature_BF[k, 3 * i + 1], feature_BF[k, 3 * i + 2] = own
        at = 3 * inputs
        for w in range(size(t, BEND_W)):
            upper, lower = row(unit_I3, whole(t, UPPER_W, w)), row(unit_I3, whole(t, LOWER_W, w))
            own, plane = row(unit_I3, whole(t, BEND_W, w)), unit(cross(upper, lower))
            own = add(own, plane, max(1 - math.sqrt(dot(own, own)), 0.0))
            put(unit_I3, whole(t, BEND_W, w), own)
            feature_BF[k, at], feature_BF[k, at + 1], feature_BF[k, at + 2] = own
            at += 3
        for o in range(size(t, FIRST_O)):
            feature_BF[k, at] = dot(row(unit_I3, whole(t, FIRST_O, o)), row(unit_I3, whole(t, SECOND_O, o)))
            at += 1
        for m in range(size(t, LIMB_M)):
            along, axis = row(unit_I3, whole(t, LIMB_M, m)), row(unit_I3, whole(t, AXIS_M, m))
            seen = row(unit_I3, whole(t, SEEN_M, m))
            axis = unit(add(axis, along, -dot(along, axis)))
            feature_BF[k, at], feature_BF[k, at + 1] = dot(seen, along), dot(seen, axis)
            feature_BF[k, at + 2] = dot(seen, cross(along, axis))
            at += 3
    else:
        for i in range(inputs):
            chosen = whole(t, INPUT_I, i)
            for column in range(2):
                for line in range(3):
                    feature_BF[k, 6 * i + 3 * column + line] = local_BJ33[b, chosen, line, column]
    for f in range(size(t, CENTER_F)):
        feature_BF[k, f] = (feature_BF[k, f] - single(t, CENTER_F, f)) * single(t, SCALE_F, f)


@njit(**INNER)
def make_rooms(t, frames, nets):
    """Three arrays for numbers between layers of the first networks, and one for weights that are unpacked, or for
    sums, of so many frames or fewer.
    """
    widest, longest = 1, 1
    for net in range(nets):
        first = whole(t, NET_H6, 6 * net)
        for g in range(first, first + whole(t, NET_H6, 6 * net + 1)):
            inputs = of_layer(t, g, INPUTS)
            widest = max(widest, max(inputs, of_layer(t, g, OUTPUTS)))
            if frames > 1 and of_layer(t, g, LONG_AT) < 0:
                longest = max(longest, inputs)
    shape = (frames + -frames % ROWS, spaced(widest + 1))
    loose_X = np.empty(max(longest * COLUMNS, shape[1]), np.float32)
    return np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32), loose_X
