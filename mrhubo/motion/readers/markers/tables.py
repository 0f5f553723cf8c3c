"""Markers in tables of text, as Qualisys Track Manager (.tsv) and Vicon's Nexus (.csv) export them.

Qualisys: lines of a key and what it says (`FREQUENCY`, `MARKER_NAMES` ...), perhaps a line of columns, and a line a
frame, between tabs, perhaps with its number and time first (QTM User Manual, "TSV file formats"). Vicon: parts of a
file by their names; `Trajectories`, then the rate, labels over each three columns, axes, units, and a line a frame
(Vicon Nexus, "Export data to ASCII"). What is not seen is left empty; Qualisys may write zeros.

Legend: T frames, K points.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.files.regular import read_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_table import filled_row, numbers_of
from mrhubo.motion.readers.markers.convert import motion_of_labelled
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import rate_in_words
from mrhubo.motion.readers.sightings import check_size

_MAX_BYTES = 2**29
_QUALISYS = "NO_OF_FRAMES"
_PART = re.compile(r"^Trajectories[,\s]*$", re.MULTILINE)
_VICON = re.compile(r"(?:Joints|Segments|Model Outputs|Trajectories|Devices)[,\s]*\n\s*[0-9.]+[,\s]*\n")


def is_qualisys(content: Content) -> bool:
    """Whether a text begins as Qualisys' tables do."""
    return content.text is not None and content.text.startswith(_QUALISYS)


def is_vicon(content: Content) -> bool:
    """Whether a text begins as Vicon's tables do."""
    return content.text is not None and bool(_VICON.match(content.text.replace("\r\n", "\n")))


def read_qualisys(path: Path, options: ReadOptions) -> Motion:
    """Reads markers of a body.

    Raises:
        NoMotion: the table is of something else, or its markers are those of no body.
        UserError: it is missing, damaged or too large.
    """
    lines = [line for line in _lines(path) if line.strip(" ")]
    told: dict[str, list[str]] = {}
    start = next((i for i, line in enumerate(lines) if not line[0].isalpha()), len(lines))
    for line in lines[:start]:
        key, *words = line.split("\t")
        told.setdefault(key.strip().upper(), [word.strip() for word in words])
    kind = " ".join(told.get("DATA_INCLUDED", ["3D"]))
    names = _without_end(told.get("MARKER_NAMES", []))
    if "3D" not in kind or not names:
        raise NoMotion(f"{path}: is a table of Qualisys Track Manager without markers ({kind}); export their 3D data")
    before = 2 if [word.upper() for word in told.get("FRAME", [])[:1]] == ["TIME"] else 0
    rate = (told.get("FREQUENCY") or [""])[0]
    return _motion(path, lines[start:], "\t", names, before, rate, "Qualisys table", options)


def read_vicon(path: Path, options: ReadOptions) -> Motion:
    """Reads markers of a body, of the part of a file that holds them.

    Raises:
        NoMotion: there is no such part, or its markers are those of no body.
        UserError: it is missing, damaged or too large.
    """
    text = "\n".join(_lines(path))
    found = _PART.search(text)
    if found is None:
        raise NoMotion(
            f"{path}: is a table of Vicon without 'Trajectories', the markers; export them too, or the skeleton as BVH"
            " or FBX, for instance from Vicon Shogun or Blade"
        )
    part = text[found.end() :].lstrip("\n").split("\n\n", 1)[0].split("\n")
    part = part[: next((i for i, line in enumerate(part) if not line.strip(" ,")), len(part))]
    if len(part) < 4:
        raise UserError(f"{path}: ends within the header of its 'Trajectories'; was it cut off?")
    rate, labels = part[0].strip(" ,"), part[1].split(",")
    names = _without_end([label.strip(' "') for label in labels[2::3]])
    rows = part[3 + (not _is_number(part[3].split(",")[0])) :]
    return _motion(path, rows, ",", names, 2, rate, "Vicon table", options)


def _motion(
    path: Path, lines: Sequence[str], separator: str, names: Sequence[str], before: int, rate: str, kind: str,
    options: ReadOptions,
) -> Motion:  # fmt: skip
    """The motion of markers, a line a frame, after some columns that are none of theirs."""
    if not lines:
        raise UserError(f"{path}: has a header and no frames")
    check_size(path, "the table", len(lines), len(names))
    columns = [*("Frame", "Time")[:before], *(f"{name}'s {axis}" for name in names for axis in "XYZ")]
    rows = [filled_row(line.split(separator), len(columns)) for line in lines]
    value_TX = numbers_of(path, rows, separator, columns, range(before, len(columns)))
    point_TK3 = value_TX[:, before:].reshape(len(rows), len(names), 3)
    found = Keypoints(point_TK3, list(names), None, rate_in_words(rate), "the table")
    return motion_of_labelled(path, found, kind, options)


def _lines(path: Path) -> list[str]:
    return read_regular(path, _MAX_BYTES).decode("utf-8-sig", "replace").splitlines()


def _without_end(names: list[str]) -> list[str]:
    """Names without the empty ones at their end."""
    return names[: max((place + 1 for place, name in enumerate(names) if name), default=0)]


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
