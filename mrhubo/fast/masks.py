"""Frames in a mask over time (T,)."""

from __future__ import annotations

import numpy as np


def stretches(mask_T: np.ndarray) -> list[slice]:
    """The runs of frames in a mask (T,)."""
    ends_X = np.flatnonzero(np.diff(mask_T.astype(np.int8), prepend=0, append=0))
    return [slice(int(start), int(stop)) for start, stop in ends_X.reshape(-1, 2)]


def widen(mask_T: np.ndarray, frames: int) -> np.ndarray:
    """Frames (T,) that are so many or fewer away from one in the mask."""
    total_X = np.concatenate(([0], mask_T.cumsum()))
    place_T = np.arange(len(mask_T))
    return total_X[np.minimum(place_T + frames + 1, len(mask_T))] > total_X[np.maximum(place_T - frames, 0)]
