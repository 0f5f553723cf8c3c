"""What is in a C3D file: points, as cameras see markers, and segments of bodies, as programs without markers have them.

Blocks of 512 bytes: a header, parameters, and frames, of four numbers a point (place, and a residual that is negative
where the point is not seen) and then of analog channels. Points' numbers are whole, with a scale, or floating ones (The
C3D File Format User Guide, https://www.c3d.org). Segments have frames of their own, of 17 floating numbers each: a
matrix from the segment's axes to the world's, column after column, and how sure it is, negative where it is not known
(Visual3D, "ROTATION data type", https://wiki.has-motion.com/ROTATION_DATA_TYPE).

Legend: T frames, K points, S segments.
"""

from __future__ import annotations

import math
import mmap
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.regular import open_regular
from mrhubo.motion.readers.markers.c3d_parameters import BLOCK, CUT, Parameters
from mrhubo.motion.readers.options import RATES
from mrhubo.motion.readers.sightings import check_size

_MAX_BYTES = 4 * 2**30
_CHUNK = 2**24
"""Bytes of frames that are read at a time."""
_OF_SEGMENT = 17
"""Numbers of a segment in a frame."""
_CROOKED = 0.01
"""How far the axes of a segment may be from unit ones at right angles to each other."""


@dataclass(frozen=True)
class Segments:
    """How a body's segments are turned, and where they are."""

    turn_TS33: np.ndarray
    """Their axes in the file's world, in columns; NaN where they are not known, as places are."""
    place_TS3: np.ndarray
    """Where their axes begin, in the file's unit."""
    names: tuple[str, ...]
    rate: float | None
    """Frames per second, if the file tells."""


@dataclass(frozen=True)
class C3d:
    """What a file holds."""

    point_TK3: np.ndarray
    """In the file's unit and world, float64; NaN where a point is not seen."""
    names: tuple[str, ...]
    rate: float | None
    """Frames per second, if the file tells."""
    frames_told: int
    """So many are promised; more than there are where the file was cut off."""
    segments: Segments | None = None
    """None: the file has none."""


def read_c3d_file(path: Path) -> C3d:
    """Reads the points and segments of a file.

    Raises:
        UserError: it is missing, damaged or too large, or has neither points nor segments.
    """
    with open_regular(path, _MAX_BYTES) as handle:
        if path.stat().st_size < 2 * BLOCK:
            raise UserError(f"{path}: ends within its header; {CUT}")
        with mmap.mmap(handle.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return _read(path, data)


def _read(path: Path, data: mmap.mmap) -> C3d:
    told = Parameters.read(path, data)
    numbers = told.numbers
    header = numbers.whole(data[:BLOCK], signed=False)
    points, analog, first, last = (int(header[word]) for word in (1, 2, 3, 4))
    points = int(told.number("POINT", "USED", points))
    scale, header_rate = numbers.floating(data[12:16])[0], float(numbers.floating(data[20:24])[0])
    scale = float(told.number("POINT", "SCALE", float(scale)))
    start = int(told.number("POINT", "DATA_START", int(header[8]))) or int(header[8])
    rate = _rate(told.number("POINT", "RATE", header_rate), header_rate)
    begin = (start - 1) * BLOCK
    segments = _read_segments(path, data, told, last - first + 1, rate, begin if points or analog else len(data))
    if not points:
        if segments is None:
            raise UserError(f"{path}: is a C3D file without points; export it with the markers")
        return C3d(np.empty((0, 0, 3)), (), rate, 0, segments)
    if not math.isfinite(scale) or scale == 0:
        raise UserError(f"{path}: is a C3D file whose points' scale is {scale}; is it damaged?")
    width = 4 if scale < 0 else 2
    stride = width * (4 * points + analog)
    there = max(0, len(data) - begin) // stride if begin >= 0 else 0
    frames = _frames([last - first + 1, told.long_range() or 0, int(told.number("POINT", "FRAMES", 0))], there)
    count = min(frames, there)
    if count < 1:
        raise UserError(f"{path}: has no frame of its {points} points where its header says; {CUT}")
    check_size(path, "the file", count, points)
    value_TK4 = np.empty((count, points, 4))
    for frame in range(0, count, size := max(1, _CHUNK // stride)):
        rows = data[begin + frame * stride : begin + min(count, frame + size) * stride]
        value_TX = (numbers.floating(rows) if scale < 0 else numbers.whole(rows)).reshape(-1, stride // width)
        with np.errstate(invalid="ignore"):  # damaged numbers that are none
            value_TK4[frame : frame + size] = value_TX[:, : 4 * points].reshape(-1, points, 4)
    seen_TK1 = value_TK4[..., 3:] >= 0
    point_TK3 = np.where(seen_TK1, value_TK4[..., :3] * (1.0 if scale < 0 else scale), np.nan)
    return C3d(point_TK3, told.labels("POINT", points), rate, frames, segments)


def _read_segments(
    path: Path, data: mmap.mmap, told: Parameters, frames: int, rate: float | None, points_at: int
) -> Segments | None:
    """The segments, if there are any.

    Args:
        path: the file.
        data: its bytes.
        told: its parameters.
        frames: how many the header tells.
        rate: that of points.
        points_at: where their frames begin.
    """
    count, start = (int(told.number("ROTATION", name, 0)) for name in ("USED", "DATA_START"))
    begin, stride = (start - 1) * BLOCK, 4 * _OF_SEGMENT * count
    if count < 1 or begin < 0:
        return None
    ratio = max(1, int(told.number("ROTATION", "RATIO", 1)))
    there = max(0, (points_at if points_at > begin else len(data)) - begin) // stride
    counts = [int(told.number("ROTATION", "FRAMES", 0)), ratio * frames, frames, told.long_range() or 0]
    length = min(_frames(counts, there), there)
    if length < 1:
        return None
    check_size(path, "the file", length, 4 * count)
    value_TSX = told.numbers.floating(data[begin : begin + length * stride]).reshape(length, count, _OF_SEGMENT)
    with np.errstate(all="ignore"):  # damaged numbers that are none
        matrix_TS44 = value_TSX[..., :16].reshape(length, count, 4, 4).swapaxes(-1, -2).astype(np.float64)
        turn_TS33, place_TS3 = matrix_TS44[..., :3, :3], matrix_TS44[..., :3, 3]
        off_TS33 = np.abs(turn_TS33.swapaxes(-1, -2) @ turn_TS33 - np.eye(3))
        known_TS1 = (off_TS33.max(axis=(-1, -2)) < _CROOKED) & (np.linalg.det(turn_TS33) > 0)
    known_TS1 = (known_TS1 & np.isfinite(place_TS3).all(-1) & ~(value_TSX[..., 16] < 0))[..., None]
    own_rate = told.number("ROTATION", "RATE", 0.0)
    return Segments(
        np.where(known_TS1[..., None], turn_TS33, np.nan), np.where(known_TS1, place_TS3, np.nan),
        told.labels("ROTATION", count), _rate(own_rate, ratio * rate if rate is not None else 0.0),
    )  # fmt: skip


def _rate(*told: float) -> float | None:
    """The first rate that is one."""
    return next((float(rate) for rate in told if math.isfinite(rate) and RATES[0] <= rate <= RATES[1]), None)


def _frames(told: list[int], there: int) -> int:
    """How many frames are told, where several counts are: the most of those that are there."""
    good = [count for count in told if 0 < count <= there]
    return max(good) if good else max(1, *told)
