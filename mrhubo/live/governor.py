"""Joint angles at a fixed rate, inside limits of position, speed and acceleration, whatever is asked for.

Each step counts as one period, never more, however late it comes: between two sent angles there is then always time
enough. No joint turns faster than it can brake from in the time that a stop may take.

Legend: N joints.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.fast.plain.limits import Joints, Limits
from mrhubo.robot_motion import RobotFacts

_LEAST_STEPS = 2
"""A stop takes this many steps, or may take more."""
_STILL = 1e-9
"""What is slower [rad/s] stands: roundings alone are left."""


def brake_steps(config: LiveConfig) -> int:
    """The periods in which every joint comes to stand, at most.

    Raises:
        UserError: there is no time to brake in.
    """
    steps = math.floor((config.stop_time - config.heartbeat_timeout) * config.rate + 1e-9) - 1
    if steps < _LEAST_STEPS:
        least = config.heartbeat_timeout + (_LEAST_STEPS + 1) / config.rate
        raise UserError(
            f"stop_time: {config.stop_time:g} s leaves no time to brake after heartbeat_timeout="
            f"{config.heartbeat_timeout:g} at rate={config.rate:g}; give {least:.3g} or more, or another of them"
        )
    return steps


class Governor:
    """The joints of one robot."""

    def __init__(self, facts: RobotFacts, config: LiveConfig, start_N: np.ndarray) -> None:
        """Joints that stand still.

        Args:
            facts: of the robot, with its limits.
            config: the settings.
            start_N: where it stands (N,) [rad]; the nearest inside the limits is taken.

        Raises:
            UserError: the robot has no limits, or there is no time to brake in.
        """
        if facts.lower is None or facts.upper is None or facts.velocity is None:
            raise UserError(f"robot '{facts.name}': its limits are not known, so it cannot be steered")
        self.lower_N, self.upper_N = (limit.astype(np.float64) for limit in (facts.lower, facts.upper))
        self.period = 1.0 / config.rate
        steps = brake_steps(config)
        self.acceleration = config.acceleration
        self.brake_time = steps * self.period
        """In which every joint comes to stand [s], at most."""
        brakeable = config.acceleration * steps * self.period
        self.speed_N = np.minimum(facts.velocity.astype(np.float64) * config.speed, brakeable)
        acceleration_N = np.full(len(self.speed_N), config.acceleration)
        self._limits = Limits(self.lower_N, self.upper_N, self.speed_N, acceleration_N)
        self._joints = Joints(np.clip(start_N.astype(np.float64), self.lower_N, self.upper_N), np.zeros(len(start_N)))

    @property
    def q_N(self) -> np.ndarray:
        """Joint angles (N,) [rad]."""
        return self._joints.q_N

    @property
    def velocity_N(self) -> np.ndarray:
        """[rad/s]"""
        return self._joints.velocity_N

    @property
    def still(self) -> bool:
        """Whether no joint turns."""
        return bool((np.abs(self._joints.velocity_N) < _STILL).all())

    def go(self, goal_N: np.ndarray, pace_N: np.ndarray) -> None:
        """One step towards joint angles [rad], at a pace [rad/s] at most."""
        nothing_N = np.zeros(len(goal_N))
        self._joints = self._limits.follow(self._joints, goal_N, nothing_N, self.period, pace_N)

    def brake(self) -> None:
        """One step of slowing down as fast as the limit of acceleration allows, or of standing still."""
        self.go(self._joints.q_N, np.zeros(len(self._joints.q_N)))

    def settle(self) -> None:
        """The joints stand where they would have come to stand: nothing was sent for longer than that takes."""
        self._joints = Joints(self.standstill()[0], np.zeros(len(self._joints.q_N)))

    def standstill(self) -> tuple[np.ndarray, float]:
        """Where the joints stand (N,) [rad] if they brake from now on, and how long that takes [s]."""
        change = self.acceleration * self.period
        speed_N = np.abs(self._joints.velocity_N)
        steps_N = np.ceil(speed_N / change - _STILL)  # in the last of them they stand
        way_N = self.period * np.maximum((steps_N - 1) * (speed_N - change * steps_N / 2), 0.0)
        stop_N = np.clip(self._joints.q_N + np.sign(self._joints.velocity_N) * way_N, self.lower_N, self.upper_N)
        return stop_N, float(steps_N.max(initial=0.0)) * self.period
