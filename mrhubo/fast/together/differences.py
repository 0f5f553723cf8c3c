"""Differences in time of what a motion's frames have, and what costs by them add to gradients and Hessians.

Legend: T frames, X differences of some order, N of whatever a frame has.
"""

from __future__ import annotations

import numpy as np

FIRST, THIRD = (-1.0, 1.0), (-1.0, 3.0, -3.0, 1.0)
"""Coefficients of differences, the earliest frame's first."""


def share(cost_XN: np.ndarray, order: int) -> np.ndarray:
    """Each frame's share (T, N) of what differences of some order cost: each frame of one bears the same."""
    return spread(cost_XN / (order + 1), (1.0,) * (order + 1))


def spread(force_XN: np.ndarray, row: tuple[float, ...]) -> np.ndarray:
    """The transpose of taking differences: (T, N) of (X, N), each with the coefficients of `row` in its frames."""
    frames = len(force_XN)
    found_TN = np.zeros((frames + len(row) - 1, force_XN.shape[1]))
    for i, c in enumerate(row):
        found_TN[i : i + frames] += c * force_XN
    return found_TN


def bands(weight_XN: np.ndarray, row: tuple[float, ...]) -> list[np.ndarray]:
    """The diagonals of the differences' matrix D in D^T diag(weight) D."""
    products = [[a * b for a, b in zip(row, row[lag:], strict=False)] for lag in range(len(row))]
    return [spread(weight_XN, tuple(coefficients)) for coefficients in products]
