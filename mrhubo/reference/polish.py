"""Steps of optimisation from an answer that is nearly right, such as a network's, and a second look where it is not.

Levenberg-Marquardt finds the minimum whose valley it starts in. A network's answer is in the right one but for rare
frames, nearly all with a joint at its limit. Those cannot be told for sure, but they must be among the blocks of joints
whose limbs are still far off: a block that is less than 3 degrees away from the human cannot be 3 degrees away from its
optimum. So every block that is further off starts again from a few robot poses far from each other.

Legend: B frames, S starts, D directions, N joints, C blocks.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.starts import StartPool
from mrhubo.reference.trajectory import pick

STARTS, _POOL = 3, 2048
FIRST_STEPS = 2
"""Steps from each start before the best of them goes on alone."""
FAR_RAD = math.radians(3.0)
"""Root mean square of a block's angles to the human from which it starts again."""
GAIN_RAD = math.radians(0.5)
"""A start's answer is taken if it costs less by what a block costs that is so far off: equal ones stay as they are."""


class Polish(nn.Module):
    """Steps of optimisation for one problem; deterministic, and each frame's answer is the same in any batch."""

    def __init__(self, problem: DirectionProblem) -> None:
        super().__init__()
        self.problem = problem
        self.pool = StartPool(problem, STARTS, seed=0, poses=_POOL)

    def forward(self, q_BN: Tensor, target_BD3: Tensor, steps: int) -> Tensor:
        """Joint angles (B, N) [rad] that cost no more than the given ones, inside the limits, in any block.

        Args:
            q_BN: where to begin [rad], inside the limits.
            target_BD3: the human's directions.
            steps: Levenberg-Marquardt steps at most; a block ends earlier where it has converged.
        """
        q_BN, cost_BC = self.problem.minimise(q_BN, target_BD3, steps)
        weight_BC = self.problem.weights(target_BD3)
        far_BC = cost_BC > weight_BC * FAR_RAD**2
        if not steps or not bool(far_BC.any()):
            return q_BN
        row_X = torch.nonzero(far_BC.any(dim=1))[:, 0]
        other_XN, other_cost_XC = self._again(q_BN[row_X], target_BD3[row_X], far_BC[row_X], steps)
        better_XC = far_BC[row_X] & (other_cost_XC < cost_BC[row_X] - weight_BC[row_X] * GAIN_RAD**2)
        q_BN[row_X] = torch.where(better_XC[:, self.problem.blocks.block_N], other_XN, q_BN[row_X])
        return q_BN

    def _again(self, q_XN: Tensor, target_XD3: Tensor, far_XC: Tensor, steps: int) -> tuple[Tensor, Tensor]:
        """What the blocks that are far off find from the starts, and its cost (X, C); the others stay."""
        blocks = self.problem.blocks
        start_XSN = torch.where(far_XC[:, None, blocks.block_N], self.pool.near(target_XD3), q_XN[:, None])
        target_YD3 = target_XD3.repeat_interleave(STARTS, dim=0)
        found_YN, cost_YC = self.problem.minimise(start_XSN.flatten(0, 1), target_YD3, min(steps, FIRST_STEPS))
        best_XC = cost_YC.unflatten(0, (-1, STARTS)).argmin(dim=1)
        best_XN = pick(found_YN.unflatten(0, (-1, STARTS)), best_XC, blocks.joints_NC)
        return self.problem.minimise(best_XN, target_XD3, steps)
