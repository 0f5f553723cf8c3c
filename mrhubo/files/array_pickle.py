"""Pickles of arrays in dictionaries and lists, whoever wrote them: plain, or by joblib."""

from __future__ import annotations

import io
from typing import Any, BinaryIO

from mrhubo.files.joblib_stream import take_array
from mrhubo.files.unpickler import OTHERS, unpickle

MODULES = (
    OTHERS,
    *("collections", "copyreg", "_codecs", "pathlib", "argparse", "datetime", "decimal", "enum", "uuid"),
    *(f"{module}.{name}" for module in ("builtins", "__builtin__") for name in ("dict", "list", "set", "object")),
    *(f"builtins.{name}" for name in ("bytearray", "slice", "range", "complex")),
    *("types.SimpleNamespace", "time.struct_time"),
)
"""What such a pickle may mention: what arrays, tensors and plain values are made of, and whatever its writer's own
programs keep beside them, which is passed over. Of Python's own modules there is no more that belongs there."""
_FEW_STEPS, _BYTES_A_STEP, _MOST_STEPS = 2_000_000, 4, 20_000_000
"""Steps that any pickle may take, after how many bytes of its one more, and steps that none may exceed: numbers in
lists take one each nine bytes, a video's small arrays, frame by frame, one each seven. So neither time nor memory is
out of proportion to the file; the most take some twenty seconds."""


def load_pickle(handle: BinaryIO) -> Any:
    """What a pickle holds that begins here in a file; see `mrhubo.files.unpickler.unpickle`.

    Raises:
        UserError: it is no pickle, mentions what it has no use for, or wants too much.
    """
    here = handle.tell()
    size = handle.seek(0, io.SEEK_END) - here
    handle.seek(here)
    return unpickle(handle, MODULES, steps_of(size), take_array)


def steps_of(size: int) -> int:
    """How many steps a pickle of so many bytes may take."""
    return min(_FEW_STEPS + size // _BYTES_A_STEP, _MOST_STEPS)
