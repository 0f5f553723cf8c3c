"""MATLAB's files of versions 5 to 7, as `save` writes them unless it is told otherwise, by SciPy.

A file is a header of 128 bytes and elements, of 8 bytes that tell what one is and its length, and as many bytes more;
one may be a packed element (MAT-File Format, https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf).
"""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import check_regular, open_regular

_START, _HDF5 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"
_HEADER, _PACKED = 128, 15
_MAX_BYTES = 2**28
"""Of a file, and of what is in it unpacked: its numbers may take an eighth of the bytes that they have in an array."""
_CHUNK = 2**20
_OWN = "__"
"""What names of SciPy's own entries begin with."""
_KINDS = "fiubU"
"""Of arrays: numbers and texts."""


def is_matlab(start: bytes) -> bool:
    """Whether a file begins as MATLAB's do."""
    return start.startswith((_START, _HDF5))


def read_matlab(path: Path) -> dict[str, Any]:
    """The variables of a file: arrays, texts, and of structures and cells dictionaries and lists of these; None for
    whatever else MATLAB has.

    Raises:
        UserError: it is damaged, too large, or of version 7.3, which is an HDF5 file.
    """
    from scipy.io import loadmat  # takes a quarter of a second
    from scipy.io.matlab import MatReadError

    damaged = (
        MatReadError, ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OSError, OverflowError,
        NotImplementedError, MemoryError, RecursionError, zlib.error,
    )  # fmt: skip
    check_regular(path, _MAX_BYTES)
    with open_regular(path) as handle:
        if handle.read(len(_HDF5)) == _HDF5:
            raise UserError("is a MATLAB file of version 7.3; save it as one of version 7: save('NAME.mat', '-v7')")
        try:
            if _unpacked_size(handle) > _MAX_BYTES:
                raise UserError(f"has more than {_MAX_BYTES:,} bytes when it is unpacked; cut it")
            handle.seek(0)
            found = loadmat(handle, simplify_cells=True)
            return {name: _plain(value) for name, value in found.items() if not name.startswith(_OWN)}
        except damaged as error:
            if isinstance(error, UserError):
                raise
            raise UserError(f"is a MATLAB file that is damaged: {shortened(error, 80)}") from error


def _unpacked_size(handle: BinaryIO) -> int:
    """How many bytes are in the elements of a file, unpacked; not much more than may be."""
    handle.seek(_HEADER - 2)
    order = "<u4" if handle.read(2) == b"IM" else ">u4"
    size = 0
    while size <= _MAX_BYTES and len(tag := handle.read(8)) == 8:
        kind, length = (int(word) for word in np.frombuffer(tag, order))
        begin = handle.tell()
        if kind == _PACKED:
            unpacking, left = zlib.decompressobj(), length
            while size <= _MAX_BYTES and left > 0 and (chunk := handle.read(min(_CHUNK, left))):
                left -= len(chunk)
                while chunk and size <= _MAX_BYTES:
                    size += len(unpacking.decompress(chunk, _CHUNK))
                    chunk = unpacking.unconsumed_tail
        size += length
        handle.seek(begin + length)
    return size


def _plain(value: Any) -> Any:
    """Cells as lists."""
    if isinstance(value, dict):
        return {name: _plain(child) for name, child in value.items()}
    if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object and value.ndim):
        return [_plain(child) for child in value]
    kept = isinstance(value, str | int | float) or (isinstance(value, np.ndarray) and value.dtype.kind in _KINDS)
    return value if kept else None
