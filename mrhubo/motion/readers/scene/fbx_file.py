"""The records of an FBX file, binary or text: names, values and records inside; what they mean is not asked here.

The binary form is described in https://code.blender.org/2013/08/fbx-binary-file-format-specification/: a record tells
where it ends, so that shapes and pictures, most of a file, are passed over. Text has the same records.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular

BINARY = b"Kaydara FBX Binary  \x00"
MAX_BYTES = 2**30
_OLDEST, OLD = 6000, 7000
"""Files of versions before the first are not read; those before the second have other records for what moves."""
_WIDE = 7500
"""The version from which on places in a file are told by 64 bits."""
_HEADER = 27
_MAX_DEPTH = 64
_MAX_RECORDS = 3_000_000
_MAX_NUMBERS = 50_000_000
"""Of one array."""
_PLAIN = {b"Y": "<h", b"C": "<B", b"B": "<B", b"I": "<i", b"F": "<f", b"D": "<d", b"L": "<q"}
_ARRAYS = {b"f": "<f4", b"d": "<f8", b"i": "<i4", b"l": "<i8", b"b": "?", b"c": "u1"}
_PASSED = frozenset(("Geometry", "Video", "Texture", "Material", "Implementation", "BindingTable", "Cache"))
"""Records of shapes and pictures, which tell nothing of a motion."""
_TOKEN = re.compile(
    r"""(?P<space>[\s,]++|;[^\n]*+)|(?P<key>[A-Za-z_][\w|-]*+)[ \t]*+:|"(?P<string>[^"]*+)"|(?P<open>\{)|(?P<close>\})
    |\*(?P<count>\d++)\s*+\{|(?P<number>[-+]?(?:\d++\.?\d*+|\.\d++)(?:[eE][-+]?\d++)?+)|(?P<word>[^\s,{}":;]++)""",
    re.VERBOSE,
)
_NO_COMMENT = re.compile(r"\s*+(?:;[^\n]*+\s*+)*+")


class BadFbx(ValueError):
    """An FBX file is damaged; says how, for a sentence about the file."""


@dataclass(frozen=True)
class Array:
    """Numbers of a file that are unpacked when they are asked for."""

    dtype: str
    count: int
    content: bytes
    """Packed by zlib, if `is_packed`; text where `dtype` is none."""
    is_packed: bool = False

    def numbers(self) -> np.ndarray:
        """The numbers (`count`,).

        Raises:
            BadFbx: there are more or fewer.
        """
        if self.count > _MAX_NUMBERS:
            raise BadFbx(f"holds an array of {self.count:,} numbers; at most {_MAX_NUMBERS:,} are read")
        if not self.dtype:
            return self._of_text()
        size, content = self.count * np.dtype(self.dtype).itemsize, self.content
        if self.is_packed:
            try:
                content = zlib.decompressobj().decompress(content, size + 1)
            except zlib.error as error:
                raise BadFbx(f"holds an array that cannot be unpacked ({error})") from error
        if len(content) != size:
            raise BadFbx(f"holds an array of {len(content):,} bytes where it promises {size:,}")
        return np.frombuffer(content, self.dtype)

    def _of_text(self) -> np.ndarray:
        words = self.content.replace(b",", b" ").split()
        try:
            numbers = np.array(words, dtype=np.float64) if len(words) == self.count else None
            if numbers is not None and not any(b"." in word or b"e" in word.lower() for word in words):
                numbers = np.array(words, dtype=np.int64)  # times are whole, and too large for float64
        except (ValueError, OverflowError) as error:
            raise BadFbx(f"holds an array with what is no number: '{shortened(str(error), 60)}'") from error
        if numbers is None:
            raise BadFbx(f"holds an array of {len(words):,} numbers where it promises {self.count:,}")
        return numbers


@dataclass
class Record:
    """A record."""

    name: str
    values: list[Any] = field(default_factory=list)
    """Numbers, texts, bytes and `Array`s."""
    children: list[Record] = field(default_factory=list)

    def named(self, name: str) -> Iterator[Record]:
        """The records in it of a name."""
        return (child for child in self.children if child.name == name)

    def first(self, name: str) -> Record:
        """The first record in it of a name; an empty one where there is none."""
        return next(self.named(name), Record(name))

    def text(self, place: int) -> str:
        """A value that is a text; empty where it is none."""
        value = self.values[place] if place < len(self.values) else ""
        return value if isinstance(value, str) else ""

    def whole(self, place: int = 0) -> int | None:
        """A value that is a whole number; None where it is none."""
        value = self.values[place] if place < len(self.values) else None
        return value if isinstance(value, int) else None

    def array(self) -> np.ndarray | None:
        """The numbers of its one value, an array; None where it has none.

        Raises:
            BadFbx: it is damaged.
        """
        if self.values and isinstance(self.values[0], Array):
            return self.values[0].numbers()
        if self.values and all(isinstance(value, int | float) for value in self.values):
            return np.array(self.values)
        return None


def is_text_fbx(start: str) -> bool:
    """Whether a text begins as an FBX file does."""
    found = _NO_COMMENT.match(start)
    return start.startswith("; FBX") or (found is not None and start.startswith("FBXHeaderExtension", found.end()))


def read_fbx_file(path: Path) -> tuple[Record, int]:
    """The records of a file, in one without a name, and the file's version: 7400 is 7.4.

    Raises:
        UserError: it is missing, damaged, too large, or of a version that is too old.
    """
    content = read_regular(path, MAX_BYTES)
    try:
        if content.startswith(BINARY):
            root, version = _read_binary(content)
        else:
            root = _read_text(content)
            version = root.first("FBXHeaderExtension").first("FBXVersion").whole() or OLD
    except (BadFbx, struct.error) as error:
        raise UserError(f"{path}: is a damaged FBX file: {error}") from error
    if version < _OLDEST:
        raise UserError(
            f"{path}: is an FBX file of version {version / 1000:g}, from before 2006; save it as FBX 2013 or later, for"
            " instance in MotionBuilder or by Autodesk's FBX Converter"
        )
    return root, version


def _read_binary(content: bytes) -> tuple[Record, int]:
    (version,) = struct.unpack_from("<I", content, len(BINARY) + 2)
    head = struct.Struct("<QQQB" if version >= _WIDE else "<IIIB")
    root, left = Record(""), [_MAX_RECORDS]
    if version >= _OLDEST:
        _read_inside(content, _HEADER, len(content), head, root, 0, left)
    return root, version


def _read_inside(
    content: bytes, place: int, end: int, head: struct.Struct, above: Record, depth: int, left: list[int]
) -> None:
    """Reads the records between two places of a file into another record."""
    if depth > _MAX_DEPTH:
        raise BadFbx(f"has records more than {_MAX_DEPTH} inside each other")
    while place + head.size <= end:
        after, count, size, letters = head.unpack_from(content, place)
        if not after:  # the record of zeros that ends a list
            return
        start = place + head.size + letters
        if not start + size <= after <= end:
            raise BadFbx(f"has a record at byte {place:,} that ends at {after:,}, beyond what holds it")
        left[0] -= 1
        if left[0] < 0:
            raise BadFbx(f"has more than {_MAX_RECORDS:,} records")
        record = Record(content[place + head.size : start].decode("latin1"))
        if not (above.name == "Objects" and record.name in _PASSED):
            record.values = _read_values(content, start, start + size, count)
            above.children.append(record)
            _read_inside(content, start + size, after, head, record, depth + 1, left)
        place = after
    if depth == 0 and not above.children:
        raise BadFbx("holds no records")


def _read_values(content: bytes, place: int, end: int, count: int) -> list[Any]:
    values: list[Any] = []
    for _ in range(count):
        kind = content[place : place + 1]
        place += 1
        if kind in _PLAIN:
            values.append(struct.unpack_from(_PLAIN[kind], content, place)[0])
            place += struct.calcsize(_PLAIN[kind])
        elif kind in _ARRAYS:
            length, packing, size = struct.unpack_from("<III", content, place)
            size = size if packing else length * np.dtype(_ARRAYS[kind]).itemsize
            values.append(Array(_ARRAYS[kind], length, content[place + 12 : place + 12 + size], bool(packing)))
            place += 12 + size
        elif kind in (b"S", b"R"):
            (size,) = struct.unpack_from("<I", content, place)
            piece = content[place + 4 : place + 4 + size]
            values.append(piece.decode("utf-8", "replace") if kind == b"S" else piece)
            place += 4 + size
        else:
            raise BadFbx(f"has a value of an unknown kind at byte {place - 1:,}")
        if place > end:
            raise BadFbx(f"has a value at byte {place:,} that is beyond the end of its record")
    return values


def _read_text(content: bytes) -> Record:
    text = content.decode("utf-8-sig", "replace")
    root = Record("")
    open_ones, record, place, count = [root], root, 0, 0
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None:
            raise BadFbx(f"has '{shortened(text[place : place + 40], 30)}' where a name or a value is expected")
        place, kind = found.end(), found.lastgroup
        if kind == "key":
            record, count = Record(found["key"]), count + 1
            open_ones[-1].children.append(record)
            if count > _MAX_RECORDS:
                raise BadFbx(f"has more than {_MAX_RECORDS:,} records")
        elif kind == "open":
            open_ones.append(record)
            if len(open_ones) > _MAX_DEPTH:
                raise BadFbx(f"has records more than {_MAX_DEPTH} inside each other")
        elif kind == "close":
            if len(open_ones) < 2:
                raise BadFbx("has a closing brace too many")
            record = open_ones.pop()
        elif kind == "count":
            end = text.find("}", place)
            if end < 0:
                raise BadFbx("ends inside an array")
            array = text[place:end].partition(":")[2].encode("latin1", "replace")
            record.values.append(Array("", int(found["count"][:12]), array))
            place = end + 1
        elif kind == "number":
            number = found["number"]
            is_whole = number.lstrip("+-").isdigit()
            record.values.append(int(number) if is_whole and len(number) < 20 else float(number))
        elif kind in ("string", "word"):
            record.values.append(found[kind])
    if len(open_ones) > 1:
        raise BadFbx(f"ends inside '{open_ones[-1].name}'")
    return root
