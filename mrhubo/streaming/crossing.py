"""Crossing over gently, as `mrhubo.fast.plain.crossing` has it, where the reasons stand, for several people.

Legend: B people, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.fast import StreamSettings
from mrhubo.fast.plain.crossing import LEAST
from mrhubo.reference.blocks import Blocks
from mrhubo.streaming.limits import pursuit
from mrhubo.streaming.people import OfPeople


@dataclass(frozen=True)
class Crossing(OfPeople):
    """Joints on their way to another answer."""

    left_BN: Tensor
    """For how long yet [s], float64; 0: the joint follows its goal as quickly as it may."""
    acceleration_BN: Tensor
    """What it may have meanwhile [rad/s^2]."""

    @classmethod
    def none(cls, like_BN: Tensor) -> Crossing:
        """Nobody crosses over."""
        nothing_BN = torch.zeros_like(like_BN, dtype=torch.float64)
        return cls(nothing_BN, nothing_BN + 1)

    def begun(
        self, blocks: Blocks, settings: StreamSettings, begun_BN: Tensor, distance_BN: Tensor, speed_N: Tensor
    ) -> Crossing:
        """With joints that begin to cross over now, at a distance [rad] from where they are to go."""
        time = settings.crossing_time
        if time <= settings.ramp_time or not bool(begun_BN.any()):
            return self
        way_BN = distance_BN / speed_N
        longest_BC = (way_BN[..., None] * blocks.joints_NC).amax(dim=1)
        longest_BN = longest_BC[:, blocks.block_N]
        left_BN = torch.where(longest_BN > time, longest_BN + time, 2 * (longest_BN * time).sqrt())
        share_BN = (way_BN / longest_BN.clamp_min(1e-9)).clamp_min(LEAST)
        return Crossing(
            torch.where(begun_BN, left_BN, self.left_BN),
            torch.where(begun_BN, share_BN * speed_N / time, self.acceleration_BN),
        )

    def goals(
        self, q_BN: Tensor, speed_BN: Tensor, goal_BN: Tensor, goal_velocity_BN: Tensor, passed_B: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Where joints are to go in this step [rad], and how fast that moves [rad/s], from where they are and how fast
        they turn: on the way for those that cross over.
        """
        passed_B1, crosses_BN = passed_B.double()[:, None], self.left_BN > 0
        q_BN, goal_BN, goal_velocity_BN = q_BN.double(), goal_BN.double(), goal_velocity_BN.double()
        wanted_BN = pursuit(q_BN, goal_BN, goal_velocity_BN, self.acceleration_BN, passed_B1)
        change_BN = self.acceleration_BN * passed_B1
        wanted_BN = torch.minimum(torch.maximum(wanted_BN, speed_BN - change_BN), speed_BN + change_BN)
        on_way_BN = torch.where(crosses_BN, q_BN + wanted_BN * passed_B1, goal_BN)
        return on_way_BN, torch.where(crosses_BN, wanted_BN, goal_velocity_BN)

    def after(self, passed_B: Tensor) -> Crossing:
        """Some time [s] later."""
        return Crossing((self.left_BN - passed_B.double()[:, None]).clamp_min(0.0), self.acceleration_BN)
