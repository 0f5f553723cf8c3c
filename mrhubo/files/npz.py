"""Reading .npz files of strangers: nothing is unpickled, sizes are checked against headers before anything is read."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from mrhubo.errors import UserError

MAX_BYTES = 4 * 2**30
"""Largest array that is read."""
_TYPES = {"U": "text", "fiu": "numbers"}


class NpzFile:
    """An open .npz file whose arrays are read one by one."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self.path, self._archive = path, archive
        self.keys = {name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")}

    def read(self, key: str, kinds: str = "fiu", max_rows: int | None = None) -> np.ndarray:
        """One array, whose header is found to be harmless before its content is read.

        Args:
            key: its name.
            kinds: numpy's letters of the types that will do.
            max_rows: most rows that are read.

        Raises:
            UserError: it is damaged, too large, empty, of another type, or holds pickled objects.
        """
        path = self.path
        try:
            with self._archive.open(f"{key}.npy") as handle:
                shape, dtype = _read_header(handle)
        except Exception as error:  # whatever zipfile, zlib and numpy make of a stranger's bytes
            raise UserError(f"{path}: '{key}' cannot be read: {error or type(error).__name__}") from error
        if dtype.hasobject:
            raise UserError(f"{path}: '{key}' holds pickled Python objects, which are never opened; expected numbers")
        if dtype.kind not in kinds:
            raise UserError(f"{path}: '{key}' has type {dtype}; expected {_TYPES[kinds]}")
        size = math.prod(shape) * dtype.itemsize
        if size == 0 and kinds != "U":
            raise UserError(f"{path}: '{key}' is empty: shape {shape}")
        if (max_rows is not None and shape and shape[0] > max_rows) or size > MAX_BYTES:
            most = f"{max_rows} frames and " if max_rows is not None else ""
            raise UserError(
                f"{path}: '{key}' claims shape {shape}, {size / 2**30:.3g} GiB; "
                f"at most {most}{MAX_BYTES / 2**30:g} GiB are read"
            )
        stored = self._archive.getinfo(f"{key}.npy").file_size
        if size > stored:
            raise UserError(
                f"{path}: '{key}' claims shape {shape}, {size} bytes, but holds {stored}; the file is damaged"
            )
        try:
            with self._archive.open(f"{key}.npy") as handle:
                return npy.read_array(handle, allow_pickle=False)
        except Exception as error:  # as above: truncated or altered content
            raise UserError(f"{path}: '{key}' cannot be read: {error or type(error).__name__}") from error


@contextmanager
def open_npz(path: Path) -> Iterator[NpzFile]:
    """Opens an .npz file.

    Raises:
        UserError: it is missing, not readable, or no .npz file.
    """
    if not path.is_file():
        raise UserError(f"{path}: there is no such file")
    try:
        archive = zipfile.ZipFile(path)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error
    except Exception as error:  # whatever zipfile makes of a stranger's bytes
        raise UserError(f"{path}: is not an .npz file (a zip archive of arrays): {error}") from error
    with archive:
        yield NpzFile(path, archive)


def _read_header(handle: IO[bytes]) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type that an .npy member claims to have."""
    version = npy.read_magic(handle)
    if version == (1, 0):
        shape, _, dtype = npy.read_array_header_1_0(handle)
    elif version == (2, 0):
        shape, _, dtype = npy.read_array_header_2_0(handle)
    else:
        raise ValueError(f"version {version} of the .npy format is for records")
    return shape, dtype
