"""Regular files alone are read: a pipe would hang who opens it, a device never ends, a folder is no file."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from mrhubo.errors import UserError

MAX_BYTES = 4 * 2**30
"""Largest file that is read."""
_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


class MissingFile(UserError):
    """There is no file of that name."""


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Puts a file's name before what a UserError says of it, unless it begins so."""
    try:
        yield
    except UserError as error:
        said = str(error)
        raise UserError(said if said.startswith(f"{path}: ") else f"{path}: {said}") from error


def refuse_input(what: str, path: Path, inputs: Iterable[Path | str | None]) -> None:
    """Refuses to write over a file that is read, by whatever name.

    Args:
        what: whose file is written, ``--out``, for the sentence.
        path: the file that is going to be written.
        inputs: what is read, files, folders of files, or neither; None: nothing is.

    Raises:
        UserError: it is one of them, or in one of them.
    """
    for given in inputs:
        with contextlib.suppress(OSError, ValueError):  # one of the two is not there, or no name of a file
            place = path.parent if given is not None and os.path.isdir(given) and path.is_file() else path
            if given is not None and os.path.samefile(place, given):
                raise UserError(f"{what} {path}: would be written over what is read, {given}; name another file")


def check_regular(path: Path, max_bytes: int = MAX_BYTES) -> int:
    """The size of a file, in bytes, if it is a regular one.

    Raises:
        MissingFile: there is none.
        UserError: it is a folder, a pipe or a device, may not be looked at, or is larger than `max_bytes`.
    """
    try:
        found = os.stat(path)
    except FileNotFoundError as error:
        raise MissingFile(f"{path}: there is no such file") from error
    except (OSError, ValueError) as error:  # a name with a null byte is a ValueError
        raise UserError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if stat.S_ISDIR(found.st_mode):
        raise UserError(f"{path}: is a folder; name a file")
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "no file")
        raise UserError(f"{path}: is {kind}; only regular files are read")
    if found.st_size > max_bytes:
        raise UserError(f"{path}: has {_size(found.st_size)}; at most {_size(max_bytes)} are read")
    return found.st_size


def open_regular(path: Path, max_bytes: int = MAX_BYTES) -> BinaryIO:
    """A regular file opened for reading; the caller closes it.

    Raises:
        UserError: as for `check_regular`, or it may not be read.
    """
    check_regular(path, max_bytes)
    try:
        return open(path, "rb")
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error


def read_regular(path: Path, max_bytes: int = MAX_BYTES) -> bytes:
    """The bytes of a regular file.

    Raises:
        UserError: as for `open_regular`.
    """
    with open_regular(path, max_bytes) as file:
        try:
            # Not max_bytes: room for as many would be made at once.
            return file.read(min(os.fstat(file.fileno()).st_size, max_bytes))
        except OSError as error:
            raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error


def _size(count: int) -> str:
    for unit, size in (("GiB", 2**30), ("MB", 10**6), ("kB", 10**3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count} bytes"
