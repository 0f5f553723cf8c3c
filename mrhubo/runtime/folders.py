"""Folders that a command is going to write to, tried before any work."""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from mrhubo.errors import UserError, shortened

TEMPORARY = "TMPDIR"
_PROBE = bytes(1 << 20)
"""Written to each folder and removed: a disk that has no room for it has none for a run."""
_SHOWN = 200
"""Letters of a folder's path in a sentence."""


def make_folders(folders: Mapping[str, Sequence[Path]]) -> None:
    """Makes the folders of each setting and writes to them; if one refuses, none of them is left behind.

    The folder for temporary files is tried too.

    Raises:
        UserError: a file stands in a folder's way, its name is too long, there is no permission or no room. The
            sentence begins with the setting.
    """
    made: list[Path] = []
    try:
        for setting, places in {**folders, TEMPORARY: [_temporary()]}.items():
            for place in places:
                _make(setting, place, made)
    except UserError:
        for place in reversed(made):
            with contextlib.suppress(OSError):  # another process has begun to use it
                os.rmdir(place)
        raise


def _temporary() -> Path:
    try:
        return Path(tempfile.gettempdir())
    except OSError as error:
        raise UserError(f"{TEMPORARY}: there is no folder for temporary files: {error.strerror}") from error


def _make(setting: str, folder: Path, made: list[Path]) -> None:
    text = str(folder)
    shown = shortened(text, _SHOWN)
    try:
        text.encode()
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            os.lstat(folder)  # a path that is too long is told at once
        reason = _obstacle(folder)
        if reason is None:
            _try(folder, made)
    except UnicodeEncodeError:
        shown, reason = repr(os.fsencode(folder)), "its name is not UTF-8"
    except OSError as error:
        reason = error.strerror or str(error)
    except ValueError as error:  # a null byte
        reason = str(error)
    if reason is not None:
        raise UserError(f"{setting}: {shown} cannot be used: {reason}")


def _obstacle(folder: Path) -> str | None:
    """What stands where a folder should."""
    for place in (folder, *folder.parents):
        if os.path.isdir(place):
            return None
        if os.path.lexists(place):
            what = "a link to nothing" if os.path.islink(place) and not os.path.exists(place) else "a file"
            return f"{'it' if place == folder else place} is {what}, and a folder is wanted"
    return None


def _try(folder: Path, made: list[Path]) -> None:
    missing = [place for place in (folder, *folder.parents) if not os.path.isdir(place)]
    for place in reversed(missing):
        with contextlib.suppress(FileExistsError):  # another process was faster
            os.mkdir(place)
            made.append(place)
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(_PROBE)
    except OSError as error:
        if error.errno != errno.EFBIG:  # a limit of this process's files says nothing about the folder
            raise
