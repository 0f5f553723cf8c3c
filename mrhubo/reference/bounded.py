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
from scipy.linalg import cho_solve_banded, cholesky_banded

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
class Banded:
    """A symmetric positive definite matrix of T M rows, frame after frame."""

    within_TMM: np.ndarray
    """Entries between joints of one frame; its diagonal does not count."""
    diagonal_TM: np.ndarray
    couplings_TM: list[np.ndarray]
    """Entries between a joint and the same joint one, two ... frames later (T - 1, M), (T - 2, M) ..."""

    def factor(self, extra_TM: np.ndarray | float = 0.0, next_XM: np.ndarray | float = 0.0) -> np.ndarray:
        """Cholesky factor in lower banded form, with something added to the diagonal and to the first coupling."""
        frames, joints = self.diagonal_TM.shape
        # Row k holds the entries k below the diagonal; the next frame's same joint is `joints` below.
        banded = np.zeros((len(self.couplings_TM) * joints + 1, frames, joints))
        banded[0] = self.diagonal_TM + extra_TM
        for k in range(1, joints):
            banded[k, :, : joints - k] = np.diagonal(self.within_TMM, offset=-k, axis1=1, axis2=2)
        for lag, coupling_TM in enumerate(self.couplings_TM, start=1):
            banded[lag * joints, : frames - lag] = coupling_TM
        banded[joints, : frames - 1] += next_XM
        return cholesky_banded(banded.reshape(len(banded), -1), overwrite_ab=True, lower=True, check_finite=False)

    def times(self, x_TM: np.ndarray) -> np.ndarray:
        """The product (T, M) with moves (T, M)."""
        found_TM = self.diagonal_TM * x_TM
        lower_TMM = np.tril(self.within_TMM, -1)
        found_TM += np.einsum("tmn,tn->tm", lower_TMM, x_TM) + np.einsum("tnm,tn->tm", lower_TMM, x_TM)
        for lag, coupling_TM in enumerate(self.couplings_TM, start=1):
            found_TM[lag:] += coupling_TM * x_TM[:-lag]
            found_TM[:-lag] += coupling_TM * x_TM[lag:]
        return found_TM


def solve_factored(factor: np.ndarray, right_TM: np.ndarray) -> np.ndarray:
    """The solution (T, M) of a system, of whose matrix the factor is given."""
    return cho_solve_banded((factor, True), right_TM.ravel(), check_finite=False).reshape(right_TM.shape)


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
    factor: np.ndarray
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
        dx_TM = solve_factored(self.factor, -self.slope_TM - self.bounds.transposed(push))
        moved = self.bounds.apply(dx_TM)
        d_dual = push + self.dual / soft * moved
        return dx_TM, _GIVE * d_dual - self.lack - moved, d_dual


def bounded_minimum(matrix: Banded, right_TM: np.ndarray, bounds: Bounds) -> np.ndarray:
    """The moves (T, M) [rad].

    Args:
        matrix: A; its rows of frames that stay are those of the identity.
        right_TM: b; 0 in frames that stay.
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
        factor = matrix.factor(*bounds.stiffness(dual / (slack + _GIVE * dual)))
        system = _System(bounds, factor, slope_TM, lack, slack, dual)
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
