"""Keypoints in tables with a line a point: a frame, the point's name or number, x, y and z, perhaps how sure it is.

FreeMoCap's `by_frame.csv` is so (https://github.com/freemocap/freemocap), and who writes landmarks of MediaPipe into a
table line by line. Columns stand between commas, semicolons (numbers then may have decimal commas) or tabs. A line that
tells no place is of a point that is not seen.

Legend: T frames, K keypoints.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.frame_numbers import frame_numbers_in
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_files import checked
from mrhubo.motion.readers.keypoint_table import NOTHING, find_column, number_of, split_header
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.sightings import Sighting, check_size, frames_of_one

PEOPLE = ("person", "personid", "trackid", "bodyid", "poseid")
"""What tables call whoever a line is of, without signs and in small letters."""
_COLUMNS = {
    "frame": ("frame", "frameid", "frameindex", "frameidx", "framenumber", "frameno"),
    "point": (
        "landmark", "landmarkname", "keypoint", "keypointname", "joint", "jointname", "bodypart", "point", "pointname",
        "name", "marker", "landmarkid", "keypointid", "jointid", "landmarkindex", "keypointindex", "jointindex",
    ),
    "person": PEOPLE,
    "x": ("x",), "y": ("y",), "z": ("z",),
    "sure": ("visibility", "confidence", "conf", "score", "presence"),
}  # fmt: skip
"""What columns are called, without signs and in small letters, the best name first."""
_NEEDED = ("frame", "point", "x", "y", "z")
_MAX_BYTES = 2**28


@dataclass(frozen=True)
class _Header:
    separator: str
    places: dict[str, int]
    """Columns, by the keys of `_COLUMNS`."""


_Points = dict[str, tuple[float, float, float, float]]
"""x, y, z and how sure, by the point."""


def is_point_table(content: Content) -> bool:
    """Whether a text begins with the header of such a table."""
    return content.text is not None and _read_header(content.text.splitlines()[0] if content.text else "") is not None


def read_point_table(path: Path, options: ReadOptions) -> Motion:
    """Reads points of a body.

    Raises:
        UserError: the file is damaged or too large, or it holds no points of a body.
    """
    lines = read_regular(path, _MAX_BYTES).decode("utf-8-sig", "replace").splitlines()
    header = _read_header(lines[0])
    if header is None:
        raise UserError(f"{path}: has no header with a frame, a point, x, y and z")
    try:
        seen = _read_lines(path, header, lines[1:])
    except csv.Error as error:
        raise UserError(f"{path}: is no table: {shortened(error, 80)}") from error
    if not seen:
        raise UserError(f"{path}: has a header and no points")
    names = list(dict.fromkeys(name for one in seen.values() for name in one))
    numbered = all(re.fullmatch(r"[0-9]{1,9}(?:\.0)?", name) for name in names)
    names = sorted(names, key=float) if numbered else names
    once = sorted({frame for frame, _ in seen}, key=float)
    numbers = dict(zip(once, frame_numbers_in(path, [f"{float(frame):.0f}" for frame in once]), strict=True))
    check_size(path, "the table", max(numbers.values()) + 1, len(names))
    unsure = "sure" not in header.places
    sightings = []
    for (frame, person), one in seen.items():
        row_K4 = np.array([one.get(name, (np.nan,) * 4) for name in names])
        sightings.append(Sighting(numbers[frame], person, row_K4[:, :3], None if unsure else row_K4[:, 3]))
    notes: list[str] = []
    people = {one.person for one in sightings}
    if len(people) > 1:
        person, places = frames_of_one(path, sightings, options, notes)
        where = f"the table, person '{person}'"
    else:
        placed = {one.frame: place for place, one in enumerate(sightings)}
        places, where, notes = [placed.get(frame) for frame in range(max(placed) + 1)], "the table", options.of_one()
    point_TK3 = np.full((len(places), len(names), 3), np.nan)
    sure_TK = np.zeros(point_TK3.shape[:2])
    for frame, place in enumerate(places):
        if place is not None:
            point_TK3[frame] = sightings[place].point_K3
            sure_TK[frame] = 1 if (sure_K := sightings[place].sure_K) is None else sure_K
    found = Keypoints(point_TK3, None if numbered else names, None if unsure else sure_TK, None, where, notes)
    return motion_of_points(path, checked(path, found), options)


def _read_header(line: str) -> _Header | None:
    """The columns of such a table; None of any other line."""
    separator, columns = split_header(line.lstrip("\ufeff"))
    found = {key: find_column(columns, names) for key, names in _COLUMNS.items()}
    places = {key: place for key, place in found.items() if place is not None}
    return _Header(separator, places) if all(key in places for key in _NEEDED) else None


def _read_lines(path: Path, header: _Header, lines: Sequence[str]) -> dict[tuple[str, str | None], _Points]:
    """Whoever is in the lines, by frame and person, as they come."""
    seen: dict[tuple[str, str | None], _Points] = {}
    most = max(header.places.values())
    for number, row in enumerate(csv.reader(lines, delimiter=header.separator), start=2):
        if not any(word.strip() for word in row):
            continue
        if len(row) <= most:
            raise UserError(f"{path}: line {number} has {len(row)} columns; expected {most + 1} or more")
        word = {key: row[place].strip() for key, place in header.places.items()}
        frame = word["frame"]
        _number(path, header, number, frame, "frame")
        one = seen.setdefault((frame, word.get("person") or None), {})
        name = word["point"]
        if name in one:
            raise UserError(f"{path}: line {number} tells '{shortened(name, 30)}' of frame {frame} once more")
        x, y, z, sure = (_number(path, header, number, word.get(key, "1"), key) for key in ("x", "y", "z", "sure"))
        one[name] = (x, y, z, sure)
    return seen


def _number(path: Path, header: _Header, line: int, word: str, what: str) -> float:
    """What a word tells; NaN where it says that it tells nothing."""
    if what != "frame" and word.lower() in NOTHING:
        return float("nan")
    try:
        number = number_of(word, header.separator)
        if what != "frame" or abs(number) < 1e15:  # NaN is no number of a frame
            return number
    except ValueError:
        pass
    raise UserError(f"{path}: line {line} holds '{shortened(word, 30)}' for {what}, no number")
