"""Eight numbers side by side: what compiled functions do to one frame, they do to eight at once.

numba makes good use of a processor's vectors in short loops over arrays alone; kinematics and steps are neither. So a
value of `Lanes` holds one number of each of eight frames, and adds, multiplies and compares as a number does: functions
that know nothing of it work on eight frames, where they are given such values, and arrays of them
(`mrhubo.fast.compiled.lane_arrays`). LLVM cuts eight numbers to what the processor has.

What depends on a number, which may be true in one frame and false in another, is written as `choose(condition, a, b)`;
`some(condition)` tells whether it is true anywhere. Both take a single number's condition too.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir  # pyright: ignore[reportMissingImports]
from numba import types  # pyright: ignore[reportMissingImports]
from numba.core import cgutils  # pyright: ignore[reportMissingImports]
from numba.core.typeconv.castgraph import Conversion  # pyright: ignore[reportMissingImports]
from numba.extending import (  # pyright: ignore[reportMissingImports]
    lower_cast,
    models,
    overload,
    register_model,
)

from mrhubo.fast.compiled.vectors import everywhere, in_llvm

LANES = 8
NUMBERS = ir.VectorType(ir.DoubleType(), LANES)
_TRUTHS = ir.VectorType(ir.IntType(1), LANES)
_FAST = ("reassoc", "contract", "nsz")
"""As `COMPILED` has it for single numbers."""


BARE: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Options of what compiled functions alone call: numba would make each callable from Python and from C too."""


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


Lanes, Truths = _LanesType(), _TruthsType()


@register_model(_LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, NUMBERS)


@register_model(_TruthsType)
class _TruthsModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _TRUTHS)


def _is_number(kind: Any) -> bool:
    return isinstance(kind, types.Float | types.Integer)


def spread(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Lanes of lanes or of a number."""
    if kind == Lanes:
        return value
    return everywhere(builder, context.cast(builder, value, kind, types.float64), NUMBERS)


@lower_cast(types.Float, _LanesType)
@lower_cast(types.Integer, _LanesType)
def _cast(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return spread(context, builder, given, value)


def _elementwise(build: Callable[..., Any], result: Any) -> Any:
    """A function of lanes and numbers, of which LLVM has the operation."""

    @in_llvm
    def apply(typing_context: Any, a: Any, b: Any) -> Any:
        if Lanes not in (a, b) or not all(kind == Lanes or _is_number(kind) for kind in (a, b)):
            return None

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            given = zip(signature.args, values, strict=True)
            return build(builder, *(spread(context, builder, kind, value) for kind, value in given))

        return result(a, b), generate

    return apply


def _overloaded(function: Any, build: Callable[..., Any], result: Any) -> None:
    apply = _elementwise(build, result)

    @overload(function, BARE)
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
    @in_llvm
    def apply(typing_context: Any, a: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            kind = ir.FunctionType(NUMBERS, [NUMBERS])
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64")
            return builder.call(function, values)

        return (Lanes(a), generate) if a == Lanes else None

    return apply


nearest = _of_one("rint")
"""The nearest whole number."""
_root, _size = _of_one("sqrt"), _of_one("fabs")


@overload(math.sqrt, BARE)
def _sqrt(a):
    return (lambda a: _root(a)) if a == Lanes else None


@overload(abs, BARE)
def _abs(a):
    return (lambda a: _size(a)) if a == Lanes else None


@overload(operator.neg, BARE)
def _neg(a):
    return (lambda a: 0.0 - a) if a == Lanes else None


def _of_truths(name: str) -> Any:
    @in_llvm
    def apply(typing_context: Any, a: Any, b: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            both = [
                value if kind == Truths else everywhere(builder, value, _TRUTHS)
                for kind, value in zip(signature.args, values, strict=True)
            ]
            return getattr(builder, name)(*both)

        return Truths(a, b), generate

    return apply


_both, _either = _of_truths("and_"), _of_truths("or_")


@overload(operator.and_, BARE)
def _and(a, b):
    return (lambda a, b: _both(a, b)) if Truths in (a, b) else None


@overload(operator.or_, BARE)
def _or(a, b):
    return (lambda a, b: _either(a, b)) if Truths in (a, b) else None


@in_llvm
def _chosen(typing_context: Any, condition: Any, a: Any, b: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        one, two = (spread(context, builder, signature.args[k], values[k]) for k in (1, 2))
        return builder.select(values[0], one, two)

    return Lanes(condition, a, b), generate


@in_llvm
def _any(typing_context: Any, condition: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(condition), generate


def choose(condition: Any, a: Any, b: Any) -> Any:
    """`a` where the condition is true, else `b`."""
    raise NotImplementedError("compiled alone")


@overload(choose, BARE)
def _choose(condition, a, b):
    if condition == Truths:
        return lambda condition, a, b: _chosen(condition, a, b)
    return lambda condition, a, b: a if condition else b


def some(condition: Any) -> Any:
    """Whether a condition is true in any lane."""
    raise NotImplementedError("compiled alone")


@overload(some, BARE)
def _some(condition):
    return (lambda condition: _any(condition)) if condition == Truths else (lambda condition: condition)


def alike(other: Any, number: float) -> Any:
    """A number, in lanes if the other is."""
    raise NotImplementedError("compiled alone")


@overload(alike, BARE)
def _alike(other, number):
    return (lambda other, number: filled(number)) if other == Lanes else (lambda other, number: float(number))


@in_llvm
def filled(typing_context: Any, number: Any) -> Any:
    """A number in all lanes."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return spread(context, builder, signature.args[0], values[0])

    return Lanes(number), generate


def no(condition: Any) -> Any:
    """Where a condition is false."""
    raise NotImplementedError("compiled alone")


@in_llvm
def _not(typing_context: Any, condition: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.not_(values[0])

    return Truths(condition), generate


@overload(no, BARE)
def _no(condition):
    return (lambda condition: _not(condition)) if condition == Truths else (lambda condition: not condition)
