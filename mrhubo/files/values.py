"""What single values of strangers' dictionaries and lists stand for: names, numbers and arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.checkpoint import numbers_of
from mrhubo.files.records import RecordedObject
from mrhubo.files.safe_pickle import to_array, to_number

_DEEPEST = 4
"""Objects in arrays of objects."""


def unwrapped(value: Any) -> Any:
    """An array of objects as the list of them, and one that holds a single object without axes as that object."""
    for _ in range(_DEEPEST):
        is_array = isinstance(value, RecordedObject) and type(value).__name__ == "_reconstruct"
        state = value.state if is_array else None
        if not (isinstance(state, tuple) and len(state) == 5 and isinstance(state[4], list)):
            return value
        value = state[4][0] if state[1] == () and len(state[4]) == 1 else state[4]
    return value


def name_of(key: Any) -> str | None:
    """A dictionary's key as a text; None where it is neither text nor a number."""
    if isinstance(key, bytes):
        key = key.decode("latin1")
    if isinstance(key, RecordedObject):
        try:
            key = to_number(key)
        except UserError:
            return None
    if isinstance(key, float) and math.isfinite(key) and key == int(key):
        key = int(key)
    return str(key) if isinstance(key, str | int | float) else None


def to_float(number: float, named: str) -> float:
    """A number as a float.

    Args:
        number: may be a whole number of any length.
        named: what it is part of, for the beginning of a sentence.

    Raises:
        UserError: no float is as large.
    """
    try:
        return float(number)
    except OverflowError as error:
        raise UserError(f"{named} holds a whole number of more than 300 digits; expected numbers") from error


def from_record(value: RecordedObject, storages: dict[str, bytes], named: str) -> np.ndarray:
    """The array that a pickled tensor, NumPy scalar or array stands for.

    Args:
        value: it.
        storages: what a PyTorch file keeps beside its pickle.
        named: the file and the place in it, for sentences.

    Raises:
        UserError: it stands for something else, or its parts do not fit together.
    """
    try:
        if value.module.startswith("torch"):
            return numbers_of(value, storages)
        if type(value).__name__ == "scalar":
            return np.array(to_number(value))
        return to_array(value)
    except UserError as error:
        raise UserError(f"{named}: {error}") from error
