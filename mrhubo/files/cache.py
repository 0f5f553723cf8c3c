"""Where what can be made or fetched again is kept for a user."""

from __future__ import annotations

import os
from pathlib import Path

from mrhubo.errors import UserError


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
