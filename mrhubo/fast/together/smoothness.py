"""The terms of a motion's cost that couple frames, as `mrhubo.reference.terms.smoothness` and `mrhubo.retargeter.clip`
have them, where the reasons stand.

Legend: T frames, Y = T - 3 differences of third order, X differences of some order, D directions, N joints, C blocks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.human import norm
from mrhubo.fast.together.differences import FIRST, THIRD, bands, share, spread
from mrhubo.fast.together.direction_jerk import DirectionJerk

REFERENCE_RATE = 24.0
"""Frames per second at which a smoothness is stated."""
SMOOTHNESS = 0.02
DIRECTIONS_HZ, JOINTS_HZ = 2.4, 6.0
"""Up to where what a robot's directions or joints do beyond the human's is left to it. An error of a limb weighs about
|q|^2, its jerk (2 pi f)^6 |q|^2 as much: of a motion at this frequency half is left, of one at half of it 98%."""
FOLLOWED = 0.8
"""How much of the human's jerk the robot's directions are to have: with 1, what the human does costs nothing, not even
a tremble; with 0, each of his quick motions costs."""
CALM_JERK = 60.0
"""[1/s^3]: the highest jerk of one radian in one second along the smoothest path, 60 A / T^3 (T. Flash, N. Hogan, "The
coordination of arm movements", 1985). Far above it the weight falls with its square: the term costs no more."""
WINDOW_S = 0.2
"""Time over which the human's jerk is averaged."""


def pull_at(smoothness: float, frame_rate: float) -> float:
    """`pull` [1/rad^2] at a frame rate: the same for the same velocity, with the reference rate as the unit of time."""
    return smoothness * (frame_rate / REFERENCE_RATE) ** 2


@dataclass(frozen=True)
class Smoothness:
    """pull * sum_t |q_t - q_(t-1)|^2  +  sum_t jerk_t * |third difference|^2, and the jerk of directions."""

    pull: float
    """[1/rad^2]."""
    jerk_YN: np.ndarray
    """[1/rad^2]."""
    directions: DirectionJerk | None
    """None: it costs nothing."""

    reach = 3
    """How many frames before it a frame is coupled to."""

    @property
    def of_joints(self) -> Smoothness:
        """The joints' terms alone."""
        return replace(self, directions=None)

    def at(self, frame_X: np.ndarray) -> Smoothness:
        """The same for some frames alone (X,), by their numbers."""
        directions = None if self.directions is None else self.directions.at(frame_X)
        return Smoothness(self.pull, self.jerk_YN[frame_X[3:] - 3], directions)

    def costs(self, q_TN: np.ndarray, joints_NC: np.ndarray) -> np.ndarray:
        """What each frame bears of the joints' terms (T, C), for joint angles (T, N) [rad]."""
        cost_TN = share(self.pull * np.diff(q_TN, axis=0) ** 2, 1)
        if len(self.jerk_YN):
            cost_TN += share(self.jerk_YN * np.diff(q_TN, n=3, axis=0) ** 2, 3)
        return cost_TN @ joints_NC

    def gradient(self, q_TN: np.ndarray) -> np.ndarray:
        """Half of their gradient (T, N)."""
        gradient_TN = spread(self.pull * np.diff(q_TN, axis=0), FIRST)
        if len(self.jerk_YN):
            gradient_TN += spread(self.jerk_YN * np.diff(q_TN, n=3, axis=0), THIRD)
        return gradient_TN

    def hessian(self, q_TN: np.ndarray) -> list[np.ndarray]:
        """Half of their Hessian: its diagonal (T, N), then its entries between each frame and the next (T - 1, N), the
        one after that (T - 2, N), and so on.
        """
        found = bands(np.full_like(q_TN[1:], self.pull), FIRST)
        if len(self.jerk_YN):
            more = bands(self.jerk_YN, THIRD)
            found = [found[0] + more[0], found[1] + more[1], *more[2:]]
        return found


def smoothness_of(description: Description, target_TD3: np.ndarray, frame_rate: float) -> Smoothness:
    """That of a motion, for human directions (T, D, 3)."""
    cost, calm_YC = description.cost, calmness(description, target_TD3, frame_rate)
    weight_D = cost.weight_D * np.isin(np.arange(len(cost.weight_D)), description.trust.measured)
    weight_YD = jerk_weight(DIRECTIONS_HZ, frame_rate) * calm_YC @ cost.directions_DC.T * weight_D
    directions = DirectionJerk(weight_YD, FOLLOWED * np.diff(target_TD3, n=3, axis=0))
    jerk_YN = jerk_weight(JOINTS_HZ, frame_rate) * calm_YC[:, cost.block_N]
    return Smoothness(pull_at(SMOOTHNESS, frame_rate), jerk_YN, directions)


def jerk_weight(frequency: float, frame_rate: float) -> float:
    """Weight [1/rad^2] of squared third differences with which half of a motion at a frequency [Hz] is left."""
    return (frame_rate / (math.tau * frequency)) ** 6


def calmness(description: Description, target_TD3: np.ndarray, frame_rate: float) -> np.ndarray:
    """Factor (Y, C) of these weights for each block, 1 or less: the less, the more the human directions (T, D, 3) jerk
    that the block turns.
    """
    cost, columns = description.cost, description.trust.measured
    jerk_YD = norm(np.diff(target_TD3[:, columns], n=3, axis=0)) * frame_rate**3
    weight_DC = (cost.directions_DC * cost.weight_D[:, None])[columns]
    jerk_YC = jerk_YD @ (weight_DC / np.maximum(weight_DC.sum(axis=0), 1e-9))
    return calm_at(averaged(jerk_YC, frame_rate))


def calm_at(jerk_YC: np.ndarray) -> np.ndarray:
    """The factor (Y, C) of a human's jerk [1/s^3]."""
    return 1 / (1 + (jerk_YC / CALM_JERK) ** 2)


def averaged(value_YC: np.ndarray, frame_rate: float) -> np.ndarray:
    """Means (Y, C) over `WINDOW_S`, as far as there are neighbours on either side."""
    half = round(WINDOW_S / 2 * frame_rate)
    total_XC = np.concatenate((np.zeros_like(value_YC[:1]), value_YC.cumsum(axis=0))) if len(value_YC) else value_YC
    place_Y = np.arange(len(value_YC))
    first_Y, last_Y = np.maximum(place_Y - half, 0), np.minimum(place_Y + half + 1, len(value_YC))
    return (total_XC[last_Y] - total_XC[first_Y]) / (last_Y - first_Y)[:, None]
