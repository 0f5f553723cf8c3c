"""What a glTF 2.0 file holds: its JSON, and the arrays of numbers that lie in buffers in it or beside it.

Khronos' specification: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html; GLB is the form in one binary file,
which VRM files have too. Numbers are looked at in place, so that a small file cannot ask for much memory.

Legend: K elements of an accessor, X numbers of each.
"""

from __future__ import annotations

import base64
import binascii
import json
import os
import re
import struct
import urllib.parse
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import MissingFile, naming, read_regular

MAGIC = b"glTF"
_MAX_BYTES = 2**30
"""Of a file, and of all buffers beside it."""
_MAX_TEXT = 2**29
"""Of JSON [bytes]."""
_MAX_NUMBERS = 200_000_000
"""That are looked at."""
_MAX_MADE = 2**25
"""Numbers that do not lie in a buffer as they are."""
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<II")
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_TYPES: dict[int, tuple[str, float]] = {
    5120: ("i1", 127.0),
    5121: ("u1", 255.0),
    5122: ("<i2", 32767.0),
    5123: ("<u2", 65535.0),
    5125: ("<u4", 1.0),
    5126: ("<f4", 1.0),
}
"""Of numbers: NumPy's type, and what stands for 1 where they are normalised."""
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_PACKED = "meshopt_compression"
"""How the extensions end that pack the numbers of animations; Draco's packs those of meshes alone."""
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_DATA = re.compile(r"data:([^,]{0,200}),", re.IGNORECASE)
DAMAGED = "the file is damaged, or was written wrongly; export it again"
"""What to think of what must not be in a file, for the end of a sentence."""


def whole(holder: dict[str, Any], key: str, where: str, most: int, default: int | None = None, least: int = 0) -> int:
    """A whole number of a dictionary.

    Raises:
        UserError: it is missing and has no default, is none, or not from `least` to `most`.
    """
    value = holder.get(key, default)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        said = "is missing" if value is None else f"is {shortened(value, 30)}"
        expected = f"a whole number from {least} to {most:,}" if most >= least else "none, as there is nothing to name"
        raise UserError(f"'{key}' of {where} {said}; expected {expected}; {DAMAGED}")
    return value


def entries(holder: dict[str, Any], key: str, where: str = "the file") -> list[dict[str, Any]]:
    """A list of dictionaries, empty where it is missing.

    Raises:
        UserError: it is none.
    """
    value = holder.get(key, [])
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        raise UserError(f"'{key}' of {where} is no list of objects; {DAMAGED}")
    return value


def inner(holder: dict[str, Any], *keys: str) -> dict[str, Any]:
    """A dictionary in dictionaries, empty where there is none."""
    value: Any = holder
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return value if isinstance(value, dict) else {}


class GltfFile:
    """The JSON of a file, and its arrays, which are read when they are asked for."""

    def __init__(self, path: Path, top: dict[str, Any], binary: memoryview | None) -> None:
        self.path, self.top = path, top
        self._binary = binary
        self._accessors, self._views, self._all_buffers = (
            entries(top, key) for key in ("accessors", "bufferViews", "buffers")
        )
        self._buffers: dict[int, memoryview] = {}
        self._found: dict[int, np.ndarray] = {}
        self._room, self._left, self._to_make = _MAX_BYTES, _MAX_NUMBERS, _MAX_MADE

    def numbers(self, holder: dict[str, Any], key: str, kind: str, where: str) -> np.ndarray:
        """The numbers (K, X) of an accessor; those that are normalised come as float32.

        Args:
            holder: what names the accessor.
            key: by which it does.
            kind: what the accessor must be, for instance VEC4.
            where: what the holder is, for sentences.

        Raises:
            UserError: there is none, it is of another kind, does not lie in its buffer, is packed or not finite.
        """
        place = whole(holder, key, where, len(self._accessors) - 1)
        accessor, where = self._accessors[place], f"accessor {place}, '{key}' of {where},"
        if accessor.get("type") != kind:
            raise UserError(f"{where} is of type {shortened(accessor.get('type'), 20)}; expected {kind}; {DAMAGED}")
        if place not in self._found:
            self._found[place] = self._read(accessor, _WIDTHS[kind], where)
        return self._found[place]

    def _read(self, accessor: dict[str, Any], width: int, where: str) -> np.ndarray:
        count = whole(accessor, "count", where, _MAX_NUMBERS // width, least=1)
        self._left -= count * width
        if self._left < 0:
            raise UserError(f"its animations and skins have more than {_MAX_NUMBERS:,} numbers; cut it into parts")
        kind, one = _type(accessor, where)
        sparse = inner(accessor, "sparse")
        is_normalised = accessor.get("normalized") is True and one != 1
        if sparse or is_normalised or "bufferView" not in accessor:
            self._to_make -= count * width
            if self._to_make < 0:
                raise UserError(
                    f"its animations and skins have more than {_MAX_MADE:,} numbers that are left out, sparse or"
                    " normalised; cut it into parts, or export plain numbers"
                )
        if "bufferView" in accessor:
            value_KX = self._block(accessor, kind, count, width, where)
        else:
            value_KX = np.zeros((count, width), kind)
        if sparse:
            value_KX = self._replaced(value_KX, sparse, kind, where)
        if is_normalised:
            value_KX = np.maximum(value_KX / np.float32(one), np.float32(-1))
        if not np.isfinite(value_KX).all():
            raise UserError(f"{where} holds NaN or infinite numbers; {DAMAGED}")
        return value_KX

    def _replaced(self, value_KX: np.ndarray, sparse: dict[str, Any], kind: str, where: str) -> np.ndarray:
        """The numbers, with others at the places that a sparse accessor tells."""
        count = whole(sparse, "count", where, len(value_KX), least=1)
        indices, values = inner(sparse, "indices"), inner(sparse, "values")
        index_K = self._block(indices, _type(indices, where)[0], count, 1, where)[:, 0]
        if index_K.dtype.kind != "u" or index_K.max() >= len(value_KX):
            raise UserError(f"{where} is sparse, with places beyond its {len(value_KX):,} elements; {DAMAGED}")
        value_KX = value_KX.copy()
        value_KX[index_K] = self._block(values, kind, count, value_KX.shape[1], where)
        return value_KX

    def _block(self, holder: dict[str, Any], kind: str, count: int, width: int, where: str) -> np.ndarray:
        """Numbers (count, width) as they lie in the part of a buffer that a dictionary names."""
        place = whole(holder, "bufferView", where, len(self._views) - 1)
        view, named = self._views[place], f"buffer view {place}, of {where}"
        buffer = self._buffer(view, named)
        size = np.dtype(kind).itemsize * width
        start = whole(view, "byteOffset", named, _MAX_BYTES, 0)
        length = whole(view, "byteLength", named, _MAX_BYTES)
        stride = whole(view, "byteStride", named, _MAX_BYTES, 0) or size
        offset = whole(holder, "byteOffset", where, _MAX_BYTES, 0)
        if start + length > len(buffer) or offset + (count - 1) * stride + size > length:
            raise UserError(
                f"{where} has {count:,} elements, which do not lie in its buffer of {len(buffer):,} bytes; {DAMAGED}"
            )
        strides = (stride, np.dtype(kind).itemsize)
        return np.ndarray((count, width), kind, buffer, start + offset, strides)

    def _buffer(self, view: dict[str, Any], where: str) -> memoryview:
        """The bytes in which a buffer view lies."""
        place = whole(view, "buffer", where, len(self._all_buffers) - 1)
        if place not in self._buffers:
            entry, named = self._all_buffers[place], f"buffer {place}"
            packed = [name for name in inner(view, "extensions") if name.endswith(_PACKED)]
            is_empty = any(inner(entry, "extensions", name).get("fallback") is True for name in packed)
            has_bytes = "uri" in entry or (place == 0 and self._binary is not None and not is_empty)
            if packed and not has_bytes:
                raise UserError(
                    "its animations are packed by meshopt; export it without compression (gltfpack without -c,"
                    " gltf-transform with --compress false)"
                )
            length = whole(entry, "byteLength", named, _MAX_BYTES)
            found = self._bytes(entry, place, named)
            if len(found) < length:
                raise UserError(f"{named} says that it has {length:,} bytes, and has {len(found):,}; {DAMAGED}")
            self._buffers[place] = found[:length]
        return self._buffers[place]

    def _bytes(self, entry: dict[str, Any], place: int, named: str) -> memoryview:
        uri = entry.get("uri")
        if uri is None and place == 0 and self._binary is not None:
            return self._binary
        if not isinstance(uri, str):
            raise UserError(f"{named} has no bytes: neither a 'uri' nor a chunk of a GLB file; {DAMAGED}")
        if data := _DATA.match(uri):
            try:
                if data[1].lower().endswith(";base64"):
                    return memoryview(base64.b64decode(uri[data.end() :], validate=True))
                return memoryview(urllib.parse.unquote_to_bytes(uri[data.end() :]))
            except (binascii.Error, ValueError) as error:
                raise UserError(f"the text of {named} is no base64; {DAMAGED}") from error
        content = read_regular(self._beside(uri, named), self._room)
        self._room -= len(content)
        return memoryview(content)

    def _beside(self, uri: str, named: str) -> Path:
        """The file beside this one that a buffer names."""
        shown, names = shortened(uri, 80), (urllib.parse.unquote(uri), uri)  # some write names as they are
        if _SCHEME.match(uri) or any(n.startswith(("/", "\\")) or ".." in re.split(r"[/\\]", n) for n in names):
            raise UserError(
                f"{named} is '{shown}', which does not lie beside the file; put it there and write its name alone, or"
                " export a .glb file, which holds all"
            )
        for name in names:
            if "\0" not in name and os.path.lexists(self.path.parent / name):
                return self.path.parent / name
        raise MissingFile(
            f"{named} is '{shown}', which is not there; put it beside the file, or export a .glb file, which holds all"
        )


def read_gltf_file(path: Path) -> GltfFile:
    """Reads a .glb or .gltf file, but not yet its numbers.

    Raises:
        UserError: it is missing, damaged, too large, or of another version.
    """
    with naming(path):
        content = read_regular(path, _MAX_BYTES)
        text, binary = _chunks(content) if content[:4] == MAGIC else (content, None)
        if len(text) > _MAX_TEXT:
            raise UserError(f"has {len(text):,} bytes of JSON; at most {_MAX_TEXT:,} are read; export a .glb file")
        try:
            top = _parsed(bytes(text).rstrip(b"\0"))
        except (ValueError, RecursionError) as error:
            raise UserError(f"its JSON is damaged: {shortened(error, 80)}; export or download it again") from error
        if not isinstance(top, dict):
            raise UserError(f"its JSON is no object, as that of glTF is; {DAMAGED}")
        version = str(inner(top, "asset").get("version", "2.0"))
        if version.partition(".")[0] != "2":
            raise UserError(f"is glTF {shortened(version, 20)}; 2.0 is read; convert it, for instance in Blender")
        return GltfFile(path, top, binary)


def _parsed(text: bytes) -> Any:
    """What JSON holds; where names are not in UTF-8, as some programs write them, each byte is a letter."""
    try:
        return json.loads(text)
    except UnicodeDecodeError:
        return json.loads(text.decode("latin1"))


def _chunks(content: bytes) -> tuple[memoryview, memoryview | None]:
    """The JSON and the binary chunk of a GLB file."""
    if len(content) < _HEADER.size + _CHUNK.size:
        raise UserError(f"has {len(content)} bytes, in which no glTF is; was it copied or downloaded to its end?")
    _, version, length = _HEADER.unpack_from(content)
    if version != 2:
        raise UserError(f"is glTF {version}, in a binary file; 2 is read; convert it, for instance in Blender")
    if length > len(content):
        raise UserError(
            f"says that it has {length:,} bytes, and has {len(content):,}; was it copied or downloaded to its end?"
        )
    found: dict[int, memoryview] = {}
    start, end = _HEADER.size, length
    while start + _CHUNK.size <= end and len(found) < 2:
        size, kind = _CHUNK.unpack_from(content, start)
        start += _CHUNK.size
        if start + size > end:
            raise UserError(f"a part of it ends beyond its {length:,} bytes; {DAMAGED}")
        if not found and kind != _JSON:
            raise UserError(f"does not begin with JSON, as a GLB file does; {DAMAGED}")
        if kind in (_JSON, _BINARY):
            found.setdefault(kind, memoryview(content)[start : start + size])
        start += size
    if not found:
        raise UserError(f"holds no JSON; {DAMAGED}")
    return found[_JSON], found.get(_BINARY)


def _type(accessor: dict[str, Any], where: str) -> tuple[str, float]:
    code = accessor.get("componentType")
    if not isinstance(code, int) or code not in _TYPES:
        raise UserError(f"'componentType' of {where} is {shortened(code, 20)}; expected 5120 to 5126; {DAMAGED}")
    return _TYPES[code]
