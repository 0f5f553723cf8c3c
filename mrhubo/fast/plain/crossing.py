"""Crossing over gently: joints that leave one answer for another one, elsewhere, take their time about it.

A stream goes over to another branch where a human pose has two equally good answers. Joints that do so as hard as they
may jerk a hundred times as much as the person, for whom nothing happens there. So for as long as they need, they reach
their speed in `StreamSettings.crossing_time`, and brake in it: a joint with the distance d [s at its full speed] needs
d + time, or 2 sqrt(d time) if it does not reach its speed. Joints of a block (an arm) cross together: the one with the
longest way sets the time, the acceleration of the others is smaller as their ways are. Then all follow their goals as
quickly as ever.

Who is behind because joints are slow, and not because there is another branch, is in a hurry: no joint is crossing
where one of its block was held up by its speed (`cross_over`).

Legend: N joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.plain.limits import pursuit
from mrhubo.fast.sections import Cost
from mrhubo.fast.stream_settings import StreamSettings

LEAST = 0.05
"""Share of its full acceleration that a joint has at least, however short its way: the goal moves on meanwhile."""


@dataclass(frozen=True)
class Crossing:
    """Joints on their way to another answer."""

    left_N: np.ndarray
    """For how long yet [s]; 0: the joint follows its goal as quickly as it may."""
    acceleration_N: np.ndarray
    """What it may have meanwhile [rad/s^2]."""

    @classmethod
    def none(cls, joints: int) -> Crossing:
        """Nobody crosses over."""
        return cls(np.zeros(joints), np.ones(joints))

    def begun(
        self, cost: Cost, settings: StreamSettings, begun_N: np.ndarray, distance_N: np.ndarray, speed_N: np.ndarray
    ) -> Crossing:
        """With joints that begin to cross over now, at a distance [rad] from where they are to go."""
        time = settings.crossing_time
        if time <= settings.ramp_time or not begun_N.any():
            return self
        way_N = distance_N / speed_N
        longest_C = (way_N[:, None] * cost.joints_NC).max(axis=0)
        longest_N = longest_C[cost.block_N]
        left_N = np.where(longest_N > time, longest_N + time, 2 * np.sqrt(longest_N * time))
        share_N = np.maximum(way_N / np.maximum(longest_N, 1e-9), LEAST)
        return Crossing(
            np.where(begun_N, left_N, self.left_N), np.where(begun_N, share_N * speed_N / time, self.acceleration_N)
        )

    def goals(
        self, q_N: np.ndarray, speed_N: np.ndarray, goal_N: np.ndarray, goal_velocity_N: np.ndarray, passed: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Where joints are to go in this step [rad], and how fast that moves [rad/s], from where they are and how fast
        they turn: on the way for those that cross over.
        """
        wanted_N = pursuit(q_N, goal_N, goal_velocity_N, self.acceleration_N, passed)
        change_N = self.acceleration_N * passed
        wanted_N = np.minimum(np.maximum(wanted_N, speed_N - change_N), speed_N + change_N)
        crosses_N = self.left_N > 0
        return np.where(crosses_N, q_N + wanted_N * passed, goal_N), np.where(crosses_N, wanted_N, goal_velocity_N)

    def after(self, passed: float) -> Crossing:
        """Some time [s] later."""
        return Crossing(np.maximum(self.left_N - passed, 0.0), self.acceleration_N)
