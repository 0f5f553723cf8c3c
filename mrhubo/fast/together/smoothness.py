"""The terms of a motion's cost that couple frames, as `mrhubo.reference.terms.smoothness` and `mrhubo.retargeter.clip`
have them, where the reasons stand.

Legend: T frames, Y = T - 3 differences of third order, X differences of some order, D directions, N joints, C blocks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.human import norm

REFERENCE_RATE = 24.0
"""Frames per second at which a smoothness is stated."""
SMOOTHNESS = 0.02
CUTOFF_HZ = 4.0
"""Where a calm human's frequencies end. An error of a limb weighs about |q|^2, its jerk (2 pi f)^6 |q|^2 as much, so a
motion at this frequency is followed by a half, one at half of it by 98%."""
CALM_JERK = 60.0
"""[1/s^3]: the highest jerk of one radian in one second along the smoothest path, 60 A / T^3 (T. Flash, N. Hogan, "The
coordination of arm movements", 1985). Far above it the weight falls with its square: the term costs no more."""
WINDOW_S = 0.2
"""Time over which the human's jerk is averaged."""
_VELOCITY, _THIRD = (-1.0, 1.0), (-1.0, 3.0, -3.0, 1.0)


def pull_at(smoothness: float, frame_rate: float) -> float:
    """`pull` [1/rad^2] at a frame rate: the same for the same velocity, with the reference rate as the unit of time."""
    return smoothness * (frame_rate / REFERENCE_RATE) ** 2


@dataclass(frozen=True)
class Smoothness:
    """pull * sum_t |q_t - q_(t-1)|^2  +  sum_t jerk_t * |third difference|^2"""

    pull: float
    """[1/rad^2]."""
    jerk_YN: np.ndarray
    """[1/rad^2]."""

    reach = 3
    """How many frames before it a frame is coupled to."""

    def at(self, frame_X: np.ndarray) -> Smoothness:
        """The same for some frames alone (X,), by their numbers."""
        return Smoothness(self.pull, self.jerk_YN[frame_X[3:] - 3])

    def costs(self, q_TN: np.ndarray, joints_NC: np.ndarray) -> np.ndarray:
        """What each frame bears (T, C), for joint angles (T, N) [rad]."""
        cost_TN = _spread(self.pull / 2 * np.diff(q_TN, axis=0) ** 2, (1.0, 1.0))
        if len(self.jerk_YN):
            cost_TN += _spread(self.jerk_YN / 4 * np.diff(q_TN, n=3, axis=0) ** 2, (1.0,) * 4)
        return cost_TN @ joints_NC

    def gradient(self, q_TN: np.ndarray) -> np.ndarray:
        """Half of the gradient (T, N)."""
        gradient_TN = _spread(self.pull * np.diff(q_TN, axis=0), _VELOCITY)
        if len(self.jerk_YN):
            gradient_TN += _spread(self.jerk_YN * np.diff(q_TN, n=3, axis=0), _THIRD)
        return gradient_TN

    def hessian(self, q_TN: np.ndarray) -> list[np.ndarray]:
        """Half of the Hessian: its diagonal (T, N), then its entries between each frame and the next (T - 1, N), the
        one after that (T - 2, N), and so on.
        """
        bands = _bands(np.full_like(q_TN[1:], self.pull), _VELOCITY)
        if len(self.jerk_YN):
            more = _bands(self.jerk_YN, _THIRD)
            bands = [bands[0] + more[0], bands[1] + more[1], *more[2:]]
        return bands


def jerk_weights(description: Description, target_TD3: np.ndarray, frame_rate: float) -> np.ndarray:
    """Weights (Y, N) [1/rad^2] of the squared third differences: less where the human directions (T, D, 3) that a
    joint's block turns jerk more.
    """
    cost, columns = description.cost, description.trust.measured
    jerk_YD = norm(np.diff(target_TD3[:, columns], n=3, axis=0)) * frame_rate**3
    weight_DC = (cost.directions_DC * cost.weight_D[:, None])[columns]
    jerk_YC = jerk_YD @ (weight_DC / np.maximum(weight_DC.sum(axis=0), 1e-9))
    jerk_YC = _averaged(jerk_YC, round(WINDOW_S / 2 * frame_rate))
    calm = (frame_rate / (math.tau * CUTOFF_HZ)) ** 6
    return (calm / (1 + (jerk_YC / CALM_JERK) ** 2))[:, cost.block_N]


def _averaged(value_YC: np.ndarray, half: int) -> np.ndarray:
    """Means over so many neighbours on either side, as far as there are."""
    total_XC = np.concatenate((np.zeros_like(value_YC[:1]), value_YC.cumsum(axis=0))) if len(value_YC) else value_YC
    place_Y = np.arange(len(value_YC))
    first_Y, last_Y = np.maximum(place_Y - half, 0), np.minimum(place_Y + half + 1, len(value_YC))
    return (total_XC[last_Y] - total_XC[first_Y]) / (last_Y - first_Y)[:, None]


def _spread(force_XN: np.ndarray, row: tuple[float, ...]) -> np.ndarray:
    """The transpose of taking differences: (T, N) of (X, N), each with the coefficients of `row` in its frames."""
    frames = len(force_XN)
    found_TN = np.zeros((frames + len(row) - 1, force_XN.shape[1]))
    for i, c in enumerate(row):
        found_TN[i : i + frames] += c * force_XN
    return found_TN


def _bands(weight_XN: np.ndarray, row: tuple[float, ...]) -> list[np.ndarray]:
    """The diagonals of the differences' matrix D in D^T diag(weight) D."""
    products = [[a * b for a, b in zip(row, row[lag:], strict=False)] for lag in range(len(row))]
    return [_spread(weight_XN, tuple(coefficients)) for coefficients in products]
