"""What a motion is called."""

from __future__ import annotations

from pathlib import Path

_NAME_ENDINGS = ("_stageii", "_poses")


def motion_name(path: Path) -> str:
    """A file's name without its ending, and without AMASS's `_poses` or `_stageii`."""
    name = path.stem
    for ending in _NAME_ENDINGS:
        name = name.removesuffix(ending)
    return name or path.stem
