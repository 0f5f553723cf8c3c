"""Human motions from files and folders."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.formats import FORMATS, find_format, read_any
from mrhubo.motion.readers.frame_files import frame_files
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions

_NO_MOTION = ("shape", "_stagei")
"""Endings of the names of AMASS's files that hold no motion."""


def read_motion(path: Path | str, options: ReadOptions | None = None) -> Motion:
    """Reads a human motion; what is in the file, and not its ending, says how (`mrhubo.motion.readers.formats`).

    Raises:
        UserError: the file is missing, damaged, hostile, too large, or not a motion.
    """
    return read_any(Path(path), options or ReadOptions())


def read_folder(folder: Path, options: ReadOptions | None = None) -> list[Motion]:
    """Every motion in a folder (not in its subfolders), sorted by name.

    Files that some reader recognises are taken, and so are damaged ones with the ending of a motion file, to be
    complained of. Hidden files, AMASS's shape files, and arrays and pickles that hold no motion are passed over.

    Raises:
        UserError: the folder is missing or holds no motion, two files hold a motion of one name, or a file is bad.
    """
    by_name: dict[str, Path] = {}
    for file in motion_files(folder):
        other = by_name.setdefault(motion_name(file), file)
        if other is not file:
            raise UserError(f"{folder}: {other.name} and {file.name} are both named '{motion_name(file)}'; keep one")
    motions, other = [], None
    for name in sorted(by_name):
        try:
            motions.append(read_motion(by_name[name], options))
        except NoMotion as error:
            other = other or error
    if other is not None and not motions:
        raise other
    return motions


def motion_files(folder: Path) -> list[Path]:
    """The files of a folder that `read_folder` would try, one at least, sorted; the folder itself, if that has a
    file a frame of one motion.

    Raises:
        UserError: the folder is missing or holds none.
    """
    folder = Path(folder)
    _refuse_file(folder)
    if not os.path.isdir(folder):
        raise UserError(f"{folder}: there is no such folder")
    if frame_files(folder) is not None:
        return [folder]
    files = _motion_files(folder)
    if not files:
        raise UserError(f"{folder}: holds no motion file")
    return files


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
    raise UserError(f"no motion file found; looked in: {looked}")


def _refuse_file(folder: Path) -> None:
    if os.path.isfile(folder):
        raise UserError(f"{folder}: is a file; name the folder that holds it: {folder.parent}")


def _motion_files(folder: Path) -> list[Path]:
    try:
        found = sorted(file for file in folder.iterdir() if not file.name.startswith("."))
    except OSError as error:
        raise UserError(f"{folder}: cannot be read: {error.strerror or error}") from error
    return [file for file in found if not file.stem.endswith(_NO_MOTION) and os.path.isfile(file) and _is_motion(file)]


def _is_motion(file: Path) -> bool:
    if file.suffix.lower() in {ending for row in FORMATS for ending in row.endings}:
        return True
    try:
        row = find_format(Content.open(file))
    except UserError:
        return False
    return row is not None and bool(row.endings)  # what has none is beside motions, and is none itself
