"""The arrays that joblib writes raw into the stream of a pickle.

Where `pickle` would put an array, `joblib.dump` puts an object that says its shape and type; its numbers follow behind
it in the file, after some padding (https://github.com/joblib/joblib/blob/main/joblib/numpy_pickle.py).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.safe_pickle import number_type, shape_of
from mrhubo.files.unpickler import RecordedObject, Stream

_INLINE = "joblib.numpy_pickle.NumpyArrayWrapper"
_OUTSIDE = "NDArrayWrapper"
"""Ends the names of what joblib before 0.10 put there, which had a file beside for each array."""


def take_array(record: RecordedObject, stream: Stream) -> Any:
    """The array in place of an object that stands for one, read from behind it; any other object as it is, and so are
    arrays of text and the like, whose bytes are passed over.

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
    content = stream.take(size)
    if len(content) < size:
        raise UserError("it ends in the midst of an array: is truncated")
    if name[0] not in "fiub":
        return record
    order = "F" if state["order"] == "F" else "C"
    return np.frombuffer(content, number_type(state["dtype"])).reshape(shape, order=order)
