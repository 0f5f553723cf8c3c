"""MATLAB's files of versions 5 to 7, as `save` writes them unless it is told otherwise, by SciPy."""

from __future__ import annotations

import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import check_regular, open_regular

_START, _HDF5 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"
_MAX_BYTES, _MAX_NUMBERS = 2**28, 10**8
_OWN = "__"
"""What names of SciPy's own entries begin with."""


def is_matlab(start: bytes) -> bool:
    """Whether a file begins as MATLAB's do."""
    return start.startswith((_START, _HDF5))


def read_matlab(path: Path) -> dict[str, Any]:
    """The variables of a file: arrays, texts, and of structures and cells dictionaries and lists of these.

    Raises:
        UserError: it is damaged, too large, or of version 7.3, which is an HDF5 file.
    """
    from scipy.io import loadmat, whosmat  # takes a quarter of a second
    from scipy.io.matlab import MatReadError

    damaged = (
        MatReadError, ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OSError, OverflowError,
        NotImplementedError, MemoryError, zlib.error,
    )  # fmt: skip
    check_regular(path, _MAX_BYTES)
    with open_regular(path) as handle:
        if handle.read(len(_HDF5)) == _HDF5:
            raise UserError("is a MATLAB file of version 7.3; save it as one of version 7: save('NAME.mat', '-v7')")
        handle.seek(0)
        try:
            shapes = {name: shape for name, shape, _ in whosmat(handle)}
            for name, shape in shapes.items():
                if math.prod(shape) > _MAX_NUMBERS:
                    raise UserError(f"'{shortened(name, 40)}' has more than {_MAX_NUMBERS:,} numbers; cut it")
            handle.seek(0)
            found = loadmat(handle, simplify_cells=True)
        except damaged as error:
            if isinstance(error, UserError):
                raise
            raise UserError(f"is a MATLAB file that is damaged: {shortened(error, 80)}") from error
    return {name: _plain(value) for name, value in found.items() if not name.startswith(_OWN)}


def _plain(value: Any) -> Any:
    """Cells as lists."""
    if isinstance(value, dict):
        return {name: _plain(child) for name, child in value.items()}
    if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        return [_plain(child) for child in value]
    return value
