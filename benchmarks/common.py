"""What every benchmark prints: machine, commit, command, and a table."""

from __future__ import annotations

import platform
import shlex
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from mrhubo.motion import Motion, motion_files
from mrhubo.runtime.locations import project_root
from mrhubo.runtime.provenance import git_commit
from mrhubo.runtime.tables import markdown

_WHOLE_BODY = Path("data/external/cmu/whole_body")


def read_options(argv: list[str], **defaults: str) -> tuple[dict[str, str], list[str]]:
    """Values of the `--name VALUE` arguments (in `defaults`, without the dashes), and the arguments besides."""
    others = []
    while argv:
        word, *argv = argv
        if not word.startswith("--"):
            others.append(word)
            continue
        name = word.removeprefix("--")
        if name not in defaults or not argv:
            sys.exit(f"{word}: is unknown or lacks its value; there are --{', --'.join(defaults)}")
        defaults[name], *argv = argv
    return defaults, others


def whole_body_clips(clips: str) -> list[Path]:
    """Files of motions with a root: all of `_WHOLE_BODY`, those of a folder, or some by their names with commas between
    them.
    """
    if clips == "all" or Path(clips).is_dir():
        return motion_files(_WHOLE_BODY if clips == "all" else Path(clips))
    return [_WHOLE_BODY / f"{name}.npz" for name in clips.split(",")]


def beginning(motion: Motion, frames: int) -> Motion:
    """The first frames of a motion."""
    arrays = vars(motion.arrays)
    return motion.changed(**{name: array[:frames] for name, array in arrays.items() if array is not None})


def mean_of(scores: Sequence[Any], key: str) -> float:
    """The mean of an attribute."""
    return statistics.fmean(getattr(score, key) for score in scores)


def most_of(scores: Sequence[Any], key: str) -> float:
    """The largest of an attribute."""
    return max(getattr(score, key) for score in scores)


def print_header() -> None:
    """Machine, commit and command."""
    processor = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo") as lines:
            processor = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    device = torch.cuda.get_device_name() if torch.cuda.is_available() else "no GPU"
    print(f"machine: {processor}, {torch.get_num_threads()} threads, {device}, torch {torch.__version__}")
    print(f"commit:  {git_commit(project_root())}")
    print(f"command: python {shlex.join(sys.argv)}\n")


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A Markdown table with aligned columns."""
    print(markdown(columns, rows))
