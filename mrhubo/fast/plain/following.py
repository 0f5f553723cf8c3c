"""What a stream does with a frame beside steps of optimisation, for one person: the One-Euro filter, the two answers
that are followed, and the limits of speed and acceleration. As `mrhubo.streaming` does it, where the reasons stand
(`one_euro`, `branches`, `limits`).

Legend: D directions, N joints, C blocks of joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrhubo.fast.plain.crossing import Crossing, stopping
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.plain.steps import weights
from mrhubo.fast.sections import Cost
from mrhubo.fast.stream_settings import StreamSettings

_REFERENCE_RATE = 24.0
"""Frames per second at which `StreamSettings.smoothness` is the pull's weight."""
_WITHIN = 1 - 1e-6
"""Share of the speed limit that is used."""
_SMALL = 1e-9
HELD = 0.999
"""Share of the longest step that a joint can make from which on its speed is taken to hold it up."""


@dataclass(frozen=True)
class Filtered:
    """What the filter remembers."""

    raw_D3: np.ndarray
    velocity_D3: np.ndarray
    """Low-passed [1/s]."""
    filtered_D3: np.ndarray


@dataclass(frozen=True)
class Followed:
    """What is followed, and since when it has been worse."""

    kept_N: np.ndarray
    """The answer that the robot takes [rad], before limits of acceleration and of crossing over."""
    worse_C: np.ndarray
    """Since how long [s] the network's answer has been clearly better."""
    goal_N: np.ndarray
    """The kept answer, after steps away from self-collision where it would touch."""


@dataclass(frozen=True)
class Joints:
    """Where joints are, and how fast they turn."""

    q_N: np.ndarray
    """Angles [rad] inside the limits, in their precision."""
    velocity_N: np.ndarray
    """[rad/s]"""


def one_euro(
    last: Filtered, raw_D3: np.ndarray, passed: float, partial_D: np.ndarray, settings: StreamSettings
) -> Filtered:
    """The filter's next state, some time [s] later. `partial_D`: 1 for directions whose length is how much they count,
    which is filtered along; the others have length 1.
    """
    velocity_D3 = (raw_D3 - last.raw_D3) / passed
    velocity_D3 = last.velocity_D3 + passed / (passed + settings.speed_time) * (velocity_D3 - last.velocity_D3)
    time_D = settings.rest_time / (1 + norm(velocity_D3) / settings.half_speed)
    share_D1 = (passed / (passed + time_D))[:, None]
    filtered_D3 = last.filtered_D3 + share_D1 * (raw_D3 - last.filtered_D3)
    return Filtered(raw_D3, velocity_D3, np.where(partial_D[:, None] > 0, filtered_D3, normalize(filtered_D3)))


def room(
    cost: Cost, settings: StreamSettings, kept_N: np.ndarray, passed: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The pull (2,) and the bounds (2, N), (2, N) [rad] of the steps of the kept answer and of the network's."""
    reach_N = cost.velocity_N * passed
    lower_2N = np.stack((np.maximum(cost.lower_N, kept_N - reach_N), cost.lower_N))
    upper_2N = np.stack((np.minimum(cost.upper_N, kept_N + reach_N), cost.upper_N))
    return np.array([settings.smoothness / (_REFERENCE_RATE * passed) ** 2, 0.0]), lower_2N, upper_2N


def cross_over(
    cost: Cost,
    settings: StreamSettings,
    last: Followed,
    both_2N: np.ndarray,
    cost_2C: np.ndarray,
    aim_D3: np.ndarray,
    passed: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The next kept answer (N,) [rad], since how long it has been worse (C,) [s], which joints have left the last one
    for the other answer (N,), and which of those cross over to it (N,): none of a block that is only behind, as a joint
    of it could not go any faster.

    Args:
        cost: the robot's.
        settings: of the stream.
        last: the last state.
        both_2N: the kept answer and the network's, after steps,
        cost_2C: and what they cost.
        aim_D3: the human's directions.
        passed: time since the last state [s].
    """
    root_2C = np.sqrt(cost_2C)
    excess_C = (root_2C[0] - root_2C[1]) / np.sqrt(np.maximum(weights(cost, aim_D3[None])[0], _SMALL))
    worse_C = np.where(excess_C > math.radians(settings.worse_deg), last.worse_C + passed, 0.0)
    leave_C = worse_C > max(settings.worse_time, _SMALL)
    leave_N = leave_C[cost.block_N]
    held_N = np.abs(both_2N[0] - last.kept_N) >= HELD * passed * cost.velocity_N
    held_C = (held_N[:, None] * cost.joints_NC).max(axis=0) > 0
    kept_N = np.where(leave_N, both_2N[1], both_2N[0])
    return kept_N, np.where(leave_C, 0.0, worse_C), leave_N, leave_N & ~held_C[cost.block_N]


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
        behind_N = goal_N - goal_velocity_N * passed - q_N
        wanted_N = goal_velocity_N + np.sign(behind_N) * stopping(np.abs(behind_N), self._acceleration_N, passed)
        if pace_N is not None:
            wanted_N = np.minimum(np.maximum(wanted_N, -pace_N), pace_N)
        least_N = -np.minimum(stopping(q_N - self._lower_N, self._acceleration_N, passed), self.speed_N)
        most_N = np.minimum(stopping(self._upper_N - q_N, self._acceleration_N, passed), self.speed_N)
        change_N = self._acceleration_N * passed
        least_N = np.maximum(least_N, last.velocity_N - change_N)
        most_N = np.minimum(most_N, last.velocity_N + change_N)
        wanted_N = np.minimum(np.maximum(wanted_N, least_N), most_N)
        found_N = (q_N + wanted_N * passed).astype(self._lower_N.dtype)
        found_N = np.minimum(np.maximum(found_N, self._lower_N), self._upper_N)
        fast_N = np.abs(found_N - q_N) > self.speed_N * passed
        found_N = np.where(fast_N, np.nextafter(found_N, last.q_N), found_N)
        return Joints(found_N, (found_N - q_N) / passed)


def follow_goal(
    limits: Limits,
    cost: Cost,
    settings: StreamSettings,
    last: tuple[Joints, Crossing],
    goal: tuple[np.ndarray, np.ndarray],
    begun_N: np.ndarray,
    passed: float,
) -> tuple[Joints, Crossing]:
    """The joints' next state, and which of them cross over: those do so gently, the others go as `Limits.follow` says.

    Args:
        limits: the robot's.
        cost: the same.
        settings: of the stream.
        last: the last state.
        goal: where the joints are to go (N,) [rad], and how fast that moves (N,) [rad/s].
        begun_N: those that begin to cross over.
        passed: time since the last state [s].
    """
    (joints, crossing), (goal_N, velocity_N) = last, goal
    q_N = joints.q_N.astype(np.float64)
    crossing = crossing.begun(cost, settings, begun_N, np.abs(goal_N - q_N), limits.speed_N)
    on_way_N = crossing.goals(q_N, joints.velocity_N, goal_N, velocity_N, passed)
    return limits.follow(joints, *on_way_N, passed), crossing.after(passed)
