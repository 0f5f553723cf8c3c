"""What a stream does with a frame beside steps of optimisation, for one person: the One-Euro filter, the two answers
that are followed, and how joints go to them. As `mrhubo.streaming` does it, where the reasons stand (`one_euro`,
`branches`, `follow`).

Legend: D directions, N joints, C blocks of joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrhubo.fast.plain.crossing import Crossing
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.plain.limits import Joints, Limits
from mrhubo.fast.plain.steps import weights
from mrhubo.fast.sections import Cost
from mrhubo.fast.stream_settings import StreamSettings

_REFERENCE_RATE = 24.0
"""Frames per second at which `StreamSettings.smoothness` is the pull's weight."""
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
