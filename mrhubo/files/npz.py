"""Reading .npz files of strangers: nothing is unpickled, sizes are checked against headers before anything is read."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, BinaryIO
from zipfile import ZipFile

import numpy as np
from numpy.lib import format as npy

from mrhubo.errors import UserError, shortened
from mrhubo.files.archive import check_member, open_archive

MAX_BYTES = 4 * 2**30
"""Largest array that is read."""
_TYPES = {"U": "text", "fiu": "numbers", "fiub": "numbers"}
_MAX_AXES = 32


@dataclass(frozen=True)
class _Header:
    """What an .npy member claims to hold."""

    shape: tuple[int, ...]
    dtype: np.dtype
    by_column: bool


class NpzFile:
    """An open .npz file whose arrays are read one by one."""

    def __init__(self, path: Path, archive: ZipFile) -> None:
        self.path, self._archive = path, archive
        self.keys = {name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")}

    def shape(self, key: str, kinds: str = "fiu", max_rows: int | None = None) -> tuple[int, ...]:
        """The shape that an array claims, whose header is found to be harmless; arguments as for `read`."""
        return self._header(key, kinds, max_rows).shape

    def read(self, key: str, kinds: str = "fiu", max_rows: int | None = None, max_bytes: int = MAX_BYTES) -> np.ndarray:
        """One array, whose header is found to be harmless before its content is read.

        Args:
            key: its name.
            kinds: numpy's letters of the types that will do.
            max_rows: most rows that are read.
            max_bytes: most bytes that are read.

        Raises:
            UserError: it is damaged, too large, empty, of another type, or holds pickled objects.
        """
        self._header(key, kinds, max_rows, max_bytes)
        with self._reading(key, "its content is truncated or altered") as handle:
            with warnings.catch_warnings(action="ignore"):
                return npy.read_array(handle, allow_pickle=False)

    def blocks(self, key: str, rows: int, max_rows: int | None = None) -> Iterator[np.ndarray]:
        """The rows of an array of numbers, so many at a time, so that they need not fit into memory: what follows the
        first axis as one (rows, columns).

        Raises:
            UserError: as for `read`, or it has no two axes.
        """
        header = self._header(key, "fiu", max_rows)
        if len(header.shape) < 2:
            raise UserError(f"{self._named(key)} has shape {header.shape}; expected (rows, columns)")
        count, columns = header.shape[0], math.prod(header.shape[1:])
        if header.by_column:
            whole = self.read(key, max_rows=max_rows).reshape(count, columns)
            yield from (whole[start : start + rows] for start in range(0, count, rows))
            return
        with self._reading(key, "its content is truncated or altered") as handle:
            _read_header(handle)
            for start in range(0, count, rows):
                size = min(rows, count - start) * columns * header.dtype.itemsize
                content = bytearray(size)
                if _fill(handle, content) < size:
                    raise EOFError
                yield np.frombuffer(content, header.dtype).reshape(-1, columns)

    def read_any(self, key: str, load: Callable[[BinaryIO], Any], max_bytes: int = MAX_BYTES) -> Any:
        """One array of numbers or text; or, of one that holds pickled objects, what `load` makes of the pickle.

        Raises:
            UserError: it is damaged, too large, or of another type.
        """
        stored = self._archive.getinfo(f"{key}.npy").file_size
        if stored > max_bytes:
            raise UserError(
                f"{self._named(key)} has {stored / 2**30:.3g} GiB; at most {max_bytes / 2**30:.3g} are read"
            )
        with self._reading(key, "it is truncated, altered, or no .npy array") as handle:
            try:
                return read_member(handle, stored, load)
            except UserError as error:
                raise UserError(f"{self._named(key)} {error}") from error

    def _named(self, key: str) -> str:
        return f"{self.path}: '{shortened(key)}'"

    def _header(self, key: str, kinds: str, max_rows: int | None, max_bytes: int = MAX_BYTES) -> _Header:
        with self._reading(key, "its header is not one of an .npy array") as handle:
            header = _read_header(handle)
        shape, dtype = header.shape, header.dtype
        if dtype.hasobject:
            raise UserError(
                f"{self._named(key)} holds pickled Python objects, which are never opened; expected numbers"
            )
        if dtype.kind not in kinds:
            raise UserError(f"{self._named(key)} has type {shortened(dtype)}; expected {_TYPES[kinds]}")
        size = math.prod(shape) * dtype.itemsize
        if size == 0 and kinds != "U":
            raise UserError(f"{self._named(key)} is empty: shape {shortened(shape)}")
        if (max_rows is not None and shape and shape[0] > max_rows) or size > max_bytes:
            most = f"{max_rows} frames and " if max_rows is not None else ""
            claimed = f"{size / 2**30:.3g} GiB" if size < 2**100 else "more than any disk holds"
            raise UserError(
                f"{self._named(key)} claims shape {shortened(shape)}, {claimed};"
                f" at most {most}{max_bytes / 2**30:.3g} GiB are read"
            )
        stored = self._archive.getinfo(f"{key}.npy").file_size
        if size > stored:
            raise UserError(
                f"{self._named(key)} claims shape {shape}, {size} bytes, but holds {stored}; the file is damaged"
            )
        return header

    @contextmanager
    def _reading(self, key: str, otherwise: str) -> Iterator[IO[bytes]]:
        """A member opened; whatever zipfile, zlib and numpy make of a stranger's bytes becomes our sentence, as theirs
        advise to allow pickles.
        """
        try:
            with self._archive.open(check_member(self._archive, f"{key}.npy")) as file:
                yield file
        except UserError:
            raise
        except Exception as error:
            raise UserError(f"{self._named(key)} cannot be read: {otherwise}") from error


@contextmanager
def open_npz(path: Path) -> Iterator[NpzFile]:
    """Opens an .npz file.

    Raises:
        UserError: it is missing, not readable, or no .npz file.
    """
    with open_archive(path, "is not an .npz file (a zip archive of arrays)", 4 * MAX_BYTES) as archive:
        yield NpzFile(path, archive)


def read_member(handle: IO[bytes], stored: int, load: Callable[[BinaryIO], Any]) -> Any:
    """The array of an .npy file or member, of numbers, or of text, in letters or bytes; or, of one that holds pickled
    objects, what `load` makes of the pickle.

    Args:
        handle: opened at its beginning.
        stored: how many bytes it has, which may be read.
        load: reads the pickle.

    Raises:
        UserError: it is damaged or of another type.
    """
    try:
        header = _read_header(handle)
    except Exception as error:  # whatever numpy makes of a stranger's bytes
        raise UserError("has a header that is not one of an .npy array") from error
    if header.dtype.hasobject:
        return load(io.BytesIO(handle.read(stored)))
    if header.dtype.kind not in "fiubUS":
        raise UserError(f"has type {shortened(header.dtype)}; expected {_TYPES['fiu']}")
    size = math.prod(header.shape) * header.dtype.itemsize
    if size > stored:
        raise UserError(f"claims shape {shortened(header.shape)}, but holds {stored} bytes; the file is damaged")
    content = handle.read(size)
    if len(content) < size:
        raise UserError("is truncated")
    flat = np.frombuffer(content, header.dtype) if size else np.zeros(0, header.dtype)
    if header.dtype.kind == "S":
        flat = np.char.decode(flat, "utf-8", "replace")
    return flat.reshape(header.shape, order="F" if header.by_column else "C")


def _read_header(handle: IO[bytes]) -> _Header:
    """What an .npy member claims; ValueError where it is none, or one for records. NumPy's warning, that Python 2 wrote
    the file, is no news to our users.
    """
    version = npy.read_magic(handle)
    if version not in ((1, 0), (2, 0)):
        raise ValueError("another version of the format")
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    with warnings.catch_warnings(action="ignore"):
        shape, by_column, dtype = read(handle)
    if len(shape) > _MAX_AXES or min(shape, default=0) < 0:
        raise ValueError("no shape of an array")
    return _Header(tuple(map(int, shape)), dtype, bool(by_column))


def _fill(handle: IO[bytes], content: bytearray) -> int:
    """Reads until a buffer is full or the file ends; how many bytes came."""
    view, done = memoryview(content), 0
    while done < len(content):
        piece = handle.read(min(len(content) - done, 2**20))
        if not piece:
            break
        view[done : done + len(piece)] = piece
        done += len(piece)
    return done
