"""Eight numbers side by side: what compiled functions do to one frame, they do to eight at once.

numba makes good use of a processor's vectors in short loops over arrays alone; kinematics and steps are neither. So a
value of `Lanes` holds one number of each of eight frames, and adds, multiplies and compares as a number does: functions
that know nothing of it work on eight frames, where they are given such values. LLVM cuts eight numbers to what the
processor has. `LaneArray` is an array of such values, whose places are not negative.

What depends on a number, which may be true in one frame and false in another, is written as `choose(condition, a, b)`;
`some(condition)` tells whether it is true anywhere. Both take a single number's condition too.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # pyright: ignore[reportMissingImports]
from numba import njit, types  # pyright: ignore[reportMissingImports]
from numba.core import cgutils  # pyright: ignore[reportMissingImports]
from numba.core.typeconv import Conversion  # pyright: ignore[reportMissingImports]
from numba.extending import (  # pyright: ignore[reportMissingImports]
    intrinsic,
    lower_cast,
    models,
    overload,
    overload_attribute,
    register_model,
)

from mrhubo.fast.compiled.tables import INNER

LANES = 8
_NUMBERS = ir.VectorType(ir.DoubleType(), LANES)
_TRUTHS = ir.VectorType(ir.IntType(1), LANES)
_WORDS = ir.VectorType(ir.IntType(64), LANES)
_FAST = ("reassoc", "contract", "nsz")
"""As `COMPILED` has it for single numbers."""


class _LanesType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Lanes")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        return self if isinstance(other, types.Float | types.Integer) else None


class _TruthsType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Truths")


class _LaneArrayType(types.Type):
    def __init__(self, axes: int) -> None:
        self.axes = axes
        self.array = types.Array(types.float64, axes + 1, "C")
        super().__init__(name=f"LaneArray({axes})")


Lanes, Truths = _LanesType(), _TruthsType()


@register_model(_LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _NUMBERS)


@register_model(_TruthsType)
class _TruthsModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _TRUTHS)


@register_model(_LaneArrayType)
class _LaneArrayModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("array", kind.array)])


def _everywhere(builder: Any, value: Any, vector: Any) -> Any:
    """One number in all lanes."""
    unset = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(unset, value, ir.Constant(ir.IntType(32), 0))
    same = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, unset, same)


def _is_number(kind: Any) -> bool:
    return isinstance(kind, types.Float | types.Integer)


def _spread(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Lanes of lanes or of a number."""
    if kind == Lanes:
        return value
    return _everywhere(builder, context.cast(builder, value, kind, types.float64), _NUMBERS)


@lower_cast(types.Float, _LanesType)
@lower_cast(types.Integer, _LanesType)
def _cast(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return _spread(context, builder, given, value)


def _elementwise(build: Callable[..., Any], result: Any) -> Any:
    """A function of lanes and numbers, of which LLVM has the operation."""

    @intrinsic(prefer_literal=False)
    def apply(typing_context: Any, a: Any, b: Any) -> Any:
        if Lanes not in (a, b) or not all(kind == Lanes or _is_number(kind) for kind in (a, b)):
            return None

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            given = zip(signature.args, values, strict=True)
            return build(builder, *(_spread(context, builder, kind, value) for kind, value in given))

        return result(a, b), generate

    return apply


def _overloaded(function: Any, build: Callable[..., Any], result: Any) -> None:
    apply = _elementwise(build, result)

    @overload(function)
    def of_two(a, b):
        if Lanes in (a, b) and all(kind == Lanes or _is_number(kind) for kind in (a, b)):
            return lambda a, b: apply(a, b)
        return None


for _function, _name in (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv"),
    (operator.iadd, "fadd"), (operator.isub, "fsub"), (operator.imul, "fmul"),
):  # fmt: skip
    _overloaded(_function, lambda builder, a, b, name=_name: getattr(builder, name)(a, b, flags=_FAST), Lanes)
for _function, _name in (
    (operator.lt, "<"), (operator.gt, ">"), (operator.le, "<="), (operator.ge, ">="), (operator.ne, "!="),
):  # fmt: skip
    _overloaded(
        _function,
        lambda builder, a, b, name=_name: (builder.fcmp_unordered if name == "!=" else builder.fcmp_ordered)(
            name, a, b
        ),
        Truths,
    )
_overloaded(min, lambda builder, a, b: builder.select(builder.fcmp_ordered("<", b, a), b, a), Lanes)
_overloaded(max, lambda builder, a, b: builder.select(builder.fcmp_ordered(">", b, a), b, a), Lanes)


def _of_one(name: str) -> Any:
    @intrinsic
    def apply(typing_context: Any, a: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            kind = ir.FunctionType(_NUMBERS, [_NUMBERS])
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64")
            return builder.call(function, values)

        return (Lanes(a), generate) if a == Lanes else None

    return apply


_root, _size = _of_one("sqrt"), _of_one("fabs")


@overload(math.sqrt)
def _sqrt(a):
    return (lambda a: _root(a)) if a == Lanes else None


@overload(abs)
def _abs(a):
    return (lambda a: _size(a)) if a == Lanes else None


@overload(operator.neg)
def _neg(a):
    return (lambda a: 0.0 - a) if a == Lanes else None


def _of_truths(name: str) -> Any:
    @intrinsic
    def apply(typing_context: Any, a: Any, b: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            both = [
                value if kind == Truths else _everywhere(builder, value, _TRUTHS)
                for kind, value in zip(signature.args, values, strict=True)
            ]
            return getattr(builder, name)(*both)

        return Truths(a, b), generate

    return apply


_both, _either = _of_truths("and_"), _of_truths("or_")


@overload(operator.and_)
def _and(a, b):
    return (lambda a, b: _both(a, b)) if Truths in (a, b) else None


@overload(operator.or_)
def _or(a, b):
    return (lambda a, b: _either(a, b)) if Truths in (a, b) else None


@intrinsic
def _chosen(typing_context: Any, condition: Any, a: Any, b: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        one, two = (_spread(context, builder, signature.args[k], values[k]) for k in (1, 2))
        return builder.select(values[0], one, two)

    return Lanes(condition, a, b), generate


@intrinsic
def _any(typing_context: Any, condition: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(condition), generate


def choose(condition: Any, a: Any, b: Any) -> Any:
    """`a` where the condition is true, else `b`."""
    raise NotImplementedError("compiled alone")


@overload(choose)
def _choose(condition, a, b):
    if condition == Truths:
        return lambda condition, a, b: _chosen(condition, a, b)
    return lambda condition, a, b: a if condition else b


def some(condition: Any) -> Any:
    """Whether a condition is true in any lane."""
    raise NotImplementedError("compiled alone")


@overload(some)
def _some(condition):
    return (lambda condition: _any(condition)) if condition == Truths else (lambda condition: condition)


def alike(other: Any, number: float) -> Any:
    """A number, in lanes if the other is."""
    raise NotImplementedError("compiled alone")


@overload(alike)
def _alike(other, number):
    return (lambda other, number: filled(number)) if other == Lanes else (lambda other, number: float(number))


@intrinsic
def filled(typing_context: Any, number: Any) -> Any:
    """A number in all lanes."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _spread(context, builder, signature.args[0], values[0])

    return Lanes(number), generate


def no(condition: Any) -> Any:
    """Where a condition is false."""
    raise NotImplementedError("compiled alone")


@intrinsic
def _not(typing_context: Any, condition: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.not_(values[0])

    return Truths(condition), generate


@overload(no)
def _no(condition):
    return (lambda condition: _not(condition)) if condition == Truths else (lambda condition: not condition)


@intrinsic
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


@overload(zeros)
def _zeros(kind, shape):
    if kind == Lanes:
        return lambda kind, shape: side_by_side(np.zeros((*shape, LANES)))
    return lambda kind, shape: np.zeros(shape)


@intrinsic
def _inside(typing_context: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        array = cgutils.create_struct_proxy(signature.args[0])(context, builder, values[0]).array
        context.nrt.incref(builder, signature.return_type, array)
        return array

    return (lanes.array(lanes), generate) if isinstance(lanes, _LaneArrayType) else None


@overload_attribute(_LaneArrayType, "array")
def _array_of(lanes):
    """The array itself, with lanes last."""
    return lambda lanes: _inside(lanes)


@overload_attribute(_LaneArrayType, "shape")
def _shape_of(lanes):
    """Its axes, with lanes last."""
    return lambda lanes: _inside(lanes).shape


@overload(len)
def _length(lanes):
    return (lambda lanes: len(_inside(lanes))) if isinstance(lanes, _LaneArrayType) else None


def _address(context: Any, builder: Any, kind: Any, value: Any, place_kind: Any, place: Any) -> Any:
    array = cgutils.create_struct_proxy(kind)(context, builder, value).array
    array = context.make_array(kind.array)(context, builder, array)
    places = cgutils.unpack_tuple(builder, place) if isinstance(place_kind, types.BaseTuple) else [place]
    kinds = list(place_kind) if isinstance(place_kind, types.BaseTuple) else [place_kind]
    at, sizes = None, cgutils.unpack_tuple(builder, array.shape)
    for axis, (own_kind, own) in enumerate(zip(kinds, places, strict=True)):
        own = context.cast(builder, own, own_kind, types.intp)
        at = own if at is None else builder.add(builder.mul(at, sizes[axis], flags=("nsw",)), own, flags=("nsw",))
    at = builder.mul(at, ir.Constant(at.type, LANES), flags=("nsw",))
    return builder.bitcast(builder.gep(array.data, [at], inbounds=True), _NUMBERS.as_pointer())


def _fits(lanes: Any, place: Any) -> bool:
    if not isinstance(lanes, _LaneArrayType):
        return False
    axes = len(place) if isinstance(place, types.BaseTuple) else 1
    return axes == lanes.axes


@intrinsic
def _get(typing_context: Any, lanes: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address = _address(context, builder, signature.args[0], values[0], signature.args[1], values[1])
        return builder.load(address, align=8)

    return Lanes(lanes, place), generate


@intrinsic
def _put(typing_context: Any, lanes: Any, place: Any, number: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address = _address(context, builder, signature.args[0], values[0], signature.args[1], values[1])
        builder.store(_spread(context, builder, signature.args[2], values[2]), address, align=8)
        return context.get_dummy_value()

    return types.void(lanes, place, number), generate


@overload(operator.getitem)
def _getitem(lanes, place):
    return (lambda lanes, place: _get(lanes, place)) if _fits(lanes, place) else None


@overload(operator.setitem)
def _setitem(lanes, place, number):
    return (lambda lanes, place, number: _put(lanes, place, number)) if _fits(lanes, place) else None


_nearest = _of_one("rint")


@njit(**INNER)
def rounded(a):
    """The nearest whole number, and two to its power, which is between -1022 and 1023."""
    nearest = _nearest(a)
    return nearest, _power(nearest)


@intrinsic
def _power(typing_context: Any, a: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = builder.add(_whole(builder, values[0]), _constant(_WORDS, 1023))
        return builder.bitcast(builder.shl(place, _constant(_WORDS, 52)), _NUMBERS)

    return Lanes(a), generate


def _whole(builder: Any, value: Any) -> Any:
    return builder.sext(builder.fptosi(value, ir.VectorType(ir.IntType(32), LANES)), _WORDS)


@intrinsic
def quadrant(typing_context: Any, a: Any) -> Any:
    """Whether a whole number is odd, and whether its second binary digit is 1."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        bits, none = _whole(builder, values[0]), _constant(_WORDS, 0)
        found = [builder.icmp_unsigned("!=", builder.and_(bits, _constant(_WORDS, k)), none) for k in (1, 2)]
        return context.make_tuple(builder, signature.return_type, found)

    return types.UniTuple(Truths, 2)(a), generate


@intrinsic
def parts(typing_context: Any, a: Any) -> Any:
    """Mantissa, from 1 to 2, and exponent of a positive number."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], _WORDS)
        small = builder.and_(bits, _constant(_WORDS, 2**52 - 1))
        mantissa = builder.bitcast(builder.or_(small, _constant(_WORDS, 1023 << 52)), _NUMBERS)
        # A whole number below 2^52 stands in the last binary digits of 2^52 and itself.
        power = builder.or_(builder.lshr(bits, _constant(_WORDS, 52)), _constant(_WORDS, 1075 << 52))
        exponent = builder.fsub(builder.bitcast(power, _NUMBERS), _constant(_NUMBERS, 2.0**52 + 1023))
        return context.make_tuple(builder, signature.return_type, (mantissa, exponent))

    return types.UniTuple(Lanes, 2)(a), generate


def _constant(vector: Any, value: float) -> Any:
    return ir.Constant(vector, [value] * LANES)


@intrinsic
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
