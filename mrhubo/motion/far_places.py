"""Places of a root as a motion keeps them: in single precision, near enough to the origin, all of them known.

Surveyors' coordinates (UTM) are millions of metres from their origin, where single precision has steps of half a metre.

Legend: T frames.
"""

from __future__ import annotations

import numpy as np

from mrhubo.motion.gaps import fill_numbers

FARTHEST = 1e5
"""No root goes that far, in metres or whatever smaller unit a file has."""
_FAR = 2e4
"""From that distance from the origin on, single precision has steps of 2 mm."""
_LOST = 1e8
"""Numbers beyond are no places."""
_MOSTLY = 0.5
"""Share of the frames in which a place is known, of a root that is."""


def kept_places(place_T3: np.ndarray, where: str, notes: list[str]) -> np.ndarray | None:
    """Places (T, 3) of a root, float32; None, and a note, where they cannot be used.

    Frames in which they are NaN, infinite or beyond all bounds are filled in, if they are few; a root that is far from
    the origin is moved towards it by as much as its first place is away, each axis by itself. Notes say so.

    Args:
        place_T3: as a file has them.
        where: what the file calls them, for the beginning of a sentence.
        notes: is told what was done.
    """
    place_T3 = place_T3.astype(np.float64)
    known_T = np.asarray((np.abs(np.nan_to_num(place_T3, nan=np.inf)) < _LOST).all(axis=1))
    if not known_T.mean() > _MOSTLY:
        notes.append(f"{where} is left out: it holds NaN, infinite numbers, or some beyond {_LOST:g}")
        return None
    if not known_T.all():
        place_T3 = fill_numbers(np.where(known_T[:, None], place_T3, 0.0), known_T)
        missing, frames = int((~known_T).sum()), len(known_T)
        notes.append(f"{where} is not known in {missing:,} of {frames:,} frames: filled in")
    away_3 = np.where(np.abs(place_T3).max(axis=0) > _FAR, np.round(place_T3[0]), 0.0)
    place_T3 = place_T3 - away_3
    if not (np.abs(place_T3) <= FARTHEST).all():
        notes.append(f"{where} is left out: it goes farther than {FARTHEST:g}")
        return None
    if away_3.any():
        by = ", ".join(f"{number:,.0f}" for number in away_3)
        notes.append(f"{where} is far from the origin: moved towards it by ({by}), as the file counts")
    return place_T3.astype(np.float32)


def compact(number_X: np.ndarray) -> np.ndarray:
    """Numbers as float32; as they are, where some are so far from 0 that small steps of them would be lost."""
    return number_X if (np.abs(number_X) > _FAR).any() else number_X.astype(np.float32)
