"""Arrays of lanes (`mrhubo.fast.compiled.lanes`), which are read and written as arrays of numbers are.

A `LaneArray` is a C-contiguous array of float64 whose last axis are the lanes; a place names all axes before. Places
are not negative, and are not checked.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir  # pyright: ignore[reportMissingImports]
from numba import types  # pyright: ignore[reportMissingImports]
from numba.core import cgutils  # pyright: ignore[reportMissingImports]
from numba.extending import (  # pyright: ignore[reportMissingImports]
    models,
    overload,
    overload_attribute,
    register_model,
)

from mrhubo.fast.compiled.lanes import BARE, LANES, NUMBERS, Lanes, spread
from mrhubo.fast.compiled.vectors import in_llvm


class _LaneArrayType(types.Type):
    def __init__(self, axes: int) -> None:
        self.axes = axes
        self.array = types.Array(types.float64, axes + 1, "C")
        super().__init__(name=f"LaneArray({axes})")


@register_model(_LaneArrayType)
class _LaneArrayModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("array", kind.array)])


@in_llvm
def side_by_side(typing_context: Any, array: Any) -> Any:
    """The `LaneArray` of an array of float64 whose last axis has as many numbers as there are lanes."""
    kind = _LaneArrayType(array.ndim - 1)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        made = cgutils.create_struct_proxy(kind)(context, builder)
        made.array = values[0]
        context.nrt.incref(builder, kind.array, values[0])
        return made._getvalue()

    return (kind(array), generate) if array == kind.array else None


def zeros(kind: Any, shape: Any) -> Any:
    """An array, or a `LaneArray` if the kind is that of lanes."""
    raise NotImplementedError("compiled alone")


def room(kind: Any, shape: Any) -> Any:
    """As `zeros`, with any numbers: memory that is not used is not touched."""
    raise NotImplementedError("compiled alone")


def _made_by(function: Any, make: Any) -> None:
    @overload(function, BARE)
    def of_kind(kind, shape):
        if kind == Lanes:
            return lambda kind, shape: side_by_side(make((*shape, LANES)))
        return lambda kind, shape: make(shape)


_made_by(zeros, np.zeros)
_made_by(room, np.empty)


@in_llvm
def inside(typing_context: Any, lanes: Any) -> Any:
    """The array itself of a `LaneArray`."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        array = cgutils.create_struct_proxy(signature.args[0])(context, builder, values[0]).array
        context.nrt.incref(builder, signature.return_type, array)
        return array

    return (lanes.array(lanes), generate) if isinstance(lanes, _LaneArrayType) else None


@overload_attribute(_LaneArrayType, "shape")
def _shape_of(lanes):
    """Its axes, with lanes last."""
    return lambda lanes: inside(lanes).shape


@overload(len, BARE)
def _length(lanes):
    return (lambda lanes: len(inside(lanes))) if isinstance(lanes, _LaneArrayType) else None


def _address(context: Any, builder: Any, kind: Any, value: Any, place_kind: Any, place: Any) -> Any:
    array = cgutils.create_struct_proxy(kind)(context, builder, value).array
    array = context.make_array(kind.array)(context, builder, array)
    places = cgutils.unpack_tuple(builder, place) if isinstance(place_kind, types.BaseTuple) else [place]
    kinds = list(place_kind) if isinstance(place_kind, types.BaseTuple) else [place_kind]  # pyright: ignore[reportArgumentType]
    at, sizes = None, cgutils.unpack_tuple(builder, array.shape)
    for axis, (own_kind, own) in enumerate(zip(kinds, places, strict=True)):
        own = context.cast(builder, own, own_kind, types.intp)
        at = own if at is None else builder.add(builder.mul(at, sizes[axis], flags=("nsw",)), own, flags=("nsw",))
    assert at is not None, "a place names at least one axis"
    at = builder.mul(at, ir.Constant(at.type, LANES), flags=("nsw",))
    return builder.bitcast(builder.gep(array.data, [at], inbounds=True), NUMBERS.as_pointer())


def _fits(lanes: Any, place: Any) -> bool:
    if not isinstance(lanes, _LaneArrayType):
        return False
    axes = len(place) if isinstance(place, types.BaseTuple) else 1
    return axes == lanes.axes


@in_llvm
def _get(typing_context: Any, lanes: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address = _address(context, builder, signature.args[0], values[0], signature.args[1], values[1])
        return builder.load(address, align=8)

    return Lanes(lanes, place), generate


@in_llvm
def _put(typing_context: Any, lanes: Any, place: Any, number: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address = _address(context, builder, signature.args[0], values[0], signature.args[1], values[1])
        builder.store(spread(context, builder, signature.args[2], values[2]), address, align=8)
        return context.get_dummy_value()

    return types.void(lanes, place, number), generate


@overload(operator.getitem, BARE)
def _getitem(lanes, place):
    return (lambda lanes, place: _get(lanes, place)) if _fits(lanes, place) else None


@overload(operator.setitem, BARE)
def _setitem(lanes, place, number):
    return (lambda lanes, place, number: _put(lanes, place, number)) if _fits(lanes, place) else None


@in_llvm
def scatter(typing_context: Any, lanes: Any, array: Any, row: Any, step: Any, column: Any) -> Any:
    """Lanes into a column of a float32 array (rows, columns): the first into a row, the next so many rows below."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        single = builder.fptrunc(values[0], ir.VectorType(ir.FloatType(), LANES))
        for lane, address in enumerate(_column(context, builder, signature.args[1], *values[1:])):
            builder.store(builder.extract_element(single, ir.Constant(ir.IntType(32), lane)), address)
        return context.get_dummy_value()

    kinds = (Lanes, types.Array(types.float32, 2, "C"), types.intp, types.intp, types.intp)
    return types.void(*kinds), generate


def _column(context: Any, builder: Any, kind: Any, value: Any, row: Any, step: Any, column: Any) -> list[Any]:
    """Addresses in a column."""
    array = context.make_array(kind)(context, builder, value)
    width = cgutils.unpack_tuple(builder, array.shape)[1]
    found, jump = [builder.add(builder.mul(row, width), column)], builder.mul(step, width)
    for _ in range(LANES - 1):
        found.append(builder.add(found[-1], jump))
    return [builder.gep(array.data, [place], inbounds=True) for place in found]
