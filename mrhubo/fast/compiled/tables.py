"""A description in four flat arrays, which a compiled function takes at once: handing over sixty takes 14 us.

Legend: as in `mrhubo.fast.sections`; and G layers, H networks.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.description import Description
from mrhubo.fast.leg_section import Legs
from mrhubo.fast.narrowing import LARGE, narrowed
from mrhubo.fast.plain.avoidance import CLEARANCE
from mrhubo.fast.plain.broad_phase import make_groups, reaches
from mrhubo.fast.plain.collision import clearances
from mrhubo.fast.plain.human import skew
from mrhubo.fast.plain.soles import moved_points
from mrhubo.fast.sections import SECTIONS, Part
from mrhubo.fast.short_weights import are_short, shortened

KEYS = (
    "joint_P", "parent_P", "view_V", "place_D", "seen_D", "bend_Z", "upper_Z", "lower_Z", "rest_D3", "bend_4",
    "parent_A", "rotary_A", "column_A", "limb_D", "start_body_D", "end_body_D", "view_body_V", "direction_Q",
    "joint_Q", "column_Q", "ratio_A", "offset_A", "axis_A3", "position_A3", "origin_A33", "across_A33", "twice_A33",
    "start_D3", "end_D3", "view_V33", "factor_Q4",
    "block_N", "order_N", "first_C", "order_D", "first_D", "partial_D", "first_CS", "lower_N", "upper_N", "middle_N",
    "ridge_N", "weight_D", "polish_4", "pool_ridge_CU", "pool_CXU", "pool_CU", "pool_UN",
    "kind_K", "slot_K", "of_K", "seen_K", "last_K", "direction_K3", "parent_T", "mirror_T", "rest_K23", "share_K",
    "axis_T33", "limit_T32", "measured", "column_XD", "slot_XT", "weight_25", "scale_4",
    "body_S", "pair_Y2", "end_S23", "radius_S", "reach_S", "clear_Y",
    "first_Z", "capsule_Z", "ball_Z", "reach_Z", "body_G", "centre_G3",
    "net_H6", "layer_G6", "column", "count_6", "number", "turned",
    "input_I", "bend_W", "upper_W", "lower_W", "first_O", "second_O", "limb_M", "axis_M", "seen_M", "center_F",
    "scale_F",
    "joint_L", "parent_L", "offset_L3", "start_R", "sole_H", "sole_H3", "carrier_1", "axes_33", "root_3", "body_H",
    "point_H3", "ball_body_J", "ball_J3", "radius_J", "near_HJ", "scale_1", "hip_R3", "limb_R2", "length_R2", "foot_R2",
    "built_R23", "block_H",
)  # fmt: skip
"""The tables, as in `mrhubo.fast.sections` but for these:

bend_4: ends of the bend axes' ranges [rad]. A joint's turn by the angle t is origin + sin t * across + (1 - cos t) *
twice, across = origin [axis]x and twice = origin [axis]x^2. The joints of block c are order_N[first_C[c] : first_C[c +
1]], its directions likewise. polish_4: squares of the angles [rad^2] that are far, and that are a gain; starts, and
their first steps. scale_4: good and excessive angle, shaking [degrees], usual phi. reach_S: half of a capsule's length
and its radius. clear_Y: distance [m] that a pair is to keep. Pairs stand group by group
(`mrhubo.fast.plain.broad_phase`). reach_Z: how far [m] a group's capsule and ball must be apart so that no pair is
nearer than that. net_H6: first and number of layers, place and number of input columns, and of output columns, of each
network, the prior's coders last; layer_G6: numbers in and out; where weights and then biases begin in `turned`, as
`in_columns` lays a layer out, or -1; where weights begin in `shorts`, or -1, and where biases and then scales begin in
`number`; 1 where no activation stands before the layer. column: all columns; count_6: networks of the first stage, of
both; whether directions are seen, tanh bounds, nets are residual, and every pair is to keep some distance. pool_CXU:
the pool's directions, block after block, and in each cell after cell; first_CS: where each cell begins, and last where
all end; pool_CU: which pose of the pool each is; pool_ridge_CU likewise. block_H: the block whose joints move a point
of a sole, -1: none does. What is of legs is empty for robots without feet.
"""
(
    JOINT_P, PARENT_P, VIEW_V, PLACE_D, SEEN_D, BEND_Z, UPPER_Z, LOWER_Z, REST_D3, BEND_4,
    PARENT_A, ROTARY_A, COLUMN_A, LIMB_D, START_BODY_D, END_BODY_D, VIEW_BODY_V, DIRECTION_Q,
    JOINT_Q, COLUMN_Q, RATIO_A, OFFSET_A, AXIS_A3, POSITION_A3, ORIGIN_A33, ACROSS_A33, TWICE_A33,
    START_D3, END_D3, VIEW_V33, FACTOR_Q4,
    BLOCK_N, ORDER_N, FIRST_C, ORDER_D, FIRST_D, PARTIAL_D, FIRST_CS, LOWER_N, UPPER_N, MIDDLE_N,
    RIDGE_N, WEIGHT_D, POLISH_4, POOL_RIDGE_CU, POOL_CXU, POOL_CU, POOL_UN,
    KIND_K, SLOT_K, OF_K, SEEN_K, LAST_K, DIRECTION_K3, PARENT_T, MIRROR_T, REST_K23, SHARE_K,
    AXIS_T33, LIMIT_T32, MEASURED, COLUMN_XD, SLOT_XT, WEIGHT_25, SCALE_4,
    BODY_S, PAIR_Y2, END_S23, RADIUS_S, REACH_S, CLEAR_Y,
    FIRST_Z, CAPSULE_Z, BALL_Z, REACH_Z, BODY_G, CENTRE_G3,
    NET_H6, LAYER_G6, COLUMN, COUNT_6, NUMBER, TURNED,
    INPUT_I, BEND_W, UPPER_W, LOWER_W, FIRST_O, SECOND_O, LIMB_M, AXIS_M, SEEN_M, CENTER_F, SCALE_F,
    JOINT_L, PARENT_L, OFFSET_L3, START_R, SOLE_H, SOLE_H3, CARRIER_1, AXES_33, ROOT_3, BODY_H, POINT_H3, BALL_BODY_J,
    BALL_J3, RADIUS_J, NEAR_HJ, SCALE_1, HIP_R3, LIMB_R2, LENGTH_R2, FOOT_R2, BUILT_R23, BLOCK_H,
) = np.arange(len(KEYS))  # fmt: skip
# Numbers of NumPy, as numba compiles a function anew for each of Python's that it is called with.
PLANE_LOW, PLANE_HIGH, NEEDED_LOW, NEEDED_HIGH = FAR, GAIN, STARTS, FIRST_STEPS = np.arange(4)
"""Places in bend_4, and in polish_4."""
GOOD, EXCESS, SHAKE, USUAL_PHI = np.arange(4)
"""Places in scale_4."""
FIRST_STAGE, STAGES, SEES_DIRECTIONS, TANH_BOUND, RESIDUAL, APART = np.arange(6)
"""Places in count_6."""


COLUMNS = 16
"""Of a tile (`mrhubo.fast.compiled.tile`)."""
INPUTS, OUTPUTS, LONG_AT, SHORT_AT, SCALED_AT, LINEAR = np.arange(6)
"""Places in a row of layer_G6."""
_ROUNDED = 1e-5
"""Distance [m] by which no robot moves where its joint angles are rounded to float32."""


class Packed(NamedTuple):
    """A description in four arrays."""

    integers: np.ndarray
    """First where each table begins and how long it is; then the tables of integers."""
    floats: np.ndarray
    singles: np.ndarray
    """float32."""
    shorts: np.ndarray
    """int16 (`mrhubo.fast.short_weights`). Reading weights is most of what a frame alone takes; at half of their size
    it takes two thirds. The networks' layers whose weights are rounded to it are here for that, and in float32 for
    many frames. The body prior's large layers are here alone: rounding them changes phi by less than a hundredth."""


def pack(description: Description) -> Packed:
    """The arrays of a description."""
    found = {}
    for name in SECTIONS:
        section = getattr(description, name)
        found |= {field.name: getattr(section, field.name) for field in fields(section)}
    shorts, clear_Y = [np.zeros(0, np.int16)], clearances(description, CLEARANCE)
    found |= _of_legs(description)
    found |= {**_derived(description, clear_Y), **_nets(description, shorts, bool((clear_Y > _ROUNDED).all()))}
    integers: list[np.ndarray] = [np.zeros(2 * len(KEYS), np.int64)]
    floats, singles = [np.zeros(0)], [np.zeros(0, np.float32)]
    for place, key in enumerate(KEYS):
        table = np.asarray(found[key]).reshape(-1)
        into = {"i": integers, "f": floats if table.dtype == np.float64 else singles}[table.dtype.kind]
        integers[0][2 * place : 2 * place + 2] = _append(into, table)
    return Packed(
        np.concatenate(integers).astype(np.int64),
        np.concatenate(floats),
        np.concatenate(singles),
        np.concatenate(shorts),
    )


_OF_LEGS = [field.name for field in fields(Legs) if not field.name.startswith("block_")]
_WHOLE_OF_LEGS = (
    "joint_L", "parent_L", "start_R", "sole_H", "carrier_1", "body_H", "ball_body_J", "near_HJ", "limb_R2", "foot_R2",
)  # fmt: skip


def _of_legs(d: Description) -> dict[str, np.ndarray]:
    if d.legs is None:
        nothing = {name: np.zeros(0, np.int64 if name in _WHOLE_OF_LEGS else np.float64) for name in _OF_LEGS}
        return {**nothing, "block_H": np.zeros(0, np.int64)}
    moved_HN = np.abs(moved_points(d, d.legs)).sum(axis=1) > 0
    block_H = np.where(moved_HN.any(axis=1), d.cost.block_N[moved_HN.argmax(axis=1)], -1)
    return {**{name: getattr(d.legs, name) for name in _OF_LEGS}, "block_H": block_H}


def _derived(d: Description, clear_Y: np.ndarray) -> dict[str, np.ndarray]:
    """What is worked out of a description's arrays."""
    constants, capsules, k = d.settings.constants, d.capsules, d.kinematics
    groups, reach_S = make_groups(capsules), reaches(capsules)
    reach_Z = reach_S[groups.capsule_Z] + groups.radius_G[groups.ball_Z] + groups.most(np.maximum(clear_Y, 0.0))
    origin_A33, across_A33 = k.origin_A34[..., :3], skew(k.axis_A3)
    orders, firsts = [], []
    for own_XC in (d.cost.joints_NC, d.cost.directions_DC):
        orders.append(np.concatenate([np.flatnonzero(column) for column in own_XC.T]))
        firsts.append(np.concatenate(([0], own_XC.sum(axis=0).cumsum())).astype(np.int64))
    ends = [constants[f"{name}_deg"] for name in ("plane_low", "plane_high", "needed_low", "needed_high")]
    order_CU, first_CS = np.argsort(d.cost.cell_CU, axis=1, kind="stable"), []
    for cell_U in np.sort(d.cost.cell_CU, axis=1):
        first_CS.append(np.searchsorted(cell_U, np.arange(int(constants["starts"]) + 1)))
    pools = [d.cost.pool_UD3[order_U][:, d.cost.block_D == c] for c, order_U in enumerate(order_CU)]
    polish = [constants["far_rad"] ** 2, constants["gain_rad"] ** 2, constants["starts"], constants["first_steps"]]
    scale = [constants[name] for name in ("good_deg", "excess_deg", "shake_deg", "usual_phi")]
    return {
        "position_A3": k.origin_A34[..., 3], "origin_A33": origin_A33, "across_A33": origin_A33 @ across_A33,
        "twice_A33": origin_A33 @ across_A33 @ across_A33, "order_N": orders[0], "first_C": firsts[0],
        "pool_CXU": np.concatenate([pool.reshape(len(pool), -1).T.reshape(-1) for pool in pools]),
        "first_CS": np.array(first_CS), "pool_CU": order_CU,
        "pool_ridge_CU": np.take_along_axis(d.cost.pool_ridge_CU, order_CU, axis=1),
        "order_D": orders[1], "first_D": firsts[1], "bend_4": np.radians(ends), "polish_4": np.array(polish),
        "scale_4": np.array(scale), "reach_S": reach_S, "clear_Y": clear_Y[groups.order_Y],
        "pair_Y2": capsules.pair_Y2[groups.order_Y], "first_Z": groups.first_Z, "capsule_Z": groups.capsule_Z,
        "ball_Z": groups.ball_Z, "reach_Z": reach_Z, "body_G": groups.body_G, "centre_G3": groups.centre_G3,
    }  # fmt: skip


def _nets(d: Description, shorts: list[np.ndarray], apart: bool) -> dict[str, np.ndarray]:
    nets, layers, columns, numbers = [], [], [np.zeros(0, np.int64)], [np.zeros(0, np.float32)]
    turned = [np.zeros(0, np.float32)]

    def add(part: Part) -> None:
        nets.append([len(layers), len(part.layers), *_append(columns, part.input), *_append(columns, part.output)])
        for weight, bias in part.layers:
            add_layer(weight, bias, True, are_short(weight), False)

    def add_layer(weight: np.ndarray, bias: np.ndarray, in_full: bool, short: bool, linear: bool) -> None:
        long_at, short_at, scaled_at = -1, -1, -1
        if in_full:
            long_at, _ = _append(turned, in_columns(np.column_stack((weight, bias))))
        if short:
            steps_OE, step_O = shortened(weight)
            short_at, _ = _append(shorts, in_columns(steps_OE))
            scaled_at, _ = _append(numbers, in_columns(np.stack((bias, step_O), axis=1)))
        layers.append([weight.shape[1], weight.shape[0], long_at, short_at, scaled_at, linear])

    for part in (*d.pre, *d.post):
        add(part)
    for coder in (narrowed(d), [(*layer, False) for layer in d.prior.decoder]):
        nets.append([len(layers), len(coder), 0, 0, 0, 0])
        for weight, bias, linear in coder:
            add_layer(weight, bias, weight.size < LARGE, weight.size >= LARGE, linear)
    kinds = [d.settings.features == "directions", d.settings.bound == "tanh", d.settings.residual, apart]
    return {
        "net_H6": np.array(nets, np.int64), "layer_G6": np.array(layers, np.int64), "column": np.concatenate(columns),
        "count_6": np.array([len(d.pre), len(d.pre) + len(d.post), *kinds], np.int64),
        "number": np.concatenate(numbers), "turned": np.concatenate(turned),
    }  # fmt: skip


def in_columns(rows_OE: np.ndarray) -> np.ndarray:
    """A layer's rows as columns, with zeros behind, so that there are as many columns as `spaced` says."""
    more = spaced.py_func(len(rows_OE)) - len(rows_OE)
    return np.pad(rows_OE.T, [(0, 0), (0, more)]).reshape(-1)


def _append(into: list[np.ndarray], array: np.ndarray) -> tuple[int, int]:
    place = sum(map(len, into))
    into.append(array)
    return place, len(array)


COMPILED: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz"}, "nogil": True}
"""How functions are compiled: sums in any order, division by zero as NumPy has it."""
INNER: dict[str, Any] = {**COMPILED, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""The same for those that compiled functions alone call,"""
INNER_EXACT: dict[str, Any] = {**INNER, "fastmath": False}
"""and for those of them that must see NaN as it is."""


@njit(**INNER)
def spaced(columns):
    """How long rows of so many columns are: whole tiles, and one more where the beginnings of rows would compete for
    the same few places of the processor's nearest memory, as multiples of 1,024 bytes do.
    """
    whole = columns + -columns % COLUMNS
    return whole if whole % 256 else whole + COLUMNS


@njit(**INNER)
def size(t, key):
    """How many numbers a table has."""
    return t[0][2 * key + 1]


@njit(**INNER)
def whole(t, key, place):
    """A number of a table of integers."""
    return t[0][t[0][2 * key] + place]


@njit(**INNER)
def real(t, key, place):
    """A number of a table of float64."""
    return t[1][t[0][2 * key] + place]


@njit(**INNER)
def single(t, key, place):
    """A number of a table of float32."""
    return t[2][t[0][2 * key] + place]


@njit(**INNER)
def vector(t, key, place):
    """Three numbers of a table of float64, of which each row has three."""
    at = t[0][2 * key] + 3 * place
    return t[1][at], t[1][at + 1], t[1][at + 2]
