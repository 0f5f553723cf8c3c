"""Differences in time of what a motion's frames have, and what costs by them add to gradients and Hessians.

Legend: T frames, X differences of some order, N of whatever a frame has.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable

import torch
from torch import Tensor

from mrhubo.fast.together.differences import FIRST, THIRD

__all__ = ["FIRST", "THIRD", "bands", "share", "spread"]


def share(cost_XN: Tensor, order: int) -> Tensor:
    """Each frame's share (T, N) of what differences of some order (T - order, N) cost: each frame of one bears the
    same.
    """
    padded = torch.nn.functional.pad(cost_XN / (order + 1), (0, 0, order, order))
    return padded.unfold(0, order + 1, 1).sum(-1)


def spread(force_XN: Tensor, row: tuple[float, ...]) -> Tensor:
    """The transpose of taking differences: (T, N) of (X, N), each with the coefficients of `row` in its frames."""
    order = len(row) - 1
    return _sum(torch.nn.functional.pad(c * force_XN, (0, 0, i, order - i)) for i, c in enumerate(row))


def bands(weight_XN: Tensor, row: tuple[float, ...]) -> list[Tensor]:
    """The diagonals of the differences' matrix D in D^T diag(weight) D."""
    order = len(row) - 1
    return [
        _sum(
            torch.nn.functional.pad(row[i] * row[i + lag] * weight_XN, (0, 0, i, order - lag - i))
            for i in range(order - lag + 1)
        )
        for lag in range(order + 1)
    ]


def _sum(parts: Iterable[Tensor]) -> Tensor:
    return functools.reduce(torch.add, parts)
