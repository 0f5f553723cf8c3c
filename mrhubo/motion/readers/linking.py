"""Who is who from frame to frame, in files that tell where people are in each frame, but not which of them is which.

In each frame, the people of before are given to those who are seen now so that the ways from one place to the next are
shortest in all (H. W. Kuhn, "The Hungarian method for the assignment problem", 1955); who is too far from all is new.

Legend: N people in a frame, M people of before, K points of each, D numbers of a place.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.regular import naming

_MOST = 100
"""People in a frame."""
_LOST = 30
"""Frames after which somebody who is not seen is given up: a second or so."""
_REMEMBERED = 3 * _MOST
"""People who may come back at most; whoever was seen last is remembered first."""
LINKED = "the file does not say who is who: people were followed from frame to frame by where they are"
"""What to say of them."""


def link(places: Sequence[np.ndarray], reach: float, frames: Sequence[float] | None = None) -> list[list[int]]:
    """The number of each person in each frame, by where they are; people are counted as they come.

    Args:
        places: where the people of each frame are: (N, D), or (N, K, D) by points, NaN where one is not known. The way
            between two people is the mean one of the points that are known of both.
        reach: how far anybody gets from one frame to the next in which they are seen.
        frames: the number of each frame, rising; default: 0, 1, 2, ...

    Raises:
        UserError: there are more than a hundred people in a frame.
    """
    from scipy.optimize import linear_sum_assignment  # takes longer to import than most files to read

    last: dict[int, tuple[float, np.ndarray]] = {}
    numbers: list[list[int]] = []
    people = 0
    for frame, place_NX in zip(range(len(places)) if frames is None else frames, places, strict=True):
        if len(place_NX) > _MOST:
            raise UserError(f"frame {frame:g} has {len(place_NX):,} people; at most {_MOST} are followed")
        # those who were seen last are at the end
        last = {number: seen for number, seen in list(last.items())[-_REMEMBERED:] if frame - seen[0] <= _LOST}
        known = list(last)
        found = [-1] * len(place_NX)
        if known and len(place_NX):
            way_MN = _ways(np.stack([place_X for _, place_X in last.values()]), place_NX)
            way_MN = np.where(np.isfinite(way_MN), np.minimum(way_MN, 2 * reach), 2 * reach)
            for row, column in zip(*linear_sum_assignment(way_MN), strict=True):
                if way_MN[row, column] <= reach:
                    found[column] = known[row]
        for column, number in enumerate(found):
            if number < 0:
                found[column], people = people, people + 1
            last.pop(found[column], None)
            last[found[column]] = frame, place_NX[column]
        numbers.append(found)
    return numbers


def link_in(
    path: Path, places: Sequence[np.ndarray], reach: float, frames: Sequence[float] | None = None
) -> list[list[int]]:
    """The same of all people in a file; where never more than one is seen in a frame, that is one person, however long
    they are away or far they get: there is nobody to mistake them for. What is wrong is said of the file.
    """
    if max(map(len, places), default=0) <= 1:
        return [[0] * len(place_NX) for place_NX in places]
    with naming(path):
        return link(places, reach, frames)


@np.errstate(over="ignore", invalid="ignore")
def _ways(before_MX: np.ndarray, place_NX: np.ndarray) -> np.ndarray:
    """How far (M, N) it is from each person of before to each of now; infinite where no point of both is known."""
    before_MKD, place_NKD = (x[:, None] if x.ndim == 2 else x for x in (before_MX, place_NX))
    way_MNK = np.linalg.norm(before_MKD[:, None] - place_NKD[None], axis=-1)
    known_MNK = np.isfinite(way_MNK)
    count_MN = known_MNK.sum(-1)
    total_MN = np.where(known_MNK, way_MNK, 0.0).sum(-1)
    return np.where(count_MN > 0, total_MN / np.maximum(count_MN, 1), np.inf)
