"""Files on disk that are either whole or absent, and the checksum of their bytes; needs no PyTorch."""

from __future__ import annotations

import contextlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import xxhash

from mrhubo.errors import UserError
from mrhubo.files.regular import open_regular


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yields a temporary path in the same folder; on success its content is synced and takes the place of `path`.

    Raises:
        UserError: the path has no name (``.``, ``/``), or the folder or the disk refuses the file (no space, no
            permission); nothing half-written stays.
    """
    if not path.name:
        raise UserError(f"{path}: is a folder; name a file")
    temporary = path.with_name(f".{path.name}.{platform.node()}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        with open(temporary, "rb") as handle:
            os.fsync(handle.fileno())
        os.replace(temporary, path)
        _sync_folder(path.parent)
    except OSError as error:
        in_file = os.path.exists(path.parent) and not os.path.isdir(path.parent)
        why = f"{path.parent} is no folder" if in_file else error.strerror or error
        raise UserError(f"{path}: cannot be written: {why}") from error
    finally:
        with contextlib.suppress(OSError):  # it was never made, nor perhaps its folder
            temporary.unlink(missing_ok=True)


def _sync_folder(folder: Path) -> None:
    """Makes a renamed file outlast a power cut; Windows does that on its own, and opens no folders."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def checksum_file(path: Path) -> str:
    """xxh3 of a file's bytes, 16 hex digits.

    Raises:
        UserError: it is missing, no regular file, or may not be read.
    """
    digest = xxhash.xxh3_64()
    with open_regular(path) as file:
        while piece := file.read(2**20):
            digest.update(piece)
    return digest.hexdigest()
