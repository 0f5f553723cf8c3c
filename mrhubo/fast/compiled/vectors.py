"""What functions of LLVM's own operations on vectors share (`tile`, `band`, `lanes`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir  # pyright: ignore[reportMissingImports]
from numba import types  # pyright: ignore[reportMissingImports]
from numba.extending import intrinsic  # pyright: ignore[reportMissingImports]

_ROUNDED_ONCE = ("contract",)
"""A product and its sum, where the processor can."""


def in_llvm(define: Callable[..., Any]) -> Any:
    """`numba.extending.intrinsic`: a function of LLVM's own operations, without its definition's typing context."""
    return intrinsic(define)


def is_array(given: Any, kind: Any) -> bool:
    """Whether a type is that of arrays of such numbers, one after the other in memory."""
    return isinstance(given, types.Array) and given.dtype == kind and given.layout == "C"


def everywhere(builder: Any, value: Any, vector: Any) -> Any:
    """One number in all places of a vector."""
    unset = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(unset, value, ir.Constant(ir.IntType(32), 0))
    same = ir.Constant(ir.VectorType(ir.IntType(32), vector.count), [0] * vector.count)
    return builder.shuffle_vector(first, unset, same)


def add_product(builder: Any, found: Any, one: Any, other: Any) -> None:
    """Adds the product of two vectors to the sums that stand at an address."""
    product = builder.fmul(one, other, flags=_ROUNDED_ONCE)
    builder.store(builder.fadd(builder.load(found), product, flags=_ROUNDED_ONCE), found)
