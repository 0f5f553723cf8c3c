"""SMPL parameters in tables of text: a line a frame, or a frame and person, under a header with a column a number.

Who writes them out of Python calls columns `pose_0` to `pose_71`, `body_pose[3]`, `global_orient_x`, `body_pose_0_x`,
`trans_z`, `betas_9`; what stands before the number is called as in other files. Columns stand between commas,
semicolons (numbers then may have decimal commas) or tabs.

Legend: T frames, X columns.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.files.tree import tree_of
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.estimators import smpl_motion
from mrhubo.motion.readers.frame_numbers import numbers_in_column
from mrhubo.motion.readers.key_words import usual_name
from mrhubo.motion.readers.keypoint_files import POSE_KEYS
from mrhubo.motion.readers.keypoint_table import FRAMES, TIMES, find_column, numbers_of, split_header
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_table import PEOPLE
from mrhubo.motion.readers.rotations import WITH_ROOT, WITHOUT_ROOT, find_form
from mrhubo.motion.readers.sightings import check_size

_COLUMN = re.compile(
    r"(?P<name>[A-Za-z]\w*?)(?:[ _.\-]?[\[(]?(?P<place>[0-9]{1,3})[\])]?)?(?:[ _.\-]?[\[(]?(?P<axis>[xyz])[\])]?)?",
    re.IGNORECASE,
)
_MAX_BYTES, _MAX_COLUMNS = 2**28, 2_000


@dataclass(frozen=True)
class _Header:
    separator: str
    columns: list[str]
    places: dict[str, list[int]]
    """Columns of each array, in the order of its numbers."""
    pose: str
    """The array that is the pose."""


def is_parameter_table(content: Content) -> bool:
    """Whether a text begins with the header of such a table."""
    return content.text is not None and _read_header(content.text.splitlines()[0] if content.text else "") is not None


@np.errstate(all="ignore")  # what overflows is found out where it matters
def read_parameter_table(path: Path, options: ReadOptions) -> Motion:
    """Reads SMPL parameters, of one of the people in a table.

    Raises:
        UserError: the file is damaged or too large, or what it tells is no motion.
    """
    lines = read_regular(path, _MAX_BYTES).decode("utf-8-sig", "replace").splitlines()
    header = _read_header(lines[0])
    if header is None:
        raise UserError(f"{path}: has no header with the numbers of a pose")
    check_size(path, "the table", len(lines), 1)
    try:
        words = [*csv.reader(lines[1:], delimiter=header.separator)]
    except csv.Error as error:
        raise UserError(f"{path}: is no table: {shortened(error, 80)}") from error
    words = [row for row in words if any(word.strip() for word in row)]
    value_TX = numbers_of(path, words, header.separator, header.columns, {*header.places[header.pose]})
    seen_T = np.asarray(np.isfinite(value_TX[:, header.places[header.pose]]).any(axis=1))
    if not seen_T.any():
        raise UserError(f"{path}: has a header and no frames")
    people = find_column(header.columns, PEOPLE)
    who = ["" if people is None else row[people].strip() for row in words]
    names = dict.fromkeys(name for name, seen in zip(who, seen_T, strict=True) if seen)
    found = {name: _arrays(path, header, value_TX[seen_T & np.array([one == name for one in who])]) for name in names}
    motion = smpl_motion(path, tree_of(found if len(found) > 1 else next(iter(found.values())), path, ""), options)
    if motion is None:
        raise NoMotion(f"{path}: has columns of '{shortened(header.pose, 40)}', but no SMPL parameters of frames")
    return motion


def _arrays(path: Path, header: _Header, value_TX: np.ndarray) -> dict[str, np.ndarray]:
    """What a table tells of somebody, by the names of its columns."""
    found = {name: value_TX[:, places] for name, places in header.places.items()}
    frame, time = find_column(header.columns, FRAMES), find_column(header.columns, TIMES)
    if frame is not None and (numbers := numbers_in_column(path, value_TX[:, frame])) is not None:
        found["frame_ids"] = np.array(numbers)
    if time is not None:
        found["timestamps"] = value_TX[:, time]
    return found


def _read_header(line: str) -> _Header | None:
    """The columns of such a table; None of any other line."""
    separator, columns = split_header(line.lstrip("\ufeff"))
    columns = [column.strip() for column in columns]
    if len(columns) > _MAX_COLUMNS:
        return None
    told: dict[str, dict[tuple[int, str], int]] = {}
    for place, column in enumerate(columns):
        found = _COLUMN.fullmatch(column)
        if found is not None and (found["place"] or found["axis"]):
            told.setdefault(found["name"], {})[int(found["place"] or 0), (found["axis"] or "").lower()] = place
    places = {name: [those[key] for key in sorted(those)] for name, those in told.items()}
    forms = {name: find_form((1, len(those)), WITH_ROOT + WITHOUT_ROOT) for name, those in places.items()}
    poses = [name for name, form in forms.items() if form is not None and {name, usual_name(name)} & POSE_KEYS]
    return _Header(separator, columns, places, poses[0]) if poses else None
