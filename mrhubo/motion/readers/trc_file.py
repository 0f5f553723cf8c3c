"""Points in a TRC file, a line a frame: joints as cameras without markers find them, or markers on the skin.

Pose2Sim and Sports2D (https://github.com/perfanalytics/pose2sim), OpenCap (https://www.opencap.ai) and others write
such files for OpenSim: three lines that tell of the file, the names of points, their axes, and the frames, between tabs
(https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53089972). A place that is not known is left empty.
Most files of OpenSim have markers on the skin, of which joints are worked out (`mrhubo.motion.readers.markers`).

Legend: T frames, K points.
"""

from __future__ import annotations

from pathlib import Path

from mrhubo.errors import UserError, listed, shortened
from mrhubo.files.regular import read_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.advice import SOLVE
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.frame_numbers import numbers_in_column
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_files import checked
from mrhubo.motion.readers.keypoint_table import filled_row, numbers_of
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.markers.convert import motion_of_markers
from mrhubo.motion.readers.markers.labels import has_body
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED, by_names
from mrhubo.motion.readers.rate import rate_in_words
from mrhubo.motion.readers.sightings import check_size, placed

_BEGINS = "PathFileType"
_BEFORE = 2
"""Columns before those of the points: the frame's number and its time."""
_HEADER = 5
_OF_HALPE = {"Head", "Nose", "LSmallToe"}
"""Names of Halpe's 26 points, whose head is its top (https://github.com/Fang-Haoshu/Halpe-FullBody)."""
_GAPS = 10
"""Of so many frames, one is there at least: what is not seen is written as empty places."""
_MAX_BYTES, _MOST = 2**28, 3_000


def is_trc(content: Content) -> bool:
    """Whether a text begins as a TRC file does."""
    return content.text is not None and content.text.startswith(_BEGINS)


def read_trc(path: Path, options: ReadOptions) -> Motion:
    """Reads points of a body. Their rate is the file's `DataRate`; axes and unit are found by the body.

    Raises:
        UserError: the file is damaged or too large, or its points are no joints of a body.
    """
    text = read_regular(path, _MAX_BYTES).decode("utf-8-sig", "replace")
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) < _HEADER:
        raise UserError(f"{path}: ends within its header")
    told = dict(zip(*([word.strip() for word in line.split("\t")] for line in lines[1:3]), strict=False))
    names = [word.strip() for word in lines[3].split("\t")[_BEFORE:] if word.strip()]
    if len(names) > _MOST:
        raise UserError(f"{path}: has {len(names)} points; at most {_MOST} are read")
    are_joints = by_names(names).keys() >= set(NEEDED)
    if not are_joints and not has_body(names):
        raise UserError(
            f"{path}: is a TRC file whose points are no joints: {shortened(listed(names), 120)}; shoulders and hips are"
            f" needed, by names such as RShoulder, or markers of shoulders and pelvis, as LSHO, LASI and LPSI; {SOLVE}"
        )
    rows = [line.split("\t") for line in lines[_HEADER:]]
    if not rows:
        raise UserError(f"{path}: has a header and no frames")
    check_size(path, "the file", len(rows), len(names))
    columns = ["Frame#", "Time", *(f"{name}'s {axis}" for name in names for axis in "XYZ")]
    value_TX = numbers_of(path, [filled_row(row, len(columns)) for row in rows], "\t", columns, {*range(len(columns))})
    point_TK3 = value_TX[:, _BEFORE:].reshape(len(value_TX), len(names), 3)
    numbers = numbers_in_column(path, value_TX[:, 0]) or list(range(len(value_TX)))
    if max(numbers) + 1 > _GAPS * len(numbers):
        raise UserError(f"{path}: has {len(numbers)} frames, numbered from 0 to {max(numbers):,}; is one wrong?")
    placed_TK3 = placed(path, "the file", numbers, point_TK3)
    called = ["head_top" if name == "Head" and set(names) >= _OF_HALPE else name for name in names]
    found = Keypoints(
        placed_TK3, called, None, rate_in_words(told.get("DataRate", "")), "the TRC file", options.of_one()
    )
    if not are_joints:
        return motion_of_markers(path, found, "TRC file", options)
    return motion_of_points(path, checked(path, found), options)
