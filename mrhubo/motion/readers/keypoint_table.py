"""Keypoints in tables of text: a line a frame, under a header with three columns a point.

FreeMoCap's `mediapipe_body_3d_xyz.csv` has `left_shoulder_x`, `left_shoulder_y`, `left_shoulder_z` and so on, in
millimetres (https://github.com/freemocap/freemocap); who writes landmarks of MediaPipe into a table by hand calls them
so, or `x_left_shoulder`, or `x1`, `y1`, `z1`, `v1`, or `0_x`, or `landmark_0_x`. Columns stand between commas,
semicolons (numbers then may have decimal commas) or tabs. Headers of several lines are made one by
`mrhubo.motion.readers.table_header`; tables with a line a point are read by `mrhubo.motion.readers.point_table`.

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.frame_numbers import numbers_in_column
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_files import checked
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED, by_names
from mrhubo.motion.readers.rate import rate_of_even, rate_of_seconds
from mrhubo.motion.readers.sightings import check_size, placed
from mrhubo.motion.readers.table_header import separator_of, with_one_header

_KINDS = {"x": 0, "y": 1, "z": 2, "v": 3, "visibility": 3, "confidence": 3, "conf": 3, "score": 3, "presence": 3,
          "likelihood": 3}  # fmt: skip
"""What stands behind, or before, the name of a point: an axis, or how sure it is."""
_LAST = re.compile(r"(.+?)[ _.:\-\[(]*(?<![a-z])(" + "|".join(_KINDS) + r")[\])]?(?: *[\[(].*)?", re.IGNORECASE)
_FIRST = re.compile(
    r"([xyzv])[ _.]?(\d+)|(x|y|z|visibility|confidence|conf|score|presence)[ _.]([a-z].*)", re.IGNORECASE
)
_NUMBERED = re.compile(r"(.*?)(\d{1,9})")
_TURNED_TOO = re.compile(r"(.+?[ _.:\-])([TR])([XYZ])", re.IGNORECASE)
"""`Hips_Tx` beside `Hips_Rx`, or alone: places and angles of bones."""
FRAMES, TIMES = (
    ("frame", "frames", "frameid", "frameindex", "frameidx", "framenumber"),
    ("time", "timestamp", "times", "timestampms", "timems", "timemilliseconds"),
)
"""What tables call the number of a frame, and its time, without signs and in small letters."""
_MILLISECONDS = re.compile(r"m(?:illi)?s(?:ec\w*)?[\])]?", re.IGNORECASE)
NOTHING = ("", "nan", "none", "null", "na")
"""Words of a table for what is not there, in small letters."""
_FEWEST = 5
"""Points that a table has at least."""
_MAX_BYTES, _MAX_COLUMNS = 2**28, 10_000
_BEGIN = 8
"""Lines by which a table is known."""


@dataclass(frozen=True)
class _Header:
    """What the columns of a table are."""

    separator: str
    points: dict[str, list[int | None]]
    """Columns of x, y, z and the confidence, by the names of points."""
    columns: list[str]


def is_table(content: Content) -> bool:
    """Whether a text begins with a header of points in space."""
    return content.text is not None and _read_header(_lines(content.text, _BEGIN)[0]) is not None


def read_table(path: Path, options: ReadOptions) -> Motion:
    """Reads points of a body.

    Raises:
        UserError: the file is damaged or too large, or it holds no points of a body.
    """
    lines = _lines(read_regular(path, _MAX_BYTES).decode("utf-8-sig", "replace"))
    header = _read_header(lines[0])
    if header is None:
        raise UserError(f"{path}: has no header with x, y and z of shoulders and hips")
    rows = [line for line in lines[1:] if line.strip(f" \t{header.separator}")]
    if not rows:
        raise UserError(f"{path}: has a header and no frames")
    check_size(path, "the table", len(rows), len(header.points))
    try:
        words = [*csv.reader(rows, delimiter=header.separator)]
    except csv.Error as error:
        raise UserError(f"{path}: is no table: {shortened(error, 80)}") from error
    wanted = [column for columns in header.points.values() for column in columns]
    value_TX = numbers_of(path, words, header.separator, header.columns, {*wanted})
    empty_T1 = np.full((len(value_TX), 1), np.nan)
    value_TX = np.hstack([value_TX, empty_T1])  # the last column is that of what is not there
    point_TK4 = value_TX[:, [-1 if column is None else column for column in wanted]].reshape(len(value_TX), -1, 4)
    numbers, rate = None, None
    frame, time = find_column(header.columns, FRAMES), find_column(header.columns, TIMES)
    if frame is not None:
        numbers = numbers_in_column(path, value_TX[:, frame])
    numbers = numbers or list(range(len(point_TK4)))
    if time is not None and numbers == list(range(len(numbers))):
        in_ms = _MILLISECONDS.search(header.columns[time][len("time") :])
        rate = rate_of_seconds(1e-3 * value_TX[:, time]) if in_ms else rate_of_even(value_TX[:, time])
    placed_TK4 = placed(path, "the table", numbers, point_TK4)
    sure_TK = placed_TK4[..., 3] if None not in wanted else None
    names = list(header.points) if by_names(list(header.points)).keys() >= set(NEEDED) else None
    found = Keypoints(placed_TK4[..., :3], names, sure_TK, rate, "the table", options.of_one())
    return motion_of_points(path, checked(path, found), options)


def split_header(line: str) -> tuple[str, list[str]]:
    """What stands between the columns of a table, and their names; none where the line is no header."""
    separator = separator_of(line)
    try:
        return separator, next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        return separator, []


def find_column(columns: Sequence[str], names: Sequence[str]) -> int | None:
    """The column that is called by the first of some names that there is, whatever signs and units are in it."""
    plain = [re.sub(r"[\[(].*|[^a-z]", "", column.lower()) for column in columns]
    return next((plain.index(name) for name in names if name in plain), None)


def number_of(word: str, separator: str) -> float:
    """A number, with a decimal comma where columns stand between other signs.

    Raises:
        ValueError: it is none.
    """
    return float(word.replace(",", ".") if separator != "," else word)


def filled_row(row: list[str], count: int) -> list[str]:
    """A line without empty columns at its end, and with those that programs leave out there."""
    while len(row) > count and not row[-1].strip():
        row.pop()
    return row + [""] * (count - len(row))


def numbers_of(
    path: Path, rows: Sequence[Sequence[str]], separator: str, columns: Sequence[str], needed: Collection[int | None]
) -> np.ndarray:
    """The lines of a table as numbers (T, X), of X columns; NaN for what is empty, and in columns that are not needed
    for what is no number.

    Raises:
        UserError: a line has more columns than the header, or fewer, or holds no number where one is needed.
    """
    found: list[np.ndarray] = []  # a few lines under a long header take little
    for number, row in enumerate(rows):
        if len(row) != len(columns):
            raise UserError(f"{path}: frame {number} has {len(row)} columns, and the header {len(columns)}")
        found.append(np.full(len(row), np.nan))
        for place, word in enumerate(row):
            try:
                found[-1][place] = number_of(word, separator)
            except ValueError:
                if place in needed and word.strip().lower() not in NOTHING:
                    column = shortened(columns[place], 40)
                    raise UserError(
                        f"{path}: frame {number} holds '{shortened(word, 30)}' under '{column}', no number"
                    ) from None
    return np.array(found).reshape(len(rows), len(columns))


def _lines(text: str, most: int | None = None) -> Sequence[str]:
    return with_one_header(text.replace("\r\n", "\n").replace("\r", "\n").split("\n")[:most])


def _read_header(line: str) -> _Header | None:
    """The columns of a table of points in space; None of any other line."""
    separator, columns = split_header(line)
    if not 3 * _FEWEST <= len(columns) <= _MAX_COLUMNS:
        return None
    points: dict[str, list[int | None]] = {}
    bones = {part[1] for column in columns if (part := _TURNED_TOO.fullmatch(column.strip())) and part[2] in "tT"}
    for place, column in enumerate(map(str.strip, columns)):
        bone = _TURNED_TOO.fullmatch(column)
        if bone is not None and bone[1] in bones:
            if bone[2] in "rR":
                continue
            column = bone[1] + bone[3]
        first, last = _FIRST.fullmatch(column), _LAST.fullmatch(column)
        if last is not None:
            name, kind = last[1], last[2]
        elif first is not None:
            name, kind = first[2] or first[4], first[1] or first[3]
        else:
            continue
        points.setdefault(name, [None] * 4)[_KINDS[kind.lower()]] = place
    points = {name: axes for name, axes in points.items() if None not in axes[:3]}
    parts = {name: part for name in points if (part := _NUMBERED.fullmatch(name)) is not None}
    numbered = len(parts) == len(points) and len({part[1] for part in parts.values()}) == 1
    if numbered:
        points = dict(sorted(points.items(), key=lambda entry: int(parts[entry[0]][2])))
    enough = len(points) >= _FEWEST and (numbered or by_names(list(points)).keys() >= set(NEEDED))
    return _Header(separator, points, columns) if enough else None
