"""Where what can be made or fetched again is kept for a user."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.regular import open_regular


def user_cache() -> Path:
    """The folder of mrhubo in the user's cache; nobody has made it yet.

    By the XDG base directory specification: https://specifications.freedesktop.org/basedir-spec/latest/

    Raises:
        UserError: the user has no home, as in a container that gives its processes numbers of nobody.
    """
    given = os.environ.get("XDG_CACHE_HOME")
    if given:
        return Path(given) / "mrhubo"
    try:
        return Path.home() / ".cache" / "mrhubo"
    except RuntimeError as error:
        raise UserError(
            "there is no home folder to keep files in: set HOME, or XDG_CACHE_HOME, to a folder of yours"
        ) from error


def kept_text(name: str, longest: int) -> str | None:
    """What `keep_text` wrote into a file of that name, of so many bytes at the most; None where there is nothing that
    can be read. Whoever asks is to check what it says.
    """
    with contextlib.suppress(OSError, UserError, UnicodeDecodeError), open_regular(user_cache() / name) as file:
        return file.read(longest).decode()
    return None


def keep_text(name: str, text: str) -> None:
    """Writes a file of the user's cache, whole or not at all; where the disk refuses, nothing is kept."""
    with contextlib.suppress(OSError, UserError), atomic_path(user_cache() / name) as half:
        half.write_text(text, encoding="utf-8")
