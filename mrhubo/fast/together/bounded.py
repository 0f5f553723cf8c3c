"""The minimum of a motion's quadratic model inside the limits of joints and of their steps.

    min  x^T A x / 2 - b^T x       lower <= x_t <= upper,   shortest <= x_t - x_(t-1) <= longest

x are the joints' moves in all frames, and A couples each frame with the next ones alone. Mehrotra's primal-dual method
("On the implementation of a primal-dual interior point method", 1992): each of its systems has the band of A, so it
takes a time proportional to the frames.

Legend: T frames, X = T - 1 steps between them, M joints, K = 2 sides of a bound, lower and upper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.together.banded import Banded, Factor, Solve

_ITERATIONS = 30
_GAP = 1e-5
"""Mean product of a bound's slack [rad] and its multiplier at which the minimum is near enough."""
_APART = 0.995
"""How much of the way to the nearest bound a step of the method goes at most."""
_SLACK = 0.05
"""Least slack [rad] to begin with."""
_GIVE = 1e-6
"""How far a bound gives way [rad] for each unit of its multiplier: so there is a minimum, too, where bounds leave no
room between them (a joint that must run all the way from one settled frame to another)."""


@dataclass(frozen=True)
class Bounds:
    """What moves (T, M) [rad] are bounded by."""

    move_KTM: np.ndarray
    """Lower and upper bound of each move [rad]."""
    step_KXM: np.ndarray
    """The same of the differences of moves."""
    free_T: np.ndarray
    """1 in frames that move, 0 in those that stay."""
    counts_X: np.ndarray
    """1 where the bounds of differences count, 0 where they do not."""

    @property
    def upper(self) -> np.ndarray:
        """Upper bounds of `apply`."""
        (low, high), (short, long) = self.move_KTM, self.step_KXM
        return np.concatenate([-low.ravel(), high.ravel(), -short.ravel(), long.ravel()])

    def apply(self, x_TM: np.ndarray) -> np.ndarray:
        """All that is bounded from above, one after the other."""
        step_XM = self.counts_X[:, None] * np.diff(x_TM, axis=0)
        return np.concatenate([-x_TM.ravel(), x_TM.ravel(), -step_XM.ravel(), step_XM.ravel()])

    def transposed(self, y: np.ndarray) -> np.ndarray:
        """The transpose of `apply`, for frames that move (T, M)."""
        (low, high), (short, long) = self._parted(y)
        return self.free_T[:, None] * (high - low + _spread(long - short, -1.0))

    def stiffness(self, stiff: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The transpose of `apply`, times a diagonal matrix, times `apply`: its diagonal (T, M), and its entries
        between a frame and the next (X, M).
        """
        move_KTM, step_KXM = self._parted(stiff)
        step_XM, free_T1 = step_KXM.sum(0), self.free_T[:, None]
        return free_T1 * (move_KTM.sum(0) + _spread(step_XM, 1.0)), -step_XM * free_T1[1:] * free_T1[:-1]

    def _parted(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        move, step = y[: self.move_KTM.size], y[self.move_KTM.size :]
        return move.reshape(self.move_KTM.shape), step.reshape(self.step_KXM.shape) * self.counts_X[:, None]


@dataclass(frozen=True)
class _System:
    """The linear system of one iteration."""

    bounds: Bounds
    solve: Solve
    slope_TM: np.ndarray
    """Derivative of the Lagrangian by the moves."""
    lack: np.ndarray
    """What bounds and slacks differ by."""
    slack: np.ndarray
    dual: np.ndarray

    def direction(self, product: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Changes of moves, slacks and multipliers that bring slack * dual down by `product`, slope and lack to 0."""
        soft = self.slack + _GIVE * self.dual
        push = (self.dual * self.lack - product) / soft
        dx_TM = self.solve(-self.slope_TM - self.bounds.transposed(push))
        moved = self.bounds.apply(dx_TM)
        d_dual = push + self.dual / soft * moved
        return dx_TM, _GIVE * d_dual - self.lack - moved, d_dual


def bounded_minimum(matrix: Banded, right_TM: np.ndarray, bounds: Bounds, factor: Factor) -> np.ndarray:
    """The moves (T, M) [rad].

    Args:
        matrix: A; its rows of frames that stay are those of the identity.
        right_TM: b; 0 in frames that stay.
        factor: solves systems of the band of A.
        bounds: kept to but for millionths.
    """
    x_TM, upper = np.zeros_like(right_TM), bounds.upper
    slack = np.maximum(upper, _SLACK)
    dual = (10 * np.abs(right_TM).max() + 1e-3) * slack.mean() / slack
    for _ in range(_ITERATIONS):
        gap, lack = float((slack * dual).mean()), bounds.apply(x_TM) + slack - _GIVE * dual - upper
        if gap < _GAP and np.abs(lack).max() < _GAP:
            break
        slope_TM = matrix.times(x_TM) - right_TM + bounds.transposed(dual)
        solve = factor(matrix.plus(*bounds.stiffness(dual / (slack + _GIVE * dual))))
        system = _System(bounds, solve, slope_TM, lack, slack, dual)
        _, d_slack, d_dual = system.direction(slack * dual)
        length = min(_reach(slack, d_slack), _reach(dual, d_dual))
        centre = float(((slack + length * d_slack) * (dual + length * d_dual)).mean())
        product = slack * dual + d_slack * d_dual - gap * (centre / gap) ** 3
        dx_TM, d_slack, d_dual = system.direction(product)
        length = min(1.0, _APART * min(_reach(slack, d_slack), _reach(dual, d_dual)))
        x_TM, slack, dual = x_TM + length * dx_TM, slack + length * d_slack, dual + length * d_dual
    return x_TM


def _reach(value: np.ndarray, change: np.ndarray) -> float:
    """How much of a change, at most all of it, keeps everything positive."""
    falls = change < 0
    return min(1.0, float((-value[falls] / change[falls]).min())) if falls.any() else 1.0


def _spread(step_XM: np.ndarray, sign: float) -> np.ndarray:
    """(T, M): what belongs to the step to each frame, plus `sign` times what belongs to the one from it."""
    return np.pad(step_XM, ((1, 0), (0, 0))) + sign * np.pad(step_XM, ((0, 1), (0, 0)))
