"""Which number each frame has, by the name of its file, of its picture, or of its entry in a dictionary."""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import naming

Frame = TypeVar("Frame")
_DIGITS = re.compile(r"[0-9]{1,18}")
"""So many fit an int64; of longer ones, the parts are looked at."""


def frame_numbers(names: Sequence[str]) -> list[int]:
    """The number of each frame, from 0 on, in units of the greatest common step: every fifth frame of a video is
    0, 1, 2, and what is missing between two frames is missing in their numbers.

    A name may hold several numbers (`cam2_frame0012_keypoints3d`). That of the frame differs between names and rises
    with them; of several that do, it is the last. Where no two names are one step apart, numbers are times (12033,
    12067, 12100), whose usual step is that of the frames. Where no number rises, the names tell an order and no gaps;
    where none differs, frames are in the order that is given.

    Raises:
        UserError: two frames have the same numbers, and others have not.
    """
    groups = [tuple(int(digits) for digits in _DIGITS.findall(name)) for name in names]
    if len(set(groups)) <= 1:
        return list(range(len(names)))
    order = sorted(range(len(names)), key=groups.__getitem__)
    for one, other in pairwise(order):
        if groups[one] == groups[other]:
            both = " and ".join(f"'{shortened(names[frame], 60)}'" for frame in (one, other))
            raise UserError(f"{both} have the same number, so that the order of the frames is not known")
    numbers = [0] * len(names)
    for frame, number in zip(order, _risen([groups[frame] for frame in order]), strict=True):
        numbers[frame] = number
    return numbers


def frame_numbers_in(path: Path, names: Sequence[str]) -> list[int]:
    """The same; what is wrong is said of a file or folder."""
    with naming(path):
        return frame_numbers(names)


def numbers_in_column(path: Path, number_T: np.ndarray) -> list[int] | None:
    """The same of a table's column; None where it does not tell the number of every frame."""
    if not np.isfinite(number_T).all():
        return None
    return frame_numbers_in(path, [f"{number:.0f}" for number in number_T])


def in_order(path: Path, named: Sequence[tuple[str, Frame]]) -> list[tuple[int, Frame]]:
    """Frames with their numbers, in order, of a file that has them by name.

    Raises:
        UserError: as for `frame_numbers`; names the file.
    """
    numbers = frame_numbers_in(path, [name for name, _ in named])
    return [(numbers[place], named[place][1]) for place in sorted(range(len(named)), key=numbers.__getitem__)]


def _risen(groups: Sequence[tuple[int, ...]]) -> list[int]:
    """Numbers of frames whose names hold these, in order."""
    steps = [1] * (len(groups) - 1)
    if len({len(group) for group in groups}) == 1:
        rows = [[after - before for before, after in pairwise(row)] for row in zip(*groups, strict=True)]
        rising = [row for row in reversed(rows) if min(row) > 0]
        counted = next((row for row in rising if min(row) == math.gcd(*row)), None)
        if counted is not None:
            steps = [step // min(counted) for step in counted]
        elif rising:
            usual = statistics.median_low(rising[0])
            steps = [max(1, round(step / usual)) for step in rising[0]]
    numbers = [0]
    for step in steps:
        numbers.append(numbers[-1] + step)
    return numbers
