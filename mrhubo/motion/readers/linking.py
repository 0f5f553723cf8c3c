"""Who is who from frame to frame, in files that tell where people are in each frame, but not which of them is which.

In each frame, the people of before are given to those who are seen now so that the ways from one place to the next are
shortest in all (H. W. Kuhn, "The Hungarian method for the assignment problem", 1955); who is too far from all is new.

Legend: N people in a frame, D numbers of a place.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from mrhubo.errors import UserError
from mrhubo.files.regular import naming

_MOST = 100
"""People in a frame."""
_LOST = 30
"""Frames after which somebody who is not seen is given up: a second or so."""
LINKED = "the file does not say who is who: people were followed from frame to frame by where they are"
"""What to say of them."""


def link(places: Sequence[np.ndarray], reach: float) -> list[list[int]]:
    """The number of each person in each frame, by where they are; people are counted as they come.

    Args:
        places: where the people of each frame are, (N, D).
        reach: how far anybody gets from one frame to the next in which they are seen.

    Raises:
        UserError: there are more than a hundred people in a frame.
    """
    last: dict[int, tuple[int, np.ndarray]] = {}
    numbers: list[list[int]] = []
    people = 0
    for frame, place_ND in enumerate(places):
        if len(place_ND) > _MOST:
            raise UserError(f"frame {frame} has {len(place_ND):,} people; at most {_MOST} are followed")
        known = [number for number, (seen, _) in last.items() if frame - seen <= _LOST]
        found = [-1] * len(place_ND)
        if known and len(place_ND):
            before_MD = np.stack([last[number][1] for number in known])
            way_MN = np.linalg.norm(before_MD[:, None] - place_ND[None], axis=-1)
            way_MN = np.where(np.isfinite(way_MN), np.minimum(way_MN, 2 * reach), 2 * reach)
            for row, column in zip(*linear_sum_assignment(way_MN), strict=True):
                if way_MN[row, column] <= reach:
                    found[column] = known[row]
        for column, number in enumerate(found):
            if number < 0:
                found[column], people = people, people + 1
            last[found[column]] = frame, place_ND[column]
        numbers.append(found)
    return numbers


def link_in(path: Path, places: Sequence[np.ndarray], reach: float) -> list[list[int]]:
    """The same; what is wrong is said of a file."""
    with naming(path):
        return link(places, reach)
