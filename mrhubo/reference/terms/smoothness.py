"""The terms of a motion's cost that couple frames: joints move slowly and evenly.

    pull * sum_t |q_t - q_(t-1)|^2                                          velocity
    sum_t jerk_t * |q_t - 3 q_(t-1) + 3 q_(t-2) - q_(t-3)|^2                its second derivative in time

Whatever a term costs in several frames, each of them bears the same share of it.

Legend: T frames, X steps between them, Y = T - 3 differences of third order, N joints, C blocks.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass

import torch
from torch import Tensor

_THIRD = (-1.0, 3.0, -3.0, 1.0)


@dataclass(frozen=True)
class Smoothness:
    """The terms above."""

    pull: float
    """[1/rad^2]."""
    jerk_YN: Tensor | None = None
    """[1/rad^2]; None: it costs nothing."""

    @property
    def reach(self) -> int:
        """How many frames before it a frame is coupled to."""
        return 1 if self.jerk_YN is None else 3

    def at(self, frame_X: Tensor) -> Smoothness:
        """The same for some frames alone (X,), by their numbers."""
        return self if self.jerk_YN is None else Smoothness(self.pull, self.jerk_YN[frame_X[3:] - 3])

    def costs(self, q_TN: Tensor, joints_NC: Tensor) -> Tensor:
        """What each frame bears (T, C), for joint angles (T, N) [rad]."""
        cost_TN = _shared(self.pull * q_TN.diff(dim=0).square(), 1)
        if self.jerk_YN is not None and len(self.jerk_YN):
            cost_TN = cost_TN + _shared(self.jerk_YN * q_TN.diff(n=3, dim=0).square(), 3)
        return cost_TN @ joints_NC.to(q_TN)

    def gradient(self, q_TN: Tensor) -> Tensor:
        """Half of the gradient (T, N)."""
        gradient_TN = _spread(self.pull * q_TN.diff(dim=0), (-1.0, 1.0))
        if self.jerk_YN is not None and len(self.jerk_YN):
            gradient_TN = gradient_TN + _spread(self.jerk_YN * q_TN.diff(n=3, dim=0), _THIRD)
        return gradient_TN

    def hessian(self, q_TN: Tensor) -> list[Tensor]:
        """Half of the Hessian: its diagonal (T, N), then its entries between each frame and the next (T - 1, N), the
        one after that (T - 2, N), and so on.
        """
        bands = _bands(torch.full_like(q_TN[1:], self.pull), (-1.0, 1.0))
        if self.jerk_YN is not None and len(self.jerk_YN):
            more = _bands(self.jerk_YN, _THIRD)
            bands = [bands[0] + more[0], bands[1] + more[1], *more[2:]]
        return bands


def _shared(cost_XN: Tensor, order: int) -> Tensor:
    """Each frame's share (T, N) of what differences of some order (T - order, N) cost."""
    padded = torch.nn.functional.pad(cost_XN / (order + 1), (0, 0, order, order))
    return padded.unfold(0, order + 1, 1).sum(-1)


def _spread(force_XN: Tensor, row: tuple[float, ...]) -> Tensor:
    """The transpose of taking differences: (T, N) of (X, N), each with the coefficients of `row` in its frames."""
    order = len(row) - 1
    return _sum(torch.nn.functional.pad(c * force_XN, (0, 0, i, order - i)) for i, c in enumerate(row))


def _bands(weight_XN: Tensor, row: tuple[float, ...]) -> list[Tensor]:
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
