"""Which folders are motions with a JSON file a frame (`mrhubo.motion.readers.frame_folders` reads them): told by names
and beginnings of files, without PyTorch.
"""

from __future__ import annotations

import re
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.files.regular import read_regular

MAX_BYTES = 10_000_000
"""Of a frame."""
_MAX_FRAMES = 100_000
_BEGINNING = re.compile(
    rb'\s*+(?:\{.{0,300}?"(?:people|bodies)"\s*:\s*\[|\[\s*(?:\]\s*$|\{(?=.{0,300}?"keypoints3d"))).*', re.DOTALL
)
_NUMBER = re.compile(r"[0-9]")


def frame_files(folder: Path) -> list[Path]:
    """The files of a folder with one a frame, by name; none where it is no such folder."""
    try:
        files = [file for file in folder.iterdir() if file.suffix.lower() == ".json" and not file.name.startswith(".")]
    except OSError:
        return []
    if len(files) < 2 or len(files) > _MAX_FRAMES or not all(_NUMBER.search(file.stem) for file in files):
        return []
    files = sorted(files, key=lambda file: file.name)
    return files if is_frame(files[0]) and is_frame(files[-1]) else []


def is_frame(file: Path) -> bool:
    """Whether a file is a frame of such a folder; does not raise."""
    try:
        return bool(_BEGINNING.match(read_regular(file, MAX_BYTES)[:4096]))
    except UserError:
        return False
