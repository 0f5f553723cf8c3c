"""Products of small matrices of float32, twelve or four rows by sixteen columns at a time.

The sums of such a tile stay in the processor's registers while the inner index runs, so that a multiplication waits for
no memory. What numba makes of a loop over arrays loads and stores each sum at every step, which takes two to four
times as long; so the tile is written in LLVM's own operations on vectors, which LLVM cuts to what the processor has.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # pyright: ignore[reportMissingImports]
from llvmlite.binding import get_host_cpu_features  # pyright: ignore[reportMissingImports]
from numba import njit, types  # pyright: ignore[reportMissingImports]
from numba.core import cgutils  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.tables import COLUMNS, INNER
from mrhubo.fast.compiled.vectors import add_product, everywhere, in_llvm, is_array

ROWS = 4
"""Of the smallest tile, and `COLUMNS`. Arrays have room for whole ones: what is beyond a product's own rows and columns
is written over."""
_MANY = 12
"""Rows of which the sums, sixteen columns wide, fill the registers of AVX-512 as far as two of them wait for another;
those of half of them fill AVX's."""
_TALL = _MANY if get_host_cpu_features().get("avx512f") else _MANY // 2
_SINGLES = ir.VectorType(ir.FloatType(), COLUMNS)
_SHORTS, _WHOLE = (ir.VectorType(ir.IntType(bits), COLUMNS) for bits in (16, 32))


def whole_tiles(count: int, each: int) -> int:
    """Rounded up to a multiple."""
    return count + -count % each


def _make_tile(count: int) -> Any:
    """A function that finds out = begin + x w in one tile of so many rows. Of each array, it is told the place where
    its part begins, and from one row to the next.
    """

    @in_llvm
    def tile(
        typing_context, x, x_at, x_step, w, w_at, w_step, begin, begin_at, begin_step, out, out_at, out_step, inputs
    ):
        arrays = {0: x, 3: w, 6: begin, 9: out}

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            index = values[1].type

            def address(array: int, row: Any, column: Any) -> Any:
                data = context.make_array(signature.args[array])(context, builder, values[array]).data
                place = builder.add(values[array + 1], builder.mul(row, values[array + 2]))
                return builder.gep(data, [builder.add(place, column)])

            def columns(array: int, row: Any) -> Any:
                return builder.bitcast(address(array, row, ir.Constant(index, 0)), _SINGLES.as_pointer())

            rows = [ir.Constant(index, row) for row in range(count)]
            sums = [cgutils.alloca_once(builder, _SINGLES) for _ in rows]
            for row, found in zip(rows, sums, strict=True):
                builder.store(builder.load(columns(6, row), align=4), found)
            with cgutils.for_range(builder, values[12], intp=index) as loop:
                weight = builder.load(columns(3, loop.index), align=4)
                for row, found in zip(rows, sums, strict=True):
                    each = everywhere(builder, builder.load(address(0, row, loop.index)), _SINGLES)
                    add_product(builder, found, each, weight)
            for row, found in zip(rows, sums, strict=True):
                builder.store(builder.load(found), columns(9, row), align=4)
            return context.get_dummy_value()

        fits = all(is_array(given, types.float32) for given in arrays.values())
        return (types.void(*(arrays.get(k, types.intp) for k in range(13))), generate) if fits else None

    return tile


def _make_line(parts: int, short: bool = False) -> Any:
    """A function as those of tiles, for one row and so many times sixteen columns, which read memory in its own order.
    `short`: weights are int16.
    """
    kinds = {0: types.float32, 1: types.int16 if short else types.float32, 4: types.float32, 6: types.float32}

    @in_llvm
    def line(typing_context, x, w, w_at, w_step, begin, begin_at, out, out_at, inputs):
        arrays = {0: x, 1: w, 4: begin, 6: out}

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            index, read = values[2].type, _SHORTS if short else _SINGLES
            data = {k: context.make_array(signature.args[k])(context, builder, values[k]).data for k in arrays}

            def columns(array: int, place: Any, part: int) -> Any:
                address = builder.gep(data[array], [builder.add(place, ir.Constant(index, COLUMNS * part))])
                return builder.bitcast(address, (read if array == 1 else _SINGLES).as_pointer())

            sums = [cgutils.alloca_once(builder, _SINGLES) for _ in range(parts)]
            for part, found in enumerate(sums):
                builder.store(builder.load(columns(4, values[5], part), align=4), found)
            with cgutils.for_range(builder, values[8], intp=index) as loop:
                each = everywhere(builder, builder.load(builder.gep(data[0], [loop.index])), _SINGLES)
                place = builder.add(values[2], builder.mul(loop.index, values[3]))
                for part, found in enumerate(sums):
                    weight = builder.load(columns(1, place, part), align=2 if short else 4)
                    if short:
                        weight = builder.sitofp(builder.sext(weight, _WHOLE), _SINGLES)
                    add_product(builder, found, each, weight)
            for part, found in enumerate(sums):
                builder.store(builder.load(found), columns(6, values[7], part), align=4)
            return context.get_dummy_value()

        fits = all(is_array(given, kinds[k]) for k, given in arrays.items())
        return (types.void(*(arrays.get(k, types.intp) for k in range(9))), generate) if fits else None

    return line


@in_llvm
def unpack(typing_context, w, w_at, w_step, scale, scale_at, out, inputs):
    """out[i] = w[i] * scale: sixteen columns of int16, from a place on, and from one row to the next, become rows of
    float32 of their own.
    """
    kinds = {0: (w, types.int16), 3: (scale, types.float32), 5: (out, types.float32)}

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data = {k: context.make_array(signature.args[k])(context, builder, values[k]).data for k in kinds}

        def columns(array: int, place: Any, read: Any) -> Any:
            return builder.bitcast(builder.gep(data[array], [place]), read.as_pointer())

        each = builder.load(columns(3, values[4], _SINGLES), align=4)
        with cgutils.for_range(builder, values[6], intp=values[1].type) as loop:
            place = builder.add(values[1], builder.mul(loop.index, values[2]))
            weight = builder.sitofp(builder.sext(builder.load(columns(0, place, _SHORTS), align=2), _WHOLE), _SINGLES)
            into = builder.mul(loop.index, ir.Constant(values[1].type, COLUMNS))
            builder.store(builder.fmul(weight, each), columns(5, into, _SINGLES), align=4)
        return context.get_dummy_value()

    fits = all(is_array(given, kind) for given, kind in kinds.values())
    return (types.void(*(kinds[k][0] if k in kinds else types.intp for k in range(7))), generate) if fits else None


_low, _tall = _make_tile(ROWS), _make_tile(_TALL)


def _make_row(short: bool) -> Any:
    """`multiply_row`, or `multiply_short_row`."""
    ten, four, two, one = (_make_line(parts, short) for parts in (10, 4, 2, 1))

    @njit(**INNER)
    def row(x, w, begin, out, columns):
        inputs, wide = w.shape
        o = 0
        while o < columns:
            left = columns - o
            if left > 9 * COLUMNS:
                ten(x, w, o, wide, begin, o, out, o, inputs)
                o += 10 * COLUMNS
            elif left > 3 * COLUMNS:
                four(x, w, o, wide, begin, o, out, o, inputs)
                o += 4 * COLUMNS
            elif left > COLUMNS:
                two(x, w, o, wide, begin, o, out, o, inputs)
                o += 2 * COLUMNS
            else:
                one(x, w, o, wide, begin, o, out, o, inputs)
                o += COLUMNS

    return row


multiply_row, multiply_short_row = _make_row(False), _make_row(True)
"""out[0] = begin + x[0] w, for a matrix w (inputs, columns) alone, of float32 or int16, which is as wide as whole tiles
are. As many sums as there are registers run side by side, so that weights, which are read once, are read from one end
to the other."""


@njit(**INNER)
def multiply(x, x_at, w, w_at, begin, begin_at, begin_step, out, out_at, rows, columns, inputs):
    """out = begin + x w: matrices (rows, inputs) and (inputs, columns) inside arrays of two axes, each from a place on,
    counted through its array. `begin_step` is from one row to the next, 0 for one that is the same for all.
    """
    tall = rows - rows % _MANY
    for o in range(0, columns, COLUMNS):
        for r in range(0, tall, _TALL):
            _tall(
                x, x_at + r * x.shape[1], x.shape[1], w, w_at + o, w.shape[1], begin, begin_at + o + r * begin_step,
                begin_step, out, out_at + o + r * out.shape[1], out.shape[1], inputs,
            )  # fmt: skip
        for r in range(tall, rows, ROWS):
            _low(
                x, x_at + r * x.shape[1], x.shape[1], w, w_at + o, w.shape[1], begin, begin_at + o + r * begin_step,
                begin_step, out, out_at + o + r * out.shape[1], out.shape[1], inputs,
            )  # fmt: skip
