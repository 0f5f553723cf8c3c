"""Human motions from files and folders."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.amass import motion_name, read_amass

_NO_MOTION = ("shape", "_stagei")
"""Endings of the names of AMASS's files that hold no motion."""


def read_motion(path: Path | str) -> Motion:
    """Reads a human motion: an .npz file with the keys of AMASS, SMPL-X or SMPL-H.

    Raises:
        UserError: the file is missing, damaged, hostile, too large, or not a motion.
    """
    return read_amass(Path(path))


def read_folder(folder: Path) -> list[Motion]:
    """Every motion in a folder (not in its subfolders), sorted by name; hidden and AMASS's shape files are passed over.

    Raises:
        UserError: the folder is missing or holds no motion, two files hold a motion of one name, or a file is bad.
    """
    folder = Path(folder)
    _refuse_file(folder)
    if not os.path.isdir(folder):
        raise UserError(f"{folder}: there is no such folder")
    files = _motion_files(folder)
    if not files:
        raise UserError(f"{folder}: holds no .npz motion file")
    by_name: dict[str, Path] = {}
    for file in files:
        other = by_name.setdefault(motion_name(file), file)
        if other is not file:
            raise UserError(f"{folder}: {other.name} and {file.name} are both named '{motion_name(file)}'; keep one")
    return [read_motion(by_name[name]) for name in sorted(by_name)]


def find_motions(folders: Sequence[Path]) -> Path:
    """The first of some folders that exists and holds a motion file.

    Raises:
        UserError: none does, or one of them is a file.
    """
    for folder in map(Path, folders):
        _refuse_file(folder)
        if os.path.isdir(folder) and _motion_files(folder):
            return folder
    looked = ", ".join(str(folder) for folder in folders) or "no folder given"
    raise UserError(f"no .npz motion file found; looked in: {looked}")


def _refuse_file(folder: Path) -> None:
    if os.path.isfile(folder):
        raise UserError(f"{folder}: is a file; name the folder that holds it: {folder.parent}")


def _motion_files(folder: Path) -> list[Path]:
    try:
        found = [file for file in folder.iterdir() if file.suffix == ".npz" and not file.name.startswith(".")]
    except OSError as error:
        raise UserError(f"{folder}: cannot be read: {error.strerror or error}") from error
    return sorted(file for file in found if not file.stem.endswith(_NO_MOTION) and os.path.isfile(file))
