"""The table of formats: which reader takes a file, told by what is in it and never by its ending."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.advice import advice
from mrhubo.motion.readers.amass import is_amass, read_amass
from mrhubo.motion.readers.amc import is_amc, read_acclaim
from mrhubo.motion.readers.bvh import is_bvh, read_bvh
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.estimators import is_container, read_estimated
from mrhubo.motion.readers.keypoints import is_keypoints, read_keypoints
from mrhubo.motion.readers.options import ReadOptions


@dataclass(frozen=True)
class Format:
    """A kind of file and who reads it."""

    name: str
    """For a sentence that lists what is read."""
    recognises: Callable[[Content], bool]
    """Whether a file is of this kind; must not raise."""
    read: Callable[[Path, ReadOptions], Motion]
    """Raises a UserError that names the path where the file is bad."""
    endings: tuple[str, ...]
    """The endings, in small letters, of files in a folder that are of this kind or damaged."""


_PYTHON = (".pkl", ".pickle", ".joblib", ".pt", ".pth", ".npy")

FORMATS: tuple[Format, ...] = (
    Format("AMASS and SMPL-family .npz", is_amass, read_amass, (".npz",)),
    Format("BVH", is_bvh, read_bvh, (".bvh",)),
    Format("ASF/AMC", is_amc, read_acclaim, (".amc",)),
    Format("keypoints (.json, .npy, .npz)", is_keypoints, read_keypoints, ()),
    # the last row: whatever else holds arrays in dictionaries
    Format("what an estimator of human pose writes", is_container, read_estimated, _PYTHON),
)
"""The first row that recognises a file reads it."""


def find_format(content: Content) -> Format | None:
    """The row of the table that reads a file; None where there is none."""
    return next((row for row in FORMATS if row.recognises(content)), None)


def read_any(path: Path, options: ReadOptions) -> Motion:
    """Reads a motion by whichever reader recognises it.

    Raises:
        NoMotion: nobody does; says what the file is.
        UserError: whoever does finds it bad.
    """
    content = Content.open(path)
    row = find_format(content)
    if row is None and (what_to_do := advice(content)) is not None:
        raise NoMotion(f"{path}: {what_to_do}")
    if row is None:
        expected = ", ".join(row.name for row in FORMATS)
        raise NoMotion(
            f"{path}: is {content.described}, and no human motion that is read here; expected one of: {expected}"
            " (docs/formats.md says how each is laid out)"
        )
    return row.read(path, options)
