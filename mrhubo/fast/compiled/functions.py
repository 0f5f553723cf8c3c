"""Functions of numbers and of lanes (`mrhubo.fast.compiled.lanes`), within a few of float64's roundings."""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir  # pyright: ignore[reportMissingImports]
from numba import njit, types  # pyright: ignore[reportMissingImports]
from numba.extending import overload  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.lanes import BARE, LANES, NUMBERS, Lanes, Truths, choose, nearest
from mrhubo.fast.compiled.tables import INNER
from mrhubo.fast.compiled.vectors import in_llvm

# Minimax polynomials up to pi/4, of FreeBSD's msun (k_sin.c, k_cos.c).
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
_HALF_PI, _LN2 = math.pi / 2, math.log(2.0)


_WORDS = ir.VectorType(ir.IntType(64), LANES)


@njit(**INNER)
def _rounded(a):
    """The nearest whole number, and two to its power, which is between -1022 and 1023."""
    found = nearest(a)
    return found, _power(found)


@in_llvm
def _power(typing_context: Any, a: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = builder.add(_whole(builder, values[0]), _constant(_WORDS, 1023))
        return builder.bitcast(builder.shl(place, _constant(_WORDS, 52)), NUMBERS)

    return Lanes(a), generate


def _whole(builder: Any, value: Any) -> Any:
    return builder.sext(builder.fptosi(value, ir.VectorType(ir.IntType(32), LANES)), _WORDS)


@in_llvm
def _quadrant(typing_context: Any, a: Any) -> Any:
    """Whether a whole number is odd, and whether its second binary digit is 1."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        bits, none = _whole(builder, values[0]), _constant(_WORDS, 0)
        found = [builder.icmp_unsigned("!=", builder.and_(bits, _constant(_WORDS, k)), none) for k in (1, 2)]
        return context.make_tuple(builder, signature.return_type, found)

    return types.UniTuple(Truths, 2)(a), generate


@in_llvm
def _parts(typing_context: Any, a: Any) -> Any:
    """Mantissa, from 1 to 2, and exponent of a positive number."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], _WORDS)
        small = builder.and_(bits, _constant(_WORDS, 2**52 - 1))
        mantissa = builder.bitcast(builder.or_(small, _constant(_WORDS, 1023 << 52)), NUMBERS)
        # A whole number below 2^52 stands in the last binary digits of 2^52 and itself.
        power = builder.or_(builder.lshr(bits, _constant(_WORDS, 52)), _constant(_WORDS, 1075 << 52))
        exponent = builder.fsub(builder.bitcast(power, NUMBERS), _constant(NUMBERS, 2.0**52 + 1023))
        return context.make_tuple(builder, signature.return_type, (mantissa, exponent))

    return types.UniTuple(Lanes, 2)(a), generate


def _constant(vector: Any, value: float) -> Any:
    return ir.Constant(vector, [value] * LANES)


def sine_cosine(x: Any) -> Any:
    """Sine and cosine of an angle [rad]."""
    raise NotImplementedError("compiled alone")


@overload(sine_cosine, BARE)
def _sine_cosine(x):
    if x != Lanes:
        return lambda x: (math.sin(x), math.cos(x))

    def of_lanes(x):
        turns, _ = _rounded(x * (1 / _HALF_PI))
        odd, back = _quadrant(turns)
        r = x - turns * _HALF_PI
        s = r * r
        sine = r + r * s * (_S1 + s * (_S2 + s * (_S3 + s * (_S4 + s * (_S5 + s * _S6)))))
        cosine = 1 - s * (0.5 - s * (_C1 + s * (_C2 + s * (_C3 + s * (_C4 + s * (_C5 + s * _C6))))))
        one, two = choose(odd, cosine, sine), choose(odd, 0.0 - sine, cosine)
        return choose(back, 0.0 - one, one), choose(back, 0.0 - two, two)

    return of_lanes


@njit(**INNER)
def exponential(x):
    """e to the power of lanes, from -700 to 700."""
    turns = x * (1 / _LN2)
    whole, power = _rounded(turns)
    r = x - whole * _LN2
    high = 1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800))))
    found = 1 + r * (1 + r * (1 / 2 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * high))))))
    return found * power


@njit(**INNER)
def logarithm(x):
    """The natural logarithm of positive lanes."""
    mantissa, exponent = _parts(x)
    large = mantissa > 1.4142135623730951
    mantissa, exponent = choose(large, mantissa * 0.5, mantissa), choose(large, exponent + 1, exponent)
    r = (mantissa - 1) / (mantissa + 1)
    s = r * r
    series = 1 / 3 + s * (1 / 5 + s * (1 / 7 + s * (1 / 9 + s * (1 / 11 + s * (1 / 13 + s * (1 / 15 + s * (1 / 17)))))))
    return exponent * _LN2 + 2 * (r + r * s * series)


@njit(**INNER)
def asinh(x):
    """The inverse hyperbolic sine of lanes."""
    size = abs(x)
    found = logarithm(size + math.sqrt(size * size + 1))
    return choose(x < 0, 0.0 - found, found)


@njit(**INNER)
def tanh(x):
    """The hyperbolic tangent of lanes."""
    small = exponential(max(min(-2 * abs(x), 0.0), -700.0))
    found = (1 - small) / (1 + small)
    return choose(x < 0, 0.0 - found, found)
