"""Products of small matrices by tiles."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")
from numba import njit

from mrhubo.fast.compiled import networks, tables, tile
from mrhubo.fast.short_weights import rounded, shortened


@njit(**tables.COMPILED)
def products(x: Any, w: Any, bias: Any, out: Any, rows: Any, columns: Any, inputs: Any) -> None:
    tile.multiply(x, 0, w, 0, bias, 0, 0, out, 0, rows, columns, inputs)


@njit(**tables.COMPILED)
def unpacked(short: Any, first: Any, scale: Any, out: Any) -> None:
    tile.unpack(short, first, short.shape[1], scale, first, out, short.shape[0])


@pytest.mark.parametrize("rows", [2, 4, 11, 12, 13, 24, 30, 48])
def test_products_are_those_of_numpy(rows: int) -> None:
    random = np.random.default_rng(rows)
    inputs, columns = int(random.integers(1, 90)), int(random.integers(1, 90))
    wide, room = tables.spaced.py_func(columns), rows + -rows % tile.ROWS
    x = random.normal(size=(room, inputs + 3)).astype(np.float32)
    w, bias = random.normal(size=(inputs, wide)).astype(np.float32), random.normal(size=wide).astype(np.float32)
    out = np.full((room, wide), np.nan, np.float32)
    products(x, w, bias, out, rows, columns, inputs)
    wanted = x[:rows, :inputs].astype(np.float64) @ w[:, :columns] + bias[:columns]
    np.testing.assert_allclose(out[:rows, :columns], wanted, atol=1e-4)


def test_layers_of_16_bits_are_unpacked_to_what_they_are() -> None:
    random = np.random.default_rng(0)
    short = random.integers(-32_767, 32_768, size=(37, 64)).astype(np.int16)
    scale = random.uniform(1e-5, 1e-3, size=64).astype(np.float32)
    out = np.full((40, tables.COLUMNS), np.nan, np.float32)
    unpacked(short, 32, scale, out)
    np.testing.assert_array_equal(out[:37], short[:, 32:48] * scale[32:48])
    assert np.isnan(out[37:]).all()


@pytest.mark.parametrize("in_full", [False, True])
def test_one_frame_and_many_agree_on_layers_of_16_bits(in_full: bool) -> None:
    """They are multiplied as they are for one frame; for many, unpacked, or in float32, where they are there too."""
    random = np.random.default_rng(1)
    weight_OI = rounded(random.normal(size=(300, 250)).astype(np.float32))
    bias_O, (short_OI, step_O) = random.normal(size=300).astype(np.float32), shortened(weight_OI)
    scaled = tables.in_columns(np.stack((bias_O, step_O), axis=1))
    full = tables.in_columns(np.column_stack((weight_OI, bias_O)))
    row = [250, 300, len(scaled) if in_full else -1, 0, 0, 0]
    places = {int(tables.NET_H6): [0, 1, 0, 0, 0, 0], int(tables.LAYER_G6): row}
    integers = np.zeros(2 * len(tables.KEYS) + 12, np.int64)
    at = 2 * len(tables.KEYS)
    for key, table in places.items():
        integers[2 * key : 2 * key + 2] = at, len(table)
        integers[at : at + len(table)], at = table, at + len(table)
    packed = (integers, np.zeros(0), np.concatenate((scaled, full)), tables.in_columns(short_OI))
    x_BI = random.normal(size=(20, 304)).astype(np.float32)
    for adds in (False, True) if in_full else (False,):
        wanted = x_BI[:, :250].astype(np.float64) @ weight_OI.T + bias_O + adds
        many, _ = layer(packed, x_BI.copy(), adds, 20, 20)
        for most in (1, 20):  # the last of many frames may be alone, in rooms for more
            ones = [layer(packed, x_BI[b : b + 1].copy(), adds, 1, most) for b in range(20)]
            assert all(loose >= one_BE.shape[1] for one_BE, loose in ones)  # nothing else tells of sums beside it
            alone = np.concatenate([one_BE[:1] for one_BE, _ in ones])
            np.testing.assert_allclose(alone[:, :300], wanted, atol=1e-4)
        np.testing.assert_allclose(many[:20, :300], wanted, atol=1e-4)


@njit(**tables.COMPILED)
def layer(t: Any, x_BI: Any, adds: Any, frames: Any, most: Any) -> Any:
    one_BE, _, _, loose_X = networks.make_rooms(t, most, 1)
    one_BE[:] = 1
    networks.affine(t, 0, x_BI, one_BE, loose_X, adds, frames)
    return one_BE, len(loose_X)
