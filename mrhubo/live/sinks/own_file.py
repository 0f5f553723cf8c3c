"""A file that one sink alone writes: two in one file would make a session of both."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from mrhubo.errors import UserError


def open_own(path: Path) -> BinaryIO:
    """An empty file to write to, in a folder that is made; nobody else has it until it is closed, or the process ends.

    Raises:
        UserError: another sink writes it, in this session or another one; or the folder or the disk refuses it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o666), "wb")
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from error
    try:
        _lock(file)
        file.truncate()
    except BlockingIOError as error:
        file.close()
        raise UserError(f"{path}: another sink writes it, of this session or another one; name another file") from error
    except OSError as error:
        file.close()
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from error
    return file


def _lock(file: BinaryIO) -> None:
    if os.name == "posix":
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
