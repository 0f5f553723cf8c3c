"""Cholesky factors of a motion's systems (`mrhubo.fast.together.banded`), sixteen numbers at a time.

Columns are found one after the other. A column is what the matrix has there less what earlier columns, of which each
reaches a short way down, add to it; sixteen of its numbers at a time stay in the processor's registers while these are
gone through (`_make_column`). What numba makes of loops over so few numbers works on them one by one, which takes six
times as long. `column_RV[r]` holds the column from the diagonal downwards, the reciprocal in place of its diagonal, and
zeros beyond what the band reaches, so that whole vectors may be read from any of its numbers on.

Legend: T frames, M joints of one block, K couplings, R = T M rows, V entries of a column.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # pyright: ignore[reportMissingImports]
from numba import njit, types  # pyright: ignore[reportMissingImports]
from numba.core import cgutils  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.tables import INNER
from mrhubo.fast.compiled.vectors import add_product, everywhere, in_llvm, is_array

_SUMS = 16
"""Numbers of a column that are found together."""
_BEYOND = _SUMS - 1
"""Zeros behind a column, as sixteen numbers are read from its last one on."""
_NUMBERS = ir.VectorType(ir.DoubleType(), _SUMS)


def _make_column(at_diagonal: bool) -> Any:
    """A function that finds sixteen numbers of a column: from those that stand at a place it takes the products of some
    numbers, from `first` on and so far apart, with the sixteen that begin `apart` behind each. It scales them by what
    is given, and at a diagonal by the reciprocal of its square root, which it puts there. Returns what it scaled by.
    """

    @in_llvm
    def column(typing_context, array, at, first, step, apart, count, scale):
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            data = context.make_array(signature.args[0])(context, builder, values[0]).data
            begin = ir.Constant(ir.IntType(32), 0)

            def numbers(place: Any) -> Any:
                return builder.bitcast(builder.gep(data, [place]), _NUMBERS.as_pointer())

            found = cgutils.alloca_once(builder, _NUMBERS)
            builder.store(builder.load(numbers(values[1]), align=8), found)
            with cgutils.for_range(builder, values[5], intp=values[1].type) as loop:
                place = builder.add(values[2], builder.mul(loop.index, values[3]))
                each = everywhere(builder, builder.fneg(builder.load(builder.gep(data, [place]))), _NUMBERS)
                add_product(builder, found, each, builder.load(numbers(builder.add(place, values[4])), align=8))
            less, by = builder.load(found), values[6]
            if at_diagonal:
                root = builder.module.declare_intrinsic("llvm.sqrt", [ir.DoubleType()])
                by = builder.fdiv(
                    ir.Constant(ir.DoubleType(), 1.0), builder.call(root, [builder.extract_element(less, begin)])
                )
            less = builder.fmul(less, everywhere(builder, by, _NUMBERS))
            if at_diagonal:
                less = builder.insert_element(less, by, begin)
            builder.store(less, numbers(values[1]), align=8)
            return by

        answer = types.float64(array, *[types.intp] * 5, types.float64)
        return (answer, generate) if is_array(array, types.float64) else None

    return column


_first, _next = _make_column(True), _make_column(False)


@njit(**INNER)
def factor(within_TMM, diagonal_TM, coupling_KTMM):
    """Cholesky factor (R, V) of a `Banded`, column after column."""
    frames, joints = diagonal_TM.shape
    reach = len(coupling_KTMM)
    wide = (reach + 1) * joints
    long = wide + _BEYOND
    column_RV = np.zeros((frames * joints, long))
    for t in range(frames):
        for n in range(joints):
            own_V = column_RV[t * joints + n]
            own_V[0] = diagonal_TM[t, n]
            for m in range(n + 1, joints):
                own_V[m - n] = within_TMM[t, m, n]
            for lag in range(1, min(reach, frames - 1 - t) + 1):
                for m in range(joints):
                    own_V[lag * joints + m - n] = coupling_KTMM[lag - 1, t, m, n]
    for r in range(frames * joints):
        earlier = min(r, wide - 1)
        scale = _first(column_RV, r * long, (r - earlier) * long + earlier, long - 1, 0, earlier, 0.0)
        for v in range(_SUMS, wide, _SUMS):
            earlier = min(r, wide - 1 - v)
            _next(column_RV, r * long + v, (r - earlier) * long + earlier, long - 1, v, earlier, scale)
    return column_RV


@njit(**INNER)
def solve(column_RV, x_R):
    """The solution of a system whose factor is given, in the place of its right side."""
    rows, long = column_RV.shape
    wide = long - _BEYOND
    number_Y = column_RV.reshape(rows * long)
    for r in range(rows):
        earlier, found = min(r, wide - 1), x_R[r]
        for e in range(1, earlier + 1):
            found -= number_Y[(r - e) * long + e] * x_R[r - e]
        x_R[r] = found * number_Y[r * long]
    for r in range(rows - 1, -1, -1):
        own_V, later_V = column_RV[r], x_R[r : r + wide]
        found = x_R[r]
        for v in range(1, len(later_V)):
            found -= own_V[v] * later_V[v]
        x_R[r] = found * own_V[0]
