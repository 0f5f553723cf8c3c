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
_GAP = 1e-6
"""Mean product of a bound's slack [rad] and its multiplier at which the minimum is near enough."""
_APART = 0.995
"""How much of the way to the nearest bound a step of the method goes at most."""
_SLACK = 0.05
"""Least slack [rad] to begin with."""


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


def bounded_minimum(
    matrix: Banded,
    right_TM: np.ndarray,
    move_KTM: np.ndarray,
    step_KXM: np.ndarray,
    free_T: np.ndarray,
    bounded_X: np.ndarray,
) -> np.ndarray:
    """The moves (T, M) [rad].

    Args:
        matrix: A; its rows of frames that stay are those of the identity.
        right_TM: b; 0 in frames that stay.
        move_KTM: lower and upper bound of each move [rad].
        step_KXM: the same of the differences of moves.
        free_T: 1 in frames that move, 0 in those that stay.
        bounded_X: 1 where the bounds of differences count, 0 where they do not.
    """
    x_TM, free_T1, bounded_X1 = np.zeros_like(right_TM), free_T[:, None], bounded_X[:, None]
    sizes = (move_KTM.size, step_KXM.size)

    def apply(x_TM: np.ndarray) -> np.ndarray:
        """All that is bounded from above, one after the other."""
        step_XM = bounded_X1 * np.diff(x_TM, axis=0)
        return np.concatenate([(-x_TM).ravel(), x_TM.ravel(), (-step_XM).ravel(), step_XM.ravel()])

    def transposed(y: np.ndarray) -> np.ndarray:
        move, step = y[: sizes[0]].reshape(move_KTM.shape), y[sizes[0] :].reshape(step_KXM.shape)
        return free_T1 * (move[1] - move[0] + _spread(bounded_X1 * (step[1] - step[0])))

    upper = np.concatenate([-move_KTM[0].ravel(), move_KTM[1].ravel(), -step_KXM[0].ravel(), step_KXM[1].ravel()])
    slack = np.maximum(upper, _SLACK)
    dual = (np.abs(right_TM).mean() + 1e-3) * slack.mean() / slack
    for _ in range(_ITERATIONS):
        gap = float(slack @ dual) / len(slack)
        lack = apply(x_TM) + slack - upper
        if gap < _GAP and np.abs(lack).max() < _GAP:
            break
        slope_TM = matrix.times(x_TM) - right_TM + transposed(dual)
        stiff = dual / slack
        move, step = stiff[: sizes[0]].reshape(move_KTM.shape).sum(0), stiff[sizes[0] :].reshape(step_KXM.shape).sum(0)
        step = bounded_X1 * step
        factor = matrix.factor(free_T1 * (move + _neighbours(step)), -step * free_T1[1:] * free_T1[:-1])

        def direction(product: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            """Changes of x, slacks and multipliers that bring their products to 0 where it is slack * dual."""
            dx_TM = solve_factored(factor, -slope_TM - transposed((dual * lack - product) / slack))
            d_slack = -lack - apply(dx_TM)
            return dx_TM, d_slack, (-product - dual * d_slack) / slack

        _, d_slack, d_dual = direction(slack * dual)
        reach = min(_reach(slack, d_slack), _reach(dual, d_dual))
        centre = float((slack + reach * d_slack) @ (dual + reach * d_dual)) / len(slack)
        dx_TM, d_slack, d_dual = direction(slack * dual + d_slack * d_dual - gap * (centre / gap) ** 3)
        length = min(1.0, _APART * min(_reach(slack, d_slack), _reach(dual, d_dual)))
        x_TM, slack, dual = x_TM + length * dx_TM, slack + length * d_slack, dual + length * d_dual
    return x_TM


def _reach(value: np.ndarray, change: np.ndarray) -> float:
    """How much of a change, at most all of it, keeps everything positive."""
    falls = change < 0
    return min(1.0, float((-value[falls] / change[falls]).min())) if falls.any() else 1.0


def _spread(step_XM: np.ndarray) -> np.ndarray:
    """The transpose of taking differences."""
    return np.pad(step_XM, ((1, 0), (0, 0))) - np.pad(step_XM, ((0, 1), (0, 0)))


def _neighbours(step_XM: np.ndarray) -> np.ndarray:
    """The sum of what belongs to the steps before and after each frame."""
    return np.pad(step_XM, ((1, 0), (0, 0))) + np.pad(step_XM, ((0, 1), (0, 0)))
