"""A graph of ONNX nodes while it is being written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

SHORT = 1e-12
"""Vectors below this length have no direction."""


class Graph:
    """Nodes and constants, which get names of their own; a value is known by its name."""

    def __init__(self, onnx: Any, real: type = np.float32) -> None:
        self._onnx, self._real, self.nodes, self.constants = onnx, real, [], []
        self._known: dict[bytes, str] = {}

    def node(self, kind: str, *inputs: str, output: str | None = None, **attributes: Any) -> str:
        """The output of a new node."""
        output = output or f"{kind.lower()}_{len(self.nodes)}"
        self.nodes.append(self._onnx.helper.make_node(kind, list(inputs), [output], **attributes))
        return output

    def constant(self, values: Any, kind: type | None = None) -> str:
        """A constant, of the graph's kind of numbers unless another is told; the same one for the same numbers."""
        array = np.array(values, kind or self._real, order="C")
        key = repr((array.shape, array.dtype.str)).encode() + array.tobytes()
        if key not in self._known:
            self._known[key] = f"constant_{len(self.constants)}"
            self.constants.append(self._onnx.numpy_helper.from_array(array, self._known[key]))
        return self._known[key]

    def type_of(self, kind: type) -> int:
        """ONNX's number for a kind of numbers."""
        return self._onnx.helper.np_dtype_to_tensor_dtype(np.dtype(kind))

    def least(self, value: str, count: int) -> tuple[str, str]:
        """So many of the least along axis 1, in order, and their places; of equal ones the first."""
        found, order = (f"{what}_{len(self.nodes)}" for what in ("least", "order"))
        inputs = [value, self.numbers([count])]
        self.nodes.append(self._onnx.helper.make_node("TopK", inputs, [found, order], axis=1, largest=0))
        return found, order

    def numbers(self, values: Sequence[int] | np.ndarray) -> str:
        """A constant of whole numbers."""
        return self.constant(values, np.int64)

    def gather(self, value: str, places: Sequence[int] | np.ndarray, axis: int) -> str:
        """Some places along an axis."""
        return self.node("Gather", value, self.numbers(places), axis=axis)

    def at(self, value: str, place: int, axis: int) -> str:
        """One place along an axis, which is gone then."""
        return self.node("Gather", value, self.constant(place, np.int64), axis=axis)

    def dot(self, a: str, b: str) -> str:
        """Sums of products over the last axis, which stays, of length 1."""
        return self.node("ReduceSum", self.node("Mul", a, b), self.numbers([-1]), keepdims=1)

    def cross(self, a: str, b: str) -> str:
        """Cross products along the last axis."""
        a1, b2 = self.gather(a, [1, 2, 0], -1), self.gather(b, [2, 0, 1], -1)
        a2, b1 = self.gather(a, [2, 0, 1], -1), self.gather(b, [1, 2, 0], -1)
        return self.node("Sub", self.node("Mul", a1, b2), self.node("Mul", a2, b1))

    def atan(self, a: str) -> str:
        """The arc tangent, in float32, as ONNX Runtime has none of float64."""
        if self._real == np.float32:
            return self.node("Atan", a)
        single, real = (self.type_of(kind) for kind in (np.float32, self._real))
        return self.node("Cast", self.node("Atan", self.node("Cast", a, to=single)), to=real)

    def flat(self, value: str, count: int) -> str:
        """One axis after the batch's."""
        return self.node("Reshape", value, self.numbers([-1, count]))

    def stack(self, values: Sequence[str], axis: int) -> str:
        """Along a new axis."""
        longer = [self.node("Unsqueeze", value, self.numbers([axis])) for value in values]
        return self.node("Concat", *longer, axis=axis)

    def unit(self, a: str) -> str:
        """Unit vectors; 0 stays 0."""
        length = self.node("Sqrt", self.dot(a, a))
        return self.node("Div", a, self.node("Max", length, self.constant(SHORT)))
