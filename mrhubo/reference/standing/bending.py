"""Arms of a whole motion bend until nothing of them is under the floor.

Where they would be, the person's directions are raised (`arms`), and the arms are looked for anew: the best path
through each frame's minima from several starts, for a straight arm may have its elbow turned so that it cannot bend the
way it has to. All frames are then refined together.

Legend: T frames, Y those with raised arms, S starts or arms, D directions and rows of other terms, N joints.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.reference.candidates import from_starts
from mrhubo.reference.refine import widen
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.standing.carried import LIFTED_M, smooth_lift
from mrhubo.reference.standing.giving_way import GivingWay
from mrhubo.reference.standing.low_body import LowBody
from mrhubo.reference.starts import StartPool
from mrhubo.reference.terms import Smoothness
from mrhubo.reference.terms.soles import SoleTerm
from mrhubo.reference.trajectory import best_path

ROUNDS = 5
"""How often arms are raised: what a robot's limits let it do of that is less at first."""
FREE_S = 1.0
"""The time [s] around raised arms in which they are free to move."""
_STARTS, _POSES, _SEED = 8, 2048, 0


class BendingArms(nn.Module):
    """The arms of one robot."""

    def __init__(self, low: LowBody) -> None:
        super().__init__()
        body_map = low.legs.body_map
        self.low, self._arms_N = low, low.arms_N
        self._way = GivingWay(body_map, [SoleTerm(low.legs)], self._arms_N)
        self._problem = DirectionProblem(body_map)
        self._pool = StartPool(self._problem, _STARTS, _SEED, _POSES)

    def forward(
        self,
        q_TN: Tensor,
        target_TD3: Tensor,
        extended: Callable[[Tensor], Tensor],
        up_T3: Tensor,
        height_T: Tensor,
        frame_rate: float,
        smoothness: Smoothness,
        avoid_collisions: bool,
    ) -> Tensor:
        """Joint angles (T, N) [rad] within limits and limits of speed.

        Args:
            q_TN: where to begin [rad], within the limits.
            target_TD3: the person's directions.
            extended: makes targets of directions, with the places where soles are after them (`SoleTerm`).
            up_T3: the upright direction, in the human axes of what carries the legs.
            height_T: how high the root is over the floor [m].
            frame_rate: frames per second.
            smoothness: of the motion.
            avoid_collisions: as for `GivingWay`.
        """
        raise_TS2, robot = np.zeros((len(q_TN), len(self.low.arms), 2)), self._problem.robot
        for again in range(ROUNDS):
            poses = robot.forward(q_TN)
            under_TS2 = np.maximum(-self.low.lowest(poses, up_T3, height_T)[1].double().cpu().numpy(), 0.0)
            if not (under_TS2 > LIFTED_M).any():
                break
            raise_TS2 += np.maximum.accumulate(smooth_lift(under_TS2, frame_rate), axis=-1)  # wrists go with elbows
            raised_TD3 = self.low.raised(target_TD3, poses, up_T3, torch.from_numpy(raise_TS2).to(q_TN))
            raised_T = torch.from_numpy((raise_TS2 > 0).any(axis=(1, 2))).to(q_TN.device)
            if not again:
                q_TN = self._anew(q_TN, raised_TD3, raised_T, smoothness.pull)
            free_T = widen(raised_T, round(FREE_S * frame_rate))
            q_TN = self._way(q_TN, extended(raised_TD3), free_T, frame_rate, smoothness, avoid_collisions)
        return q_TN

    def _anew(self, q_TN: Tensor, target_TD3: Tensor, raised_T: Tensor, pull: float) -> Tensor:
        """The best path of the arms through minima in the frames with raised arms, and what they did in the others."""
        frame_Y = torch.nonzero(raised_T)[:, 0]
        near_YSN, near_YSC = from_starts(self._problem, self._pool, target_TD3[frame_Y])
        own_YN, own_YC = self._problem.minimise(q_TN[frame_Y], target_TD3[frame_Y])
        candidates_TSN = q_TN[:, None].repeat(1, 1 + _STARTS, 1)
        cost_TSC = near_YSC.new_zeros(len(q_TN), 1 + _STARTS, near_YSC.shape[-1])
        candidates_TSN[frame_Y] = torch.cat((own_YN[:, None], near_YSN), dim=1)
        cost_TSC[frame_Y] = torch.cat((own_YC[:, None], near_YSC), dim=1)
        path_TN, _ = best_path(candidates_TSN, cost_TSC, self._problem.blocks.joints_NC, pull)
        return torch.where(self._arms_N, path_TN, q_TN)
