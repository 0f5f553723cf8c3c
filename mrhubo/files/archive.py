"""Zip archives of strangers: limits on what they unpack to are checked before anything is unpacked."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.files.regular import MAX_BYTES, check_regular

_MAX_DIRECTORY = 4_000_000
"""Bytes of the largest table of contents that is read; some 60,000 names."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""What NumPy and PyTorch write. The others unpack a chunk to any size before it can be counted."""
_MUCH = 256 * 2**20
_DENSEST = 300
"""What unpacks to so many times its size, and to more than `_MUCH` bytes, is no data but a bomb."""


class _Directory(io.BufferedReader):
    """A file that reads no huge piece at a time while its archive's table of contents is read."""

    limit: int | None = _MAX_DIRECTORY

    def read(self, size: int | None = -1, /) -> bytes:
        if self.limit is None:
            return super().read(size)
        if size is not None and size > self.limit:
            raise ValueError("its table of contents is too large")
        return super().read(self.limit if size is None or size < 0 else size)


def too_dense(unpacked: int, packed: int) -> bool:
    """Whether what unpacks to so many bytes is no data but a bomb."""
    return unpacked > max(_MUCH, _DENSEST * packed)


@contextmanager
def open_archive(path: Path, otherwise: str, max_bytes: int = MAX_BYTES) -> Iterator[zipfile.ZipFile]:
    """Opens a zip archive whose contents are stored or deflated and unpack to at most `max_bytes` in all.

    Args:
        path: the file.
        otherwise: what to say of a file that is no archive, to follow its name.
        max_bytes: most bytes that all its members may claim.

    Raises:
        UserError: it is no regular file, no archive, or unpacks to too much.
    """
    packed = check_regular(path)
    with ExitStack() as stack:
        try:
            file = stack.enter_context(_Directory(io.FileIO(path)))
            archive = stack.enter_context(zipfile.ZipFile(file))
        except OSError as error:
            raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error
        except Exception as error:  # whatever zipfile makes of a stranger's bytes
            raise UserError(f"{path}: {otherwise}") from error
        file.limit = None
        if any(member.compress_size > packed for member in archive.infolist()):  # would be asked of the file at once
            raise UserError(f"{path}: {otherwise}")
        unpacked = sum(member.file_size for member in archive.infolist())
        if unpacked > max_bytes:
            raise UserError(f"{path}: unpacks to more than {max_bytes / 2**30:.3g} GiB, which are not read")
        if too_dense(unpacked, packed):
            times = unpacked // max(1, packed)
            raise UserError(f"{path}: would unpack to {times:,} times its size, as no data does; it is not read")
        yield archive


def check_member(archive: zipfile.ZipFile, name: str) -> zipfile.ZipInfo:
    """A member that can be read without surprise.

    Raises:
        ValueError: it is packed by a method that is not read, or encrypted.
    """
    member = archive.getinfo(name)
    if member.compress_type not in _METHODS or member.flag_bits & 1:
        raise ValueError("is encrypted, or packed in another way than stored or deflated")
    return member
