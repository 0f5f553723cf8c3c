"""Where what can be made or fetched again is kept for a user."""

from __future__ import annotations

import os
from pathlib import Path


def user_cache() -> Path:
    """The folder of mrhubo in the user's cache; nobody has made it yet.

    By the XDG base directory specification: https://specifications.freedesktop.org/basedir-spec/latest/
    """
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mrhubo"
