"""The minimum of a motion's quadratic model inside the limits of joints and of their steps.

    min  x^T A x / 2 - b^T x       lower <= x_t <= upper,   shortest <= x_t - x_(t-1) <= longest

x are the joints' moves in all frames, and A couples each frame with the next ones alone. Where limits of joints alone
hold moves, and where few steps are held, `by_active_set` finds it. Elsewhere Mehrotra's primal-dual method ("On the
implementation of a primal-dual interior point method", 1992): each system of either has the band of A, so they take a
time proportional to the frames.

Legend: T frames, M joints, K sides of bounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.together.active_set import GIVE, by_active_set
from mrhubo.fast.together.banded import Banded, Factor, Solve
from mrhubo.fast.together.bounds import Bounds

_ITERATIONS = 30
_GAP = 1e-8
"""Mean product of a bound's slack [rad] and its multiplier at which the minimum is near enough. Times the bounds, which
are many, it is what the model may still cost more than there."""
_APART = 0.995
"""How much of the way to the nearest bound a step of the method goes at most."""
_SLACK = 0.05
"""Least slack [rad] to begin with."""


@dataclass(frozen=True)
class _System:
    """The linear system of one iteration."""

    bounds: Bounds
    solve: Solve
    slope_TM: np.ndarray
    """Derivative of the Lagrangian by the moves."""
    lack_KTM: np.ndarray
    """What bounds and slacks differ by."""
    slack_KTM: np.ndarray
    dual_KTM: np.ndarray

    def direction(self, product_KTM: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Changes of moves, slacks and multipliers that bring slack * dual down by the product, slope and lack to 0."""
        soft_KTM = self.slack_KTM + GIVE * self.dual_KTM
        push_KTM = (self.dual_KTM * self.lack_KTM - product_KTM) / soft_KTM
        dx_TM = self.solve(-self.slope_TM - self.bounds.transposed(push_KTM))
        moved_KTM = self.bounds.apply(dx_TM)
        d_dual_KTM = push_KTM + self.dual_KTM / soft_KTM * moved_KTM
        return dx_TM, GIVE * d_dual_KTM - self.lack_KTM - moved_KTM, d_dual_KTM


def bounded_minimum(matrix: Banded, right_TM: np.ndarray, bounds: Bounds, factor: Factor) -> np.ndarray:
    """The moves (T, M) [rad]. Without bounds of steps they may be a little beyond the minimum, and beyond bounds, where
    many of these change at a time: whoever makes several such steps cuts them there.

    Args:
        matrix: A; its rows of frames that stay are those of the identity.
        right_TM: b; 0 in frames that stay.
        bounds: kept to but for millionths.
        factor: solves systems of the band of A.
    """
    x_TM, is_minimum = by_active_set(matrix, right_TM, bounds, factor)
    return x_TM if is_minimum or not bounds.of_steps else _from_inside(matrix, right_TM, bounds, factor)


def _from_inside(matrix: Banded, right_TM: np.ndarray, bounds: Bounds, factor: Factor) -> np.ndarray:
    """The same by Mehrotra's method."""
    x_TM, upper_KTM = np.zeros_like(right_TM), bounds.upper_KTM
    slack_KTM = np.maximum(upper_KTM, _SLACK)
    dual_KTM = (10 * np.abs(right_TM).max() + 1e-3) * slack_KTM.mean() / slack_KTM
    for _ in range(_ITERATIONS):
        gap = float((slack_KTM * dual_KTM).mean())
        lack_KTM = bounds.apply(x_TM) + slack_KTM - GIVE * dual_KTM - upper_KTM
        if gap < _GAP and np.abs(lack_KTM).max() < _GAP:
            break
        slope_TM = matrix.times(x_TM) - right_TM + bounds.transposed(dual_KTM)
        solve = factor(matrix.plus(*bounds.stiffness(dual_KTM / (slack_KTM + GIVE * dual_KTM))))
        system = _System(bounds, solve, slope_TM, lack_KTM, slack_KTM, dual_KTM)
        _, d_slack_KTM, d_dual_KTM = system.direction(slack_KTM * dual_KTM)
        length = min(_reach(slack_KTM, d_slack_KTM), _reach(dual_KTM, d_dual_KTM))
        centre = float(((slack_KTM + length * d_slack_KTM) * (dual_KTM + length * d_dual_KTM)).mean())
        product_KTM = slack_KTM * dual_KTM + d_slack_KTM * d_dual_KTM - gap * (centre / gap) ** 3
        dx_TM, d_slack_KTM, d_dual_KTM = system.direction(product_KTM)
        length = min(1.0, _APART * min(_reach(slack_KTM, d_slack_KTM), _reach(dual_KTM, d_dual_KTM)))
        x_TM = x_TM + length * dx_TM
        slack_KTM, dual_KTM = slack_KTM + length * d_slack_KTM, dual_KTM + length * d_dual_KTM
    return x_TM


def _reach(value: np.ndarray, change: np.ndarray) -> float:
    """How much of a change, at most all of it, keeps everything positive."""
    fall = -float((change / value).min())
    return 1.0 if fall <= 1 else 1 / fall
