"""Values of an ONNX graph that are worked with as arrays are: each operation adds its node."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrhubo.exporting.graph import Graph


class Value:
    """A value of a graph; numbers and arrays beside it become constants of its kind."""

    def __init__(self, graph: Graph, name: str, kind: type = np.float64) -> None:
        self.graph, self.name, self.kind = graph, name, kind

    def node(self, op: str, *others: Any, kind: type | None = None, **attributes: Any) -> Value:
        """What an operation makes of this and others."""
        names = [other.name if isinstance(other, Value) else self.graph.constant(other, self.kind) for other in others]
        return Value(self.graph, self.graph.node(op, self.name, *names, **attributes), kind or self.kind)

    def __add__(self, other: Any) -> Value:
        return self.node("Add", other)

    def __sub__(self, other: Any) -> Value:
        return self.node("Sub", other)

    def __mul__(self, other: Any) -> Value:
        return self.node("Mul", other)

    def __truediv__(self, other: Any) -> Value:
        return self.node("Div", other)

    def __matmul__(self, other: Any) -> Value:
        return self.node("MatMul", other)

    def sum(self, axis: int = -1) -> Value:
        """Over an axis, which stays, of length 1."""
        return self._whole("ReduceSum", [axis], keepdims=1)

    def mean(self) -> Value:
        """Over the last axis, which stays."""
        return self._whole("ReduceMean", [-1], keepdims=1)

    def take(self, places: Any, axis: int) -> Value:
        """Places along an axis; a single number takes the axis away."""
        return self._whole("Gather", places, axis=axis)

    def reshape(self, *shape: int) -> Value:
        """Another shape, with -1 for one length and 0 for one that stays."""
        return self._whole("Reshape", list(shape))

    def unsqueeze(self, axis: int) -> Value:
        """A new axis."""
        return self._whole("Unsqueeze", [axis])

    def squeeze(self, axis: int) -> Value:
        """Without an axis of length 1."""
        return self._whole("Squeeze", [axis])

    def turned(self, *order: int) -> Value:
        """Axes in another order."""
        return self.node("Transpose", perm=list(order))

    def clip(self, lower: Any, upper: Any) -> Value:
        """Inside bounds."""
        return self.node("Max", lower).node("Min", upper)

    def cast(self, kind: type) -> Value:
        """As other numbers."""
        return self.node("Cast", kind=kind, to=self.graph.type_of(kind))

    def less(self, other: Any) -> Value:
        """Where it is less than another, booleans."""
        return self.node("Less", other, kind=np.bool_)

    def least(self, count: int) -> tuple[Value, Value]:
        """So many of the least along axis 1, in order, and their places."""
        found, order = self.graph.least(self.name, count)
        return Value(self.graph, found, self.kind), Value(self.graph, order, np.int64)

    def where(self, yes: Value, no: Any) -> Value:
        """One where this holds, else the other."""
        name = no.name if isinstance(no, Value) else self.graph.constant(no, yes.kind)
        return Value(self.graph, self.graph.node("Where", self.name, yes.name, name), yes.kind)

    def _whole(self, op: str, numbers: Any, **attributes: Any) -> Value:
        return Value(self.graph, self.graph.node(op, self.name, self.graph.numbers(numbers), **attributes), self.kind)


def join(values: list[Value], axis: int) -> Value:
    """One after the other along an axis."""
    graph = values[0].graph
    return Value(graph, graph.node("Concat", *(value.name for value in values), axis=axis), values[0].kind)


def silu(x: Value) -> Value:
    """The activation of this name (D. Hendrycks, K. Gimpel, 2016)."""
    return x * x.node("Sigmoid")


def asinh(x: Value) -> Value:
    """Of float32, in which the network sees it."""
    return x.cast(np.float32).node("Asinh").cast(np.float64)


def solve(matrix: Value, right: Value, free: Value, most: int) -> Value:
    """x (..., M) with A x = b among the components that are free, others 0, for A symmetric and positive definite:
    Gauss and Jordan's elimination, for which no pivots need be sought.
    """
    system = matrix * free.unsqueeze(4) * free.unsqueeze(3) + (free * -1.0 + 1.0).unsqueeze(4) * np.eye(most)
    system = join([system, (right * free).unsqueeze(4)], 4)
    for place, unit_M in enumerate(np.eye(most)):
        row = system.take([place], 3)
        column = system.take([place], 4) - unit_M[:, None]
        system = system - column * (row / row.take([place], 4))
    return system.take(most, 4)
