"""The frame rate of files that tell the time of every frame in place of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrhubo.errors import UserError

_DIGITS = 17
"""Of a float64 that tell it apart from every other."""
_UNEVEN = 0.1
"""How far a step may be from the mean one, as a share of it: whole milliseconds at 120 frames a second are off by 8%, a
frame that was dropped by 100%."""


def find_rate(time_T: np.ndarray, clock: Callable[[np.ndarray, float], np.ndarray]) -> float | None:
    """Frames per second of evenly spaced times; None for fewer than two frames, which tell none.

    Of the rates whose times these are, the one with the fewest digits: what was written comes back.

    Args:
        time_T: times (T,), in the file's unit, from the first frame's on.
        clock: the times that frames (T,) have at a rate, in the same unit.

    Raises:
        UserError: the times do not rise, or not evenly.
    """
    if len(time_T) < 2:
        return None
    second = float(clock(np.array([1.0]), 1.0)[0])
    step_T = np.diff(time_T.astype(np.float64)) / second
    mean = float(step_T.mean())
    if not np.isfinite(step_T).all() or mean <= 0 or np.abs(step_T - mean).max() > _UNEVEN * mean:
        raise UserError("the times of its frames do not rise evenly; a robot motion has one frame rate")
    passed_T, frame_T = time_T - time_T[0], np.arange(len(time_T), dtype=np.float64)
    exact = (len(time_T) - 1) / (float(passed_T[-1]) / second)
    for digits in range(1, _DIGITS + 1):
        rate = float(f"{exact:.{digits}g}")
        if np.array_equal(clock(frame_T, rate), passed_T):
            return rate
    return exact


def seconds(frame_T: np.ndarray, rate: float) -> np.ndarray:
    """Times [s] of frames at a rate."""
    return frame_T / rate


def nanoseconds(frame_T: np.ndarray, rate: float) -> np.ndarray:
    """Times [ns] of frames at a rate, whole numbers."""
    return np.rint(frame_T * (1e9 / rate)).astype(np.int64)
