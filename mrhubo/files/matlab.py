"""MATLAB's files of versions 5 to 7, as `save` writes them unless it is told otherwise.

A file is a header of 128 bytes and elements: 8 bytes that tell what one is and its length, and as many bytes more; one
may be a packed element, and one that is a variable has elements of its own (MAT-File Format,
https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf). SciPy reads them too, but a damaged file may end the
process in it.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.regular import check_regular, open_regular

_START, _HDF5 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"
_HEADER = 128
_MAX_BYTES = 2**28
"""Of a file, of what is in it unpacked, and of its arrays: a number may take eight times its bytes in one."""
_MAX_VALUES = 2**20
"""Of arrays, texts, structures and cells."""
_MAX_AXES, _DEEPEST = 32, 32

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""Elements of numbers, as NumPy calls these."""
_MATRIX, _PACKED = 14, 15
_TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_ENDS = {"<": "-le", ">": "-be"}
_CELL, _STRUCTURE, _CHARACTERS, _OPAQUE = 1, 2, 4, 17
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
"""Arrays of numbers, and what their numbers are, however they are stored."""
_COMPLEX, _LOGICAL = 0x800, 0x200


class _Damaged(Exception):
    """What is wrong."""


def is_matlab(start: bytes) -> bool:
    """Whether a file begins as MATLAB's do."""
    return start.startswith((_START, _HDF5))


def read_matlab(path: Path) -> dict[str, Any]:
    """The variables of a file: arrays, texts, and of structures and cells dictionaries and lists of these; None for
    whatever else MATLAB has. Rows and columns come as arrays and lists of one axis.

    Raises:
        UserError: it is damaged, too large, or of version 7.3, which is an HDF5 file.
    """
    check_regular(path, _MAX_BYTES)
    with open_regular(path) as handle:
        content = handle.read(_MAX_BYTES)
    is_hdf5 = content[_HEADER - 4 : _HEADER - 2] in (b"\0\2", b"\2\0") and b"HDF" in content[:520]
    if content.startswith(_HDF5) or is_hdf5:
        raise UserError("is a MATLAB file of version 7.3; save it as one of version 7: save('NAME.mat', '-v7')")
    order = {b"IM": "<", b"MI": ">"}.get(content[_HEADER - 2 : _HEADER])
    try:
        if order is None:
            raise _Damaged("its header does not tell the order of its bytes")
        return _Reader(order).variables(content)
    except (_Damaged, zlib.error, ValueError, OverflowError) as error:
        raise UserError(f"is a MATLAB file that is damaged: {error}") from error


class _Elements:
    """Elements one after the other."""

    def __init__(self, content: memoryview, order: str) -> None:
        self._content, self._order, self._at = content, order, 0

    @property
    def left(self) -> int:
        """How many bytes come."""
        return len(self._content) - self._at

    def next(self) -> tuple[int, memoryview]:
        """What the next one is, and its bytes."""
        if self.left < 8:
            raise _Damaged("it ends early")
        kind, length = (int(word) for word in np.frombuffer(self._content, f"{self._order}u4", 2, self._at))
        is_short = kind >> 16 != 0  # four bytes at most, beside what it is
        begin = self._at + (4 if is_short else 8)
        if is_short:
            kind, length = kind & 0xFFFF, kind >> 16
        end = begin + length
        if end > len(self._content) or (is_short and length > 4):
            raise _Damaged("it ends early")
        whole = end if kind == _PACKED else -(-end // 8) * 8  # all others end where eight bytes do
        self._at = min(whole, len(self._content))
        return kind, self._content[begin:end]

    def numbers(self) -> np.ndarray:
        """The next one's."""
        kind, content = self.next()
        if kind not in _NUMBERS:
            raise _Damaged(f"it has an element {kind} where numbers are expected")
        return np.frombuffer(content, self._order + _NUMBERS[kind])

    def text(self) -> str:
        """The next one's."""
        kind, content = self.next()
        if kind not in _TEXTS:
            raise _Damaged(f"it has an element {kind} where a text is expected")
        codec = _TEXTS[kind] + (_ENDS[self._order] if kind in (4, 17, 18) else "")
        return bytes(content).decode(codec, "replace")


class _Reader:
    """Of one file; counts what it makes."""

    def __init__(self, order: str) -> None:
        self._order, self._bytes, self._values = order, 0, 0

    def variables(self, content: bytes) -> dict[str, Any]:
        """All by their names, the last where two have one."""
        elements, found = _Elements(memoryview(content)[_HEADER:], self._order), dict[str, Any]()
        while elements.left:
            kind, inside = elements.next()
            if kind == _PACKED:
                kind, inside = _Elements(memoryview(self._unpacked(inside)), self._order).next()
            if kind == _MATRIX:
                name, value = self._matrix(inside, 0)
                if name:  # what has none is MATLAB's own
                    found[name] = value
        return found

    def _unpacked(self, packed: memoryview) -> bytes:
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(packed, _MAX_BYTES - self._bytes + 1)
        self._count(len(content))
        if not unpacking.eof:
            raise _Damaged("it ends early")
        return content

    def _count(self, size: int) -> None:
        self._bytes += size
        if self._bytes > _MAX_BYTES:
            raise UserError(f"has more than {_MAX_BYTES:,} bytes when it is unpacked; cut it")

    def _matrix(self, content: memoryview, depth: int) -> tuple[str, Any]:
        """The name and the value of a variable, of a field or a cell, which have no name."""
        self._values += 1
        if self._values > _MAX_VALUES:
            raise UserError(f"has more than {_MAX_VALUES:,} arrays, texts and cells; cut it")
        if not len(content):  # an empty cell
            return "", np.zeros(0)
        elements = _Elements(content, self._order)
        flags = elements.numbers()
        if not flags.size:
            raise _Damaged("a variable does not tell what it is")
        flag = int(flags[0])
        kind = flag & 0xFF
        if kind == _OPAQUE:
            return elements.text(), None
        sizes, name = [int(size) for size in elements.numbers()], elements.text()
        if not 2 <= len(sizes) <= _MAX_AXES or min(sizes) < 0:
            raise _Damaged(f"a variable has the sizes {sizes[:4]}")
        if kind not in {_CELL, _STRUCTURE, _CHARACTERS, *_CLASSES}:
            return name, None
        if kind == _CHARACTERS:
            return name, self._characters(elements, sizes)
        if kind in _CLASSES:
            return name, self._numbers(elements, sizes, flag, _CLASSES[kind])
        if depth == _DEEPEST:
            raise UserError(f"has structures in structures, more than {_DEEPEST} deep")
        inside = self._cells if kind == _CELL else self._structures
        return name, inside(elements, sizes, depth + 1)

    def _numbers(self, elements: _Elements, sizes: Sequence[int], flag: int, dtype: str) -> np.ndarray | None:
        if flag & _COMPLEX:
            return None
        stored = elements.numbers()
        if stored.size != math.prod(sizes):
            raise _Damaged(f"a variable has {stored.size:,} numbers of {math.prod(sizes):,}")
        made = np.dtype(bool if flag & _LOGICAL else dtype)
        self._count(stored.size * made.itemsize)
        return _of_matrix(stored.astype(made), sizes)

    def _characters(self, elements: _Elements, sizes: Sequence[int]) -> Any:
        """A text, or the rows of a table of letters, as MATLAB pads these."""
        if not elements.left:
            return ""
        text = elements.text()
        self._count(4 * len(text))
        if len(sizes) != 2 or math.prod(sizes) == 0:
            return "" if math.prod(sizes) == 0 else None
        if sizes[0] == 1:
            return text
        if len(text) != math.prod(sizes):
            return None
        return [text[row :: sizes[0]].rstrip() for row in range(sizes[0])]

    def _cells(self, elements: _Elements, sizes: Sequence[int], depth: int) -> Any:
        return _nested([self._value(elements, depth) for _ in range(_places(sizes, elements.left))], sizes)

    def _structures(self, elements: _Elements, sizes: Sequence[int], depth: int) -> Any:
        width, names = elements.numbers(), elements.next()[1]
        if width.size != 1 or not 0 < int(width[0]) <= max(len(names), 1):
            raise _Damaged("a structure does not tell its fields")
        step = int(width[0])
        fields = [_until_zero(names[begin : begin + step]) for begin in range(0, len(names), step)]
        if not fields:
            return {}
        made = [{name: self._value(elements, depth) for name in fields} for _ in range(_places(sizes, elements.left))]
        return _nested(made, sizes)

    def _value(self, elements: _Elements, depth: int) -> Any:
        kind, content = elements.next()
        if kind != _MATRIX:
            raise _Damaged(f"it has an element {kind} where a variable is expected")
        return self._matrix(content, depth)[1]


def _places(sizes: Sequence[int], left: int) -> int:
    """How many cells or structures there are, each of which takes 8 bytes at least."""
    count = math.prod(sizes)
    if count > left // 8:
        raise _Damaged("it ends early")
    return count


def _of_matrix(values: np.ndarray, sizes: Sequence[int]) -> np.ndarray:
    """Of these sizes, column after column; MATLAB knows no array of fewer than two axes."""
    shaped = values.reshape(sizes, order="F")
    return shaped.reshape([size for size in sizes if size != 1]) if len(sizes) == 2 else shaped


def _nested(values: list[Any], sizes: Sequence[int]) -> Any:
    """Lists in lists; what is alone by itself."""
    if len(values) == 1:
        return values[0]
    table = np.empty(len(values), dtype=object)
    for number, value in enumerate(values):
        table[number] = value
    return _of_matrix(table, sizes).tolist()


def _until_zero(content: memoryview) -> str:
    return bytes(content).split(b"\0")[0].decode("utf-8", "replace")
