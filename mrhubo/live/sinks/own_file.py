"""A file that one sink alone writes: two in one file would make a session of both."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from mrhubo.errors import UserError


def open_own(path: Path) -> BinaryIO:
    """An empty file to write to, in a folder that is made; nobody else has it until it is closed, or the process ends.

    Raises:
        UserError: another sink writes it, in this session or another one; it is a folder, a pipe or a device; or the
            folder or the disk refuses it.
    """
    file = _open_locked(path)
    try:
        file.truncate()
    except OSError as error:
        file.close()
        raise _refused(path, error) from error
    return file


@contextlib.contextmanager
def tried(path: Path) -> Iterator[None]:
    """As long as it lasts, nobody else has a file that `open_own` would open; then all is as it was.

    Raises:
        UserError: as for `open_own`.
    """
    missing = [place for place in (path, *path.parents) if not os.path.lexists(place)]
    try:
        with _open_locked(path):
            yield
    finally:
        for place in missing:
            with contextlib.suppress(OSError):  # somebody has begun to use the folder, or it was not made
                place.unlink() if place == path else place.rmdir()


def _open_locked(path: Path) -> BinaryIO:
    try:
        if path.exists() and not path.is_file():  # whoever opens a pipe waits for its reader
            raise UserError(f"{path}: is a folder, a pipe or a device; name a file")
        path.parent.mkdir(parents=True, exist_ok=True)
        file = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o666), "wb")
    except (OSError, ValueError) as error:  # a name with a null byte is a ValueError
        raise _refused(path, error) from error
    try:
        _lock(file)
    except BlockingIOError as error:
        file.close()
        raise UserError(f"{path}: another sink writes it, of this session or another one; name another file") from error
    except OSError as error:
        file.close()
        raise _refused(path, error) from error
    return file


def _refused(path: Path, error: Exception) -> UserError:
    why = error.strerror if isinstance(error, OSError) else None
    return UserError(f"{path}: cannot be written: {why or error}")


def _lock(file: BinaryIO) -> None:
    if os.name == "posix":
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
