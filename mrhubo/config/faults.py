"""Faults of the machine, not of the program: a full disk, a folder without permission, no memory left."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

_SYSTEM = frozenset(
    getattr(errno, name)
    for name in (
        "ENOSPC", "EDQUOT", "EROFS", "EACCES", "EPERM", "ENOTDIR", "EISDIR", "ENAMETOOLONG", "ELOOP", "EIO", "ESTALE",
        "EMFILE", "ENFILE", "ENOMEM", "EFBIG", "ENODEV", "ENXIO",
    )
)  # fmt: skip
"""Error numbers that say something about the machine or the user's folders. A missing file (ENOENT) is not among them:
those that a user names are looked for before they are read."""
_FULL = ("No space left on device", "database or disk is full", "Disk quota exceeded", "PytorchStreamWriter failed")
_WORDS = (*_FULL, "disk I/O error", "attempt to write a readonly database", "unable to open database file")
"""What libraries say that make errors of their own of such faults."""
_LITTLE = 1 << 20
"""Bytes: a disk with fewer of them is full."""


def machine_fault(error: BaseException) -> str | None:
    """One sentence, if a fault of the machine is at the root of an error: which file, what, and what to do."""
    for one in _chain(error):
        if isinstance(one, OSError) and one.errno in _SYSTEM:
            place = f"{os.fsdecode(one.filename)}: " if isinstance(one.filename, str | bytes) and one.filename else ""
            full = one.errno in (errno.ENOSPC, errno.EDQUOT)
            return _sentence(place, os.strerror(one.errno or 0), full)
        words = next((words for words in _WORDS if words in str(one)), None)
        if words is not None:
            return _sentence("", words, words in _FULL)
    return None


def _sentence(place: str, reason: str, full: bool) -> str:
    if not full:
        return f"{place}{reason}; put that right and start the same command again, it goes on"
    where = place or f"{', '.join(_full_folders())}: ".removeprefix(": ")
    return f"{where}{reason}; make room and start the same command again, it goes on"


def _full_folders() -> Iterator[str]:
    """Of the folders that every command writes to, those whose disk is full."""
    folders = {"the current folder": Path.cwd, "the folder for temporary files": lambda: Path(tempfile.gettempdir())}
    for name, find in folders.items():
        try:
            folder = find()
            if shutil.disk_usage(folder).free < _LITTLE:
                yield f"{name} ({folder})"
        except OSError:
            continue


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """An error, then what it came from."""
    seen: list[BaseException] = []
    while error is not None and error not in seen:
        yield error
        seen.append(error)
        error = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
