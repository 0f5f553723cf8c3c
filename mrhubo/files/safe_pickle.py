"""Arrays and numbers in pickles of strangers.

They are put together from the records that `mrhubo.files.unpickler` makes of a pickle, with their sizes checked before
anything of that size is made.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.records import RecordedObject
from mrhubo.files.regular import open_regular
from mrhubo.files.unpickler import unpickle

MAX_BYTES = 2**30
"""Largest pickle or checkpoint that is read, unpacked."""
_MAX_NUMBERS = 2**26
"""Numbers of the largest array."""
_DEEPEST = 4
"""Arrays made of arrays: a selection of a chumpy array is two deep."""
_ARRAYS = ("_reconstruct", "_frombuffer")


def read_pickle(path: Path, modules: tuple[str, ...]) -> Any:
    """What a file of one pickle holds; see `unpickle`.

    Raises:
        UserError: it is no regular file, too large, or `unpickle` refuses it.
    """
    with open_regular(path, MAX_BYTES) as handle:
        return unpickle(handle, modules)


def to_array(value: Any) -> np.ndarray:
    """The array that a pickled ndarray, scipy sparse matrix (as a dense one) or chumpy object stands for.

    Raises:
        UserError: it stands for something else, or its parts do not fit together.
    """
    try:
        return _to_array(value, _DEEPEST)
    except UserError:
        raise
    except Exception as error:  # records that do not fit together
        raise UserError("its parts do not make an array") from error


def to_number(value: Any) -> float:
    """The number that a pickled NumPy scalar stands for.

    Raises:
        UserError: it stands for something else.
    """
    if (
        not isinstance(value, RecordedObject)
        or type(value).__name__ != "scalar"
        or not value.module.startswith("numpy")
    ):
        raise UserError("expected a number, found something else")
    try:
        dtype, content = value.args
        return float(np.frombuffer(bytes_of(content), number_type(dtype))[0])
    except UserError:
        raise
    except Exception as error:  # records that do not fit together
        raise UserError("its parts do not make a number") from error


def _to_array(value: Any, deepest: int) -> np.ndarray:
    if not isinstance(value, RecordedObject):
        raise UserError(f"expected an array, found {type(value).__name__}")
    if deepest == 0:
        raise UserError(f"is made of arrays of arrays, more than {_DEEPEST} deep")
    made, root = type(value).__name__, value.module.partition(".")[0]
    if root == "copy_reg" or root == "copyreg":  # object.__reduce__ of protocol 0 and 1
        root, made = value.args[0].module.partition(".")[0], value.args[0].__name__
    if root == "numpy" and made in _ARRAYS:
        return _dense(value)
    if root == "scipy" and made in ("csc_matrix", "csr_matrix", "csc_array", "csr_array"):
        return _sparse(value.state, made.startswith("csc"), deepest - 1)
    if root == "chumpy":
        return _chumpy(value.state, shortened(made), deepest - 1)
    raise UserError(f"expected an array, found a {shortened(value.kind)}")


def _dense(value: RecordedObject) -> np.ndarray:
    if type(value).__name__ == "_frombuffer":
        content, dtype, shape, order = value.args
    else:
        _, shape, dtype, is_fortran, content = value.state
        order = "F" if is_fortran else "C"
    return np.frombuffer(bytes_of(content), dtype=number_type(dtype)).reshape(shape_of(shape), order=order)


def bytes_of(content: Any) -> bytes:
    """The bytes that something pickled stands for.

    Raises:
        UserError: it stands for something else.
    """
    # In old protocols Python 3 writes bytes as _codecs.encode(text, "latin1"), or as bytes().
    if isinstance(content, RecordedObject):
        content = content.args[0] if content.args else b""
    if isinstance(content, str):
        content = content.encode("latin1")
    if not isinstance(content, bytes | bytearray):  # of a number, bytes() would make so many zeros
        raise UserError(f"expected an array's bytes, found {type(content).__name__}")
    return bytes(content)


def number_type(value: RecordedObject) -> np.dtype:
    """NumPy's type that a pickled one stands for.

    Raises:
        UserError: it is not one of numbers.
    """
    name, order = value.args[0], "<"
    if value.state is not None and value.state[1] == ">":
        order = ">"
    if not isinstance(name, str) or name[:1] not in "fiub" or name[1:] not in ("1", "2", "4", "8"):
        raise UserError("expected an array of numbers, found one of another type")
    return np.dtype(order + name)


def shape_of(value: Any) -> tuple[int, ...]:
    """The lengths of an array's axes, together not more than any array that is read."""
    if not isinstance(value, tuple | list) or not all(isinstance(n, int) and n >= 0 for n in value):
        raise UserError("an array's shape must be whole numbers")
    if math.prod(n for n in value if n) > _MAX_NUMBERS:
        raise UserError(f"an array claims more than {_MAX_NUMBERS:,} numbers")
    return tuple(value)


def _sparse(state: dict[str, Any], by_column: bool, deepest: int) -> np.ndarray:
    rows, columns = shape_of(state["_shape"])
    data, indices, starts = (_to_array(state[key], deepest) for key in ("data", "indices", "indptr"))
    major, minor = (columns, rows) if by_column else (rows, columns)
    counts = np.diff(starts.astype(np.int64))
    fits = starts.shape == (major + 1,) and len(data) == len(indices) == starts[-1] and (counts >= 0).all()
    if not fits or starts[0] != 0 or (len(indices) and not 0 <= indices.min() <= indices.max() < minor):
        raise UserError(f"a sparse matrix of shape ({rows}, {columns}) does not fit its entries")
    dense = np.zeros((major, minor))
    np.add.at(dense, (np.repeat(np.arange(major), counts), indices), data)
    return dense.T if by_column else dense


def _chumpy(state: dict[str, Any], made: str, deepest: int) -> np.ndarray:
    """chumpy keeps a plain array as `x`, and a selection as `a` (the whole), `idxs` and `preferred_shape`."""
    if "x" in state:
        return _to_array(state["x"], deepest)
    if {"a", "idxs", "preferred_shape"} <= set(state):
        indices = _to_array(state["idxs"], deepest)
        if indices.size > _MAX_NUMBERS:
            raise UserError(f"an array claims more than {_MAX_NUMBERS:,} numbers")
        chosen = _to_array(state["a"], deepest).ravel()[indices.astype(np.int64)]
        return chosen.reshape(shape_of(state["preferred_shape"]))
    raise UserError(f"is a chumpy expression ({made}) that is not understood")
