"""Files of strangers that are packed as a whole, by gzip and its like: what they unpack to is bounded."""

from __future__ import annotations

import bz2
import io
import lzma
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from mrhubo.errors import UserError
from mrhubo.files.archive import too_dense
from mrhubo.files.regular import check_regular, open_regular

_PIECE = 2**20
_LZMA_MEMORY = 256 * 2**20
_ZLIB_STARTS = (b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda")
_UNPACKERS: tuple[tuple[bytes, Callable[[], Any]], ...] = (
    *((start, zlib.decompressobj) for start in _ZLIB_STARTS),
    (b"\x1f\x8b", lambda: zlib.decompressobj(31)),
    (b"BZh", bz2.BZ2Decompressor),
    (b"\xfd7zXZ", lambda: lzma.LZMADecompressor(lzma.FORMAT_XZ, _LZMA_MEMORY)),
    (b"\x5d\x00\x00", lambda: lzma.LZMADecompressor(lzma.FORMAT_ALONE, _LZMA_MEMORY)),
)
_LZ4 = b"\x04\x22\x4d\x18"


def is_packed(start: bytes) -> bool:
    """Whether a file that begins so is packed by zlib, gzip, bzip2, lzma, xz or LZ4."""
    return start.startswith(_LZ4) or any(start.startswith(magic) for magic, _ in _UNPACKERS)


def open_unpacked(path: Path, max_bytes: int, max_plain: int) -> BinaryIO:
    """A file that is packed, unpacked into memory; any other as it is. The caller closes it.

    Args:
        path: the file.
        max_bytes: most bytes that a packed one unpacks to.
        max_plain: most bytes of any other.

    Raises:
        UserError: it is no regular file, damaged, packed in a way that is not read, or unpacks to too much.
    """
    packed = check_regular(path, max_plain)
    handle = open_regular(path, max_plain)
    start = handle.read(8)
    handle.seek(0)
    if not is_packed(start):
        return handle
    with handle:
        if start.startswith(_LZ4):
            raise UserError(
                f"{path}: is packed by LZ4, which is not read; load it and dump it anew without compression"
            )
        unpacker = next(make for magic, make in _UNPACKERS if start.startswith(magic))()
        try:
            return io.BytesIO(_unpack(path, handle, unpacker, packed, max_bytes))
        except (zlib.error, lzma.LZMAError, OSError, EOFError, ValueError) as error:
            raise UserError(f"{path}: is packed, and cannot be unpacked: it is truncated or damaged") from error


def _unpack(path: Path, handle: BinaryIO, unpacker: Any, packed: int, max_bytes: int) -> bytearray:
    content = bytearray()
    data = handle.read(_PIECE)
    while not unpacker.eof:
        content += unpacker.decompress(data, _PIECE)
        if len(content) > max_bytes or too_dense(len(content), packed):
            raise UserError(f"{path}: unpacks to more than {len(content) / 2**20:.0f} MiB, which are not read")
        data = getattr(unpacker, "unconsumed_tail", b"")
        if not data and getattr(unpacker, "needs_input", True):
            data = handle.read(_PIECE)
            if not data and not unpacker.eof:
                raise EOFError
    return content
