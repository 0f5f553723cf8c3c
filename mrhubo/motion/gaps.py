"""What is not known in some frames, from the frames around in which it is.

Between two frames in which a value is known it goes from one to the other at an even rate; before the first and after
the last it stays.

Legend: T frames, X any further axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.plain.human import normalize
from mrhubo.fast.rotations import slerp


@dataclass(frozen=True)
class Neighbours:
    """The nearest frames in which a value is known, before and after each frame; a known frame is its own."""

    before_T: np.ndarray
    after_T: np.ndarray
    share_T: np.ndarray
    """How far between the two, 0 to 1, float64."""

    @classmethod
    def of(cls, known_T: np.ndarray) -> Neighbours:
        """For frames (T,) of bool, of which at least one is known."""
        frames, place_T = len(known_T), np.arange(len(known_T))
        before_T = np.maximum.accumulate(np.where(known_T, place_T, -1))
        after_T = np.minimum.accumulate(np.where(known_T, place_T, frames)[::-1])[::-1]
        before_T, after_T = np.where(before_T < 0, after_T, before_T), np.where(after_T == frames, before_T, after_T)
        share_T = (place_T - before_T) / np.maximum(after_T - before_T, 1)
        return cls(before_T, after_T, np.clip(share_T, 0.0, 1.0))


def fill_numbers(value_TX: np.ndarray, known_T: np.ndarray) -> np.ndarray:
    """Numbers (T, ...) on the straight line between known ones; NaN throughout where none is known."""
    if known_T.all():
        return value_TX
    if not known_T.any():
        return np.full_like(value_TX, np.nan)
    near = Neighbours.of(known_T)
    first, second = value_TX[near.before_T], value_TX[near.after_T]
    share_TX = near.share_T.astype(value_TX.dtype).reshape(-1, *[1] * (value_TX.ndim - 1))
    return np.where(known_T.reshape(share_TX.shape), value_TX, first + share_TX * (second - first))


def fill_directions(direction_T3: np.ndarray, known_T: np.ndarray) -> np.ndarray:
    """Unit vectors (T, 3); between two that are opposite, the first stays for half of the way."""
    filled_T3 = normalize(fill_numbers(direction_T3, known_T))
    return np.where(known_T[:, None], direction_T3, filled_T3)


def fill_rotations(rotation_T33: np.ndarray, known_T: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) on the shortest way between known ones; the identity throughout where none is known."""
    if known_T.all():
        return rotation_T33
    if not known_T.any():
        return np.broadcast_to(np.eye(3, dtype=rotation_T33.dtype), rotation_T33.shape).copy()
    near = Neighbours.of(known_T)
    return slerp(rotation_T33[near.before_T], rotation_T33[near.after_T], near.share_T)
