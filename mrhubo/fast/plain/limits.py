"""Limits of speed and acceleration for one person's stream, as `mrhubo.streaming.limits` has them, where the reasons
stand.

Legend: N joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.sections import Cost

_WITHIN = 1 - 1e-6
"""Share of the speed limit that is used."""


@dataclass(frozen=True)
class Joints:
    """Where joints are, and how fast they turn."""

    q_N: np.ndarray
    """Angles [rad] inside the limits, in their precision."""
    velocity_N: np.ndarray
    """[rad/s]"""


def pursuit(
    q_N: np.ndarray, goal_N: np.ndarray, goal_velocity_N: np.ndarray, acceleration_N: np.ndarray, passed: float
) -> np.ndarray:
    """The speed [rad/s] of a step with which joints come to a goal [rad] that moves [rad/s] as soon as they can,
    without passing by.
    """
    behind_N = goal_N - goal_velocity_N * passed - q_N
    return goal_velocity_N + np.sign(behind_N) * _stopping(np.abs(behind_N), acceleration_N, passed)


def _stopping(distance_N: np.ndarray, acceleration_N: np.ndarray, passed: float) -> np.ndarray:
    """The largest speed [rad/s] of a step after which a joint can still stop within a distance [rad]."""
    return 2 * distance_N / (passed + np.sqrt(passed * passed + 2 * distance_N / acceleration_N))


class Limits:
    """The limits of one robot's joints, kept from step to step whatever is wanted, in the precision of `lower_N`."""

    def __init__(
        self, lower_N: np.ndarray, upper_N: np.ndarray, speed_N: np.ndarray, acceleration_N: np.ndarray
    ) -> None:
        """Limits of angles [rad], speeds [rad/s] and accelerations [rad/s^2]; infinite: acceleration is not limited."""
        self._lower_N, self._upper_N = lower_N, upper_N
        self._acceleration_N = acceleration_N
        self.speed_N = speed_N.astype(np.float64) * _WITHIN
        """What is used of the speeds [rad/s]."""

    @classmethod
    def of_cost(cls, cost: Cost, ramp_time: float) -> Limits:
        """Those of a robot. `ramp_time`: seconds from rest to full speed; 0: acceleration is not limited."""
        speed_N = cost.velocity_N.astype(np.float64) * _WITHIN
        acceleration_N = speed_N / ramp_time if ramp_time else np.full_like(speed_N, np.inf)
        return cls(cost.lower_N.astype(np.float32), cost.upper_N.astype(np.float32), cost.velocity_N, acceleration_N)

    def follow(
        self,
        last: Joints,
        goal_N: np.ndarray,
        goal_velocity_N: np.ndarray,
        passed: float,
        pace_N: np.ndarray | None = None,
    ) -> Joints:
        """The joints' next state, some time [s] later: as near to the goal [rad], which has moved there at a velocity
        [rad/s], as they may come.

        Args:
            last: the state before.
            goal_N: where they are to go.
            goal_velocity_N: how fast that moves.
            passed: the time.
            pace_N: no faster than this [rad/s]; who is faster brakes as the limit of acceleration allows.
        """
        q_N = last.q_N.astype(np.float64)
        wanted_N = pursuit(q_N, goal_N, goal_velocity_N, self._acceleration_N, passed)
        if pace_N is not None:
            wanted_N = np.minimum(np.maximum(wanted_N, -pace_N), pace_N)
        least_N = -np.minimum(_stopping(q_N - self._lower_N, self._acceleration_N, passed), self.speed_N)
        most_N = np.minimum(_stopping(self._upper_N - q_N, self._acceleration_N, passed), self.speed_N)
        change_N = self._acceleration_N * passed
        least_N = np.maximum(least_N, last.velocity_N - change_N)
        most_N = np.minimum(most_N, last.velocity_N + change_N)
        wanted_N = np.minimum(np.maximum(wanted_N, least_N), most_N)
        found_N = (q_N + wanted_N * passed).astype(self._lower_N.dtype)
        found_N = np.minimum(np.maximum(found_N, self._lower_N), self._upper_N)
        fast_N = np.abs(found_N - q_N) > self.speed_N * passed
        found_N = np.where(fast_N, np.nextafter(found_N, last.q_N), found_N)
        return Joints(found_N, (found_N - q_N) / passed)
