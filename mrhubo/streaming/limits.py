"""Joints that follow a goal within limits of angle, speed and acceleration, at any times.

With speed v after a step of time h, braking at the acceleration a needs no more than v^2 / (2 a), however time is then
cut into steps (each step goes on at the speed to which it has braked). So the largest v from which a joint at the
distance d can still stop fulfils  v h + v^2 / (2 a) = d,  that is

    v = 2 d / (h + sqrt(h^2 + 2 d / a)),

and a joint that has kept to it can always keep to it again: braking fully fulfils it too. The same with the distance to
the goal and the speed relative to it makes a joint arrive as fast as it can without passing by.

Legend: B people, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.robot import Robot
from mrhubo.streaming.people import OfPeople

_WITHIN = 1 - 1e-6
"""Share of the speed limit that is used, so that who works the speed out in float32 again finds none above it."""


def pursuit(q_BN: Tensor, goal_BN: Tensor, goal_velocity_BN: Tensor, acceleration: Tensor, passed_B1: Tensor) -> Tensor:
    """The speed [rad/s] of a step with which joints come to a goal [rad] that moves [rad/s] as soon as they can,
    without passing by.
    """
    behind_BN = goal_BN - goal_velocity_BN * passed_B1 - q_BN
    return goal_velocity_BN + behind_BN.sign() * _stopping(behind_BN.abs(), acceleration, passed_B1)


def _stopping(distance_BN: Tensor, acceleration: Tensor, passed_B1: Tensor) -> Tensor:
    """The largest speed [rad/s] of a step after which a joint can still stop within a distance [rad]."""
    return 2 * distance_BN / (passed_B1 + (passed_B1.square() + 2 * distance_BN / acceleration).sqrt())


@dataclass(frozen=True)
class JointState(OfPeople):
    """Where joints are, and how fast they turn."""

    q_BN: Tensor
    """Angles [rad], float32, inside the limits."""
    velocity_BN: Tensor
    """[rad/s], float64."""

    @classmethod
    def at_rest(cls, q_BN: Tensor) -> JointState:
        """Joints that stand still."""
        return cls(q_BN, torch.zeros_like(q_BN, dtype=torch.float64))


class JointLimits:
    """The limits of one robot."""

    def __init__(self, robot: Robot, ramp_time: float) -> None:
        """`ramp_time`: seconds from rest to full speed; 0: acceleration is not limited."""
        self.lower_N, self.upper_N = robot.lower_N, robot.upper_N
        self.speed_N = robot.velocity_N.double() * _WITHIN
        self.acceleration_N = self.speed_N / ramp_time if ramp_time else torch.full_like(self.speed_N, torch.inf)

    def follow(self, state: JointState, goal_BN: Tensor, goal_velocity_BN: Tensor, passed_B: Tensor) -> JointState:
        """The joints' next state.

        Args:
            state: the last one.
            goal_BN: where they should be now [rad], inside the limits.
            goal_velocity_BN: how fast the goal has moved there [rad/s].
            passed_B: time since the last state [s], more than 0.
        """
        passed_B1, q_BN = passed_B.double()[:, None], state.q_BN.double()
        wanted_BN = pursuit(q_BN, goal_BN.double(), goal_velocity_BN.double(), self.acceleration_N, passed_B1)
        least_BN = -_stopping(q_BN - self.lower_N, self.acceleration_N, passed_B1).clamp_max(self.speed_N)
        most_BN = _stopping(self.upper_N - q_BN, self.acceleration_N, passed_B1).clamp_max(self.speed_N)
        change_BN = self.acceleration_N * passed_B1
        least_BN = torch.maximum(least_BN, state.velocity_BN - change_BN)
        most_BN = torch.minimum(most_BN, state.velocity_BN + change_BN)
        found_BN = self._rounded(q_BN, torch.clamp(wanted_BN, least_BN, most_BN), passed_B1)
        return JointState(found_BN, (found_BN.double() - q_BN) / passed_B1)

    def _rounded(self, q_BN: Tensor, velocity_BN: Tensor, passed_B1: Tensor) -> Tensor:
        """The next angles as float32, rounded towards the last ones where the speed would be too high."""
        found_BN = (q_BN + velocity_BN * passed_B1).float().clamp(self.lower_N, self.upper_N)
        fast_BN = (found_BN.double() - q_BN).abs() > self.speed_N * passed_B1
        return torch.where(fast_BN, torch.nextafter(found_BN, q_BN.float()), found_BN)
