"""Weights of 16 bits: each row of a layer in whole steps, of a power of two of its own.

A frame's answer takes as long as its weights take to be read, so half of their size counts. A step is a power of two,
so whoever has rounded weights once loses nothing when they become 16 bits, or numbers again: every form of the run-time
path answers with the same ones.
"""

from __future__ import annotations

import numpy as np

_MOST = 32_767
"""The largest number of 16 bits."""
_LEAST = np.float32(1e-30)
"""A row of smaller weights than that has none."""


def shortened(weight_OE: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole steps (O, E), int16, and what a step is (O,), float32, of the weights (O, E) of a layer. They differ by
    half a step at most, 1 / 32,768 of their row's largest.
    """
    largest_O = np.abs(weight_OE).max(axis=1, initial=_LEAST).astype(np.float64) / _MOST
    share_O, power_O = np.frexp(largest_O)
    step_O = np.ldexp(np.float32(1), power_O - (share_O == 0.5)).astype(np.float32)
    return np.rint(weight_OE / step_O[:, None]).astype(np.int16), step_O


def rounded(weight_OE: np.ndarray) -> np.ndarray:
    """The nearest weights, float32, that are such steps."""
    steps_OE, step_O = shortened(weight_OE)
    return steps_OE * step_O[:, None]


def are_short(weight_OE: np.ndarray) -> bool:
    """Whether weights are what `rounded` leaves."""
    return bool(np.array_equal(rounded(weight_OE), weight_OE))
