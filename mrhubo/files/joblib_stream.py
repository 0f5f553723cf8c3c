"""The arrays that joblib writes raw into the stream of a pickle.

Where `pickle` would put an array, `joblib.dump` puts an object that says its shape and type; its numbers follow behind
it in the file, after some padding (https://github.com/joblib/joblib/blob/main/joblib/numpy_pickle.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.records import RecordedObject, Stream
from mrhubo.files.regular import open_regular
from mrhubo.files.safe_pickle import number_type, shape_of

_INLINE = "joblib.numpy_pickle.NumpyArrayWrapper"
_LARGE = 2**20
"""Bytes of an array that is not read before it is asked for."""
_OUTSIDE = "NDArrayWrapper"
"""Ends the names of what joblib before 0.10 put there, which had a file beside for each array."""


@dataclass(frozen=True)
class Later:
    """An array that lies in a file and has not been read: most of a file are meshes, which nobody here wants."""

    start: int
    """Where its numbers begin."""
    dtype: np.dtype
    shape: tuple[int, ...]
    order: Literal["C", "F"]

    def read(self, path: Path) -> np.ndarray:
        """Its numbers.

        Raises:
            UserError: the file has changed.
        """
        size = math.prod(self.shape) * self.dtype.itemsize
        with open_regular(path) as handle:
            handle.seek(self.start)
            content = handle.read(size)
        if len(content) < size:
            raise UserError(f"{path}: was changed while it was read")
        return np.frombuffer(content, self.dtype).reshape(self.shape, order=self.order)


def take_array(record: RecordedObject, stream: Stream) -> Any:
    """The array in place of an object that stands for one, read from behind it, or to be read later if it is large; any
    other object as it is, and so are arrays of text and the like, whose bytes are passed over.

    Raises:
        UserError: the array is not in the file, or not to its end.
    """
    if record.kind.startswith("joblib.") and type(record).__name__.endswith(_OUTSIDE):
        raise UserError("its arrays are in files beside it, as joblib before 0.10 wrote them; load it and dump it anew")
    if record.kind != _INLINE:
        return record
    state = record.state
    shape, name = shape_of(state["shape"]), state["dtype"].args[0]
    if name[:1] == "O":
        return stream.nested()
    if state.get("numpy_array_alignment_bytes") is not None:
        stream.take(int.from_bytes(stream.take(1), "little"))
    size = math.prod(shape) * int(name[1:]) * (4 if name[0] == "U" else 1)
    order: Literal["C", "F"] = "F" if state["order"] == "F" else "C"
    if size > _LARGE and name[0] in "fiub" and (start := stream.passed(size)) is not None:
        return Later(start, number_type(state["dtype"]), shape, order)
    content = stream.take(size)
    if len(content) < size:
        raise UserError("it ends in the midst of an array: is truncated")
    if name[0] not in "fiub":
        return record
    return np.frombuffer(content, number_type(state["dtype"])).reshape(shape, order=order)
