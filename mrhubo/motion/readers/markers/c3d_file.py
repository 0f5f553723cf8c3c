"""Points in a C3D file, as cameras see markers, and what the file says of them.

Blocks of 512 bytes: a header, parameters in groups (`POINT:LABELS` ...), and frames, of four numbers a point (place,
and a residual that is negative where the point is not seen) and then of analog channels. Numbers are whole, with a
scale, or floating ones; their bytes are in the order of Intel's, DEC's or MIPS's processors (The C3D File Format User
Guide, https://www.c3d.org).

Legend: T frames, K points.
"""

from __future__ import annotations

import math
import mmap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.regular import open_regular
from mrhubo.motion.readers.options import RATES
from mrhubo.motion.readers.sightings import check_size

_BLOCK = 512
_KEY = 0x50
_INTEL, _DEC, _MIPS = 84, 85, 86
_MAX_BYTES = 4 * 2**30
_CHUNK = 2**24
"""Bytes of frames that are read at a time."""
_MAX_PARAMETERS, _MAX_VALUE = 20_000, 2**20
_CUT = "was it cut off?"


@dataclass(frozen=True)
class Numbers:
    """How a processor's numbers lie in bytes."""

    processor: int

    @property
    def _order(self) -> str:
        return ">" if self.processor == _MIPS else "<"

    def whole(self, data: bytes | memoryview | mmap.mmap, signed: bool = True) -> np.ndarray:
        """Numbers of 16 bits."""
        return np.frombuffer(data, f"{self._order}{'i' if signed else 'u'}2")

    def floating(self, data: bytes | memoryview) -> np.ndarray:
        """Numbers of 32 bits; DEC's have their halves exchanged and another bias of the exponent."""
        if self.processor != _DEC:
            return np.frombuffer(data, f"{self._order}f4")
        half_X2 = np.frombuffer(data, "<u2").reshape(-1, 2)
        return np.ascontiguousarray(half_X2[:, ::-1]).view("<f4")[:, 0] / np.float32(4.0)


@dataclass(frozen=True)
class C3d:
    """What a file holds of points."""

    point_TK3: np.ndarray
    """In the file's unit and world, float64; NaN where a point is not seen."""
    names: tuple[str, ...]
    rate: float | None
    """Frames per second, if the file tells."""
    frames_told: int
    """So many are promised; more than there are where the file was cut off."""


def read_c3d_file(path: Path) -> C3d:
    """Reads the points of a file.

    Raises:
        UserError: it is missing, damaged or too large, or has no points.
    """
    with open_regular(path, _MAX_BYTES) as handle:
        if path.stat().st_size < 2 * _BLOCK:
            raise UserError(f"{path}: ends within its header; {_CUT}")
        with mmap.mmap(handle.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return _read(path, data)


def _read(path: Path, data: mmap.mmap) -> C3d:
    at = (data[0] - 1) * _BLOCK
    if at < 0 or at + 4 > len(data):
        raise UserError(f"{path}: is a C3D file whose parameters are not where its header says; {_CUT}")
    numbers = Numbers(data[at + 3])
    if numbers.processor not in (_INTEL, _DEC, _MIPS):
        raise UserError(f"{path}: is a C3D file of no processor that is known ({numbers.processor}); is it damaged?")
    header = numbers.whole(data[:_BLOCK], signed=False)
    told = _parameters(data, at, numbers)
    points, analog, first, last = (int(header[word]) for word in (1, 2, 3, 4))
    points = int(_number(told, "POINT", "USED", numbers, points))
    scale, header_rate = numbers.floating(data[12:16])[0], float(numbers.floating(data[20:24])[0])
    scale = float(_number(told, "POINT", "SCALE", numbers, float(scale)))
    start = int(_number(told, "POINT", "DATA_START", numbers, int(header[8]))) or int(header[8])
    rate = float(_number(told, "POINT", "RATE", numbers, header_rate))
    rate = next((told for told in (rate, header_rate) if math.isfinite(told) and RATES[0] <= told <= RATES[1]), None)
    if not points:
        raise UserError(f"{path}: is a C3D file without points; export it with the markers")
    if not math.isfinite(scale) or scale == 0:
        raise UserError(f"{path}: is a C3D file whose points' scale is {scale}; is it damaged?")
    width = 4 if scale < 0 else 2
    stride = width * (4 * points + analog)
    begin = (start - 1) * _BLOCK
    there = max(0, len(data) - begin) // stride if begin >= 0 else 0
    frames = _frames(told, numbers, last - first + 1, there)
    count = min(frames, there)
    if count < 1:
        raise UserError(f"{path}: has no frame of its {points} points where its header says; {_CUT}")
    check_size(path, "the file", count, points)
    value_TK4 = np.empty((count, points, 4))
    for frame in range(0, count, size := max(1, _CHUNK // stride)):
        rows = data[begin + frame * stride : begin + min(count, frame + size) * stride]
        value_TX = (numbers.floating(rows) if scale < 0 else numbers.whole(rows)).reshape(-1, stride // width)
        with np.errstate(invalid="ignore"):  # damaged numbers that are none
            value_TK4[frame : frame + size] = value_TX[:, : 4 * points].reshape(-1, points, 4)
    seen_TK1 = value_TK4[..., 3:] >= 0
    point_TK3 = np.where(seen_TK1, value_TK4[..., :3] * (1.0 if scale < 0 else scale), np.nan)
    return C3d(point_TK3, tuple(_labels(told, points)), rate, frames)


def _frames(told: Mapping[tuple[str, str], bytes], numbers: Numbers, header: int, there: int) -> int:
    """How many frames are told: the header counts up to 65,535, so parameters may tell more."""
    counts = [header]
    start, end = (told.get(("TRIAL", f"ACTUAL_{name}_FIELD"), b"") for name in ("START", "END"))
    if len(start) >= 4 and len(end) >= 4:
        low, high = (numbers.whole(field[:4], signed=False).astype(np.int64) for field in (start, end))
        counts.append(int(high[0] + 65_536 * high[1] - low[0] - 65_536 * low[1]) + 1)
    counts.append(int(_number(told, "POINT", "FRAMES", numbers, 0)))
    good = [count for count in counts if 0 < count <= there]
    return max(good) if good else max(1, *counts)


def _number(told: Mapping[tuple[str, str], bytes], group: str, name: str, numbers: Numbers, default: float) -> float:
    """A number that a parameter tells, whole or floating by its length; the default where it tells none."""
    data = told.get((group, name), b"")
    if len(data) == 2:
        return float(numbers.whole(data, signed=False)[0])
    if len(data) == 4 and math.isfinite(value := float(numbers.floating(data)[0])):
        return value
    return default


def _labels(told: Mapping[tuple[str, str], bytes], points: int) -> Iterator[str]:
    """The names of points; empty for those that have none."""
    found: list[str] = []
    for number in range(1, points + 1):
        if len(found) >= points:
            break
        key = ("POINT", f"LABELS{number}" if number > 1 else "LABELS")
        if key not in told:
            break
        size = told[key][0] if told[key] else 0
        text = told[key][1:]
        found += [text[i : i + size].decode("latin1").strip(" \0") for i in range(0, len(text), size)] if size else []
    yield from (found + [""] * points)[:points]


def _parameters(data: mmap.mmap, at: int, numbers: Numbers) -> dict[tuple[str, str], bytes]:
    """What parameters tell, by their groups and names, in capitals: bytes, of texts after the length of one."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, bytes]] = []
    place = at + 4
    for _ in range(_MAX_PARAMETERS):
        if place + 2 > len(data):
            break
        length, group = (int(value) for value in np.frombuffer(data[place : place + 2], np.int8))
        length = abs(length)
        name_end = place + 2 + length
        if not length or not group or name_end + 2 > len(data):
            break
        name = data[place + 2 : name_end].decode("latin1").strip(" \0").upper()
        step = int(numbers.whole(data[name_end : name_end + 2], signed=False)[0])
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _value(data, name_end + 2)))
        if not step:
            break
        place = name_end + step
    return {(groups.get(group, ""), name): value for group, name, value in found}


def _value(data: mmap.mmap, at: int) -> bytes:
    """A parameter's bytes; of texts, after the length of one."""
    if at + 2 > len(data):
        return b""
    kind, dimensions = np.frombuffer(data[at : at + 2], np.int8)
    dimensions = int(dimensions)
    sizes = list(data[at + 2 : at + 2 + max(0, dimensions)])
    begin = at + 2 + len(sizes)
    size = math.prod(sizes) * abs(int(kind))
    value = data[begin : begin + size] if size <= _MAX_VALUE else b""
    if len(value) < size:
        return b""
    return bytes([sizes[0] if sizes else 1]) + value if kind == -1 else value
