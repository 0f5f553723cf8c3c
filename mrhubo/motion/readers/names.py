"""What motions, and those in a file, are called."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mrhubo.errors import nearest, shortened

_NAME_ENDINGS = ("_stageii", "_poses")
_LISTED = 10


def motion_name(path: Path) -> str:
    """A file's name without its ending, and without AMASS's `_poses` or `_stageii`."""
    name = path.stem
    for ending in _NAME_ENDINGS:
        name = name.removesuffix(ending)
    return name or path.stem


def several(told: Sequence[tuple[str, str]], wanted: str | None = None) -> str:
    """The first of some names, each with what is told of it, for the end of a sentence; where there are more, the one
    that is nearest to a name that is wanted.
    """
    said = ", ".join(f"'{shortened(name, 40)}' ({what})" for name, what in told[:_LISTED])
    if len(told) <= _LISTED:
        return said
    near = nearest(wanted, [name for name, _ in told]) if wanted is not None else None
    also = f"; nearest: '{near}'" if near is not None else ""
    return f"{said}, and {len(told) - _LISTED} more{also}"
