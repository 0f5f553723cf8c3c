"""Faults of the machine, not of the program: a full disk, a folder without permission, no memory left."""

from __future__ import annotations

import codecs
import errno
import os
import shutil
import sys
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
    """If a fault of the machine is at the root of an error, which file and what, else None."""
    for one in _chain(error):
        if isinstance(one, OSError) and one.errno in _SYSTEM:
            name = one.filename2 or one.filename  # of two the second is written
            place = os.fsdecode(name) if isinstance(name, str | bytes) else ""
            reason = os.strerror(one.errno or 0)
        elif isinstance(one, UnicodeEncodeError) and _is_of_names(one.encoding):
            place, letter = "", one.object[one.start]
            reason = (
                f"this system's names of files, in {sys.getfilesystemencoding()}, have no letter '{letter}'; set"
                " LC_ALL=C.UTF-8, or PYTHONUTF8=1"
            )
        else:
            place, reason = "", next((words for words in _WORDS if words in str(one)), None)
        if reason is not None:
            place = place or (", ".join(_full_folders()) if reason in _FULL else "")
            return f"{place}: {reason}" if place else reason
    return None


def _is_of_names(encoding: str) -> bool:
    """Whether names of files are encoded so, and not as UTF-8, which has all letters."""
    ours = codecs.lookup(sys.getfilesystemencoding()).name
    return ours != "utf-8" and codecs.lookup(encoding).name == ours


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
