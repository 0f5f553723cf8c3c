"""A table that OptiTrack's Motive exports (.csv): skeletons' bones, or markers.

The first line has what the file says of itself, a key and a value after the other. Lines of the header follow: of which
`Type` each column is (`Bone`, `Rigid Body`, `Marker` ...), its `Name` (`Fred:LUArm`), further ones, `Rotation` or
`Position`, and its axis, beside `Frame` and `Time (Seconds)`. Cells of frames in which something is not tracked are
empty (https://docs.optitrack.com, Data Export: CSV).

Legend: T frames, B bones.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from mrhubo.errors import UserError, listed, shortened
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.regular import open_regular
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_numbers import numbers_in_column
from mrhubo.motion.readers.other_rotations import from_quaternions

BEGINS = "Format Version"
"""How a file begins."""
_BONE, _MARKER, _TURN, _PLACE = "bone", "marker", "rotation", "position"
_MAX_BYTES, _MAX_LINE = 2 * 2**30, 2**21
_MAX_FRAMES, _MAX_NUMBERS, _MAX_BONES = 500_000, 50_000_000, 1_000
_HEADER = 20
"""Lines in which the header ends, with room."""
_QUATERNION = ("w", "x", "y", "z")
_EXPORT = "export the skeleton with it from Motive, or as BVH or FBX"


@dataclass(frozen=True)
class MotiveTable:
    """What a file has of skeletons' bones, or of markers where it has no bones."""

    told: Mapping[str, str]
    """What the file says of itself, by its keys in small letters."""
    bones: tuple[str, ...]
    """Their names."""
    place_TB3: np.ndarray
    """Where bones begin, in the file's unit and world; NaN in frames in which they are not tracked."""
    turns: tuple[np.ndarray, ...]
    """How bones are turned (T, B, 3, 3), NaN in such frames; of angles, in either way of reading their order; none
    of markers."""
    time_T: np.ndarray
    """Seconds; NaN where the file does not say."""


def read_motive_table(path: Path) -> MotiveTable:
    """Reads the bones of a table, or its markers.

    Raises:
        NoMotion: it has neither.
        UserError: it is missing, damaged or too large, or bones are told in a form that is not read.
    """
    with open_regular(path, _MAX_BYTES) as handle, io.TextIOWrapper(handle, "utf-8-sig", "replace") as text:
        header, first = _header(path, text)
        told = {key.strip().lower(): value.strip() for key, value in zip(header[0][::2], header[0][1::2], strict=False)}
        if (space := told.get("coordinate space", "")).lower() == "local":
            raise UserError(
                f"{path}: its 'Coordinate Space' is '{space}': bones are told from bone to bone; export it again with"
                " the global one (World)"
            )
        kind, columns = _columns(path, header)
        missing = [name for name, of in columns.items() if not of.keys() >= {(_PLACE, axis) for axis in "xyz"}]
        if kind == _BONE:
            missing += [name for name, of in columns.items() if not of.keys() >= {(_TURN, axis) for axis in "xyz"}]
        if missing:
            raise UserError(
                f"{path}: has no rotation or no position of the {kind}s {shortened(listed(missing), 100)}; {_EXPORT}"
            )
        axes, order = _turn_axes(path, columns, told) if kind == _BONE else ((), "")
        wanted = [
            of[key]
            for of in columns.values()
            for key in [*((_PLACE, axis) for axis in "xyz"), *((_TURN, axis) for axis in axes)]
        ]
        rows_TX = _rows(path, text, [0, 1, *wanted], first)
    numbers = numbers_in_column(path, rows_TX[:, 0]) or list(range(len(rows_TX)))
    if max(numbers) >= min(_MAX_FRAMES, _MAX_NUMBERS // rows_TX.shape[1]):
        raise UserError(f"{path}: its frames are numbered up to {max(numbers):,}, more than are read")
    placed_TX = np.full((max(numbers) + 1, rows_TX.shape[1]), np.nan)
    placed_TX[numbers] = rows_TX
    value_TBX = placed_TX[:, 2:].reshape(len(placed_TX), len(columns), 3 + len(axes))
    place_TB3, turn_TBX = value_TBX[..., :3], value_TBX[..., 3:]
    turns = ()
    if axes:
        turns = (from_quaternions(turn_TBX),) if axes == _QUATERNION else _of_angles(turn_TBX, order)
    return MotiveTable(told, tuple(columns), place_TB3, turns, placed_TX[:, 1])


def _header(path: Path, text: TextIO) -> tuple[list[list[str]], int]:
    """The cells of the header's lines, down to that of axes, and the number of the line after it."""
    lines: list[str] = []
    for line in islice(_lines(text), _HEADER):
        lines.append(line)
        if line.lstrip(' "').lower().startswith("frame") and len(lines) > 1:
            try:
                return [row for row in csv.reader(lines, strict=False) if any(map(str.strip, row))], len(lines) + 1
            except csv.Error as error:
                raise UserError(f"{path}: its header is damaged: {shortened(error, 80)}") from error
    raise UserError(f"{path}: is a table of OptiTrack Motive without a line that begins with 'Frame'; was it cut off?")


def _columns(path: Path, header: Sequence[Sequence[str]]) -> tuple[str, dict[str, dict[tuple[str, str], int]]]:
    """Whether there are bones, or else markers; and their columns, by names, and by what is told along which axis."""
    kinds_at = next((i for i, row in enumerate(header[:-2]) if i and any(map(str.strip, row[2:]))), None)
    kinds = [] if kinds_at is None else [cell.strip().lower() for cell in header[kinds_at]]
    kind = next((kind for kind in (_BONE, _MARKER) if kind in kinds), None)
    if kinds_at is None or kind is None:
        raise NoMotion(
            f"{path}: is a table of OptiTrack Motive without bones and markers, of"
            f" {shortened(listed({*kinds[2:]} - {''}), 80) or 'nothing'}; make a skeleton of the person in Motive, and"
            f" {_EXPORT}"
        )
    columns: dict[str, dict[tuple[str, str], int]] = {}
    for column, (of, name, what, axis) in enumerate(
        zip(kinds, header[kinds_at + 1], header[-2], header[-1], strict=False)
    ):
        if of == kind:
            key = what.strip().lower(), axis.strip().lower()
            columns.setdefault(name.strip(' "'), {}).setdefault(key, column)
    if len(columns) > _MAX_BONES:
        raise UserError(f"{path}: has {len(columns)} {kind}s; at most {_MAX_BONES} are read")
    return kind, columns


def _turn_axes(
    path: Path, columns: Mapping[str, Mapping[tuple[str, str], int]], told: Mapping[str, str]
) -> tuple[tuple[str, ...], str]:
    """The columns of rotations; and of angles, in which order they follow each other."""
    if all((_TURN, "w") in of for of in columns.values()):
        return _QUATERNION, ""
    order = told.get("rotation type", "").lower()
    if sorted(order[-3:]) != ["x", "y", "z"]:
        raise UserError(
            f"{path}: does not tell in which order the angles of bones are ('Rotation Type' is"
            f" '{shortened(order, 30)}'); export it with quaternions"
        )
    return ("x", "y", "z"), order[-3:]


def _lines(text: TextIO) -> Iterator[str]:
    """The lines that are left; what is longer than any line of a table is cut."""
    return iter(lambda: text.readline(_MAX_LINE), "")


def _rows(path: Path, text: TextIO, columns: Sequence[int], number: int) -> np.ndarray:
    """Some columns of the frames (T, X); NaN for cells that are empty.

    Args:
        path: the file, for sentences.
        text: what is after the header.
        columns: which.
        number: of the first line.
    """
    found: list[np.ndarray] = []
    last = max(columns)
    for at, line in enumerate(_lines(text), start=number):
        cells = line.rstrip("\r\n").split(",")
        if len(cells) <= last:
            if not any(map(str.strip, cells)):
                continue
            raise UserError(f"{path}: line {at} has {len(cells)} columns; expected {last + 1}; was it cut off?")
        try:
            found.append(np.array([cells[column] or "nan" for column in columns], dtype=np.float64))
        except ValueError:
            wrong = next((cells[column] for column in columns if not _is_number(cells[column])), "")
            raise UserError(f"{path}: line {at} holds '{shortened(wrong, 30)}', no number") from None
        if len(found) > _MAX_FRAMES or len(found) * len(columns) > _MAX_NUMBERS:
            raise UserError(f"{path}: has more than {len(found) - 1:,} frames of {len(columns)} numbers; cut it")
    if not found:
        raise UserError(f"{path}: has a header and no frames")
    return np.stack(found)


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _of_angles(angle_TB3: np.ndarray, order: str) -> tuple[np.ndarray, ...]:
    """Rotations of angles [deg] about x, y and z, in an order of axes that turn with what is turned, or stay."""
    about = {
        axis: axis_angle_to_matrix(np.radians(angle_TB3[..., i : i + 1]) * np.eye(3)[i]) for i, axis in enumerate("xyz")
    }
    first, second, third = (about[axis] for axis in order)
    return first @ second @ third, third @ second @ first
