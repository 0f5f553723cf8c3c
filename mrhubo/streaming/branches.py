"""Two answers that are followed at the same time: the one that the robot takes, and the one that the network gives.

Where a human pose has two equally good answers (a straight elbow; an arm along an axis of its shoulder at that joint's
limit), which one is better changes with every breath. So the last answer is followed by steps of optimisation with a
pull towards it, whose weight is the reference's for a motion; the network's answer is followed beside it; and the robot
goes over to it only when its own has been clearly worse for some time.

Legend: B people, D directions, N joints, C blocks of joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.fast import StreamSettings
from mrhubo.fast.plain.following import HELD
from mrhubo.reference import Avoidance, DirectionProblem
from mrhubo.reference.terms import REFERENCE_RATE, Quadratic
from mrhubo.streaming.people import OfPeople

_STEPS = 2
_DAMPING, _EASIER, _HARDER = 1e-2, 0.1, 10.0


@dataclass(frozen=True)
class BranchState(OfPeople):
    """What is followed, and since when it has been worse."""

    kept_BN: Tensor
    """The answer that the robot takes [rad], before limits of acceleration and of crossing over."""
    worse_BC: Tensor
    """Since how long [s] the network's answer has been clearly better."""
    goal_BN: Tensor
    """The answer that the robot takes, after steps away from self-collision where it would touch."""

    @classmethod
    def at(cls, q_BN: Tensor, blocks: int, goal_BN: Tensor | None = None) -> BranchState:
        """Where a stream begins."""
        return cls(q_BN, q_BN.new_zeros(len(q_BN), blocks), q_BN if goal_BN is None else goal_BN)


class Branches:
    """The two answers for one robot."""

    def __init__(self, problem: DirectionProblem, settings: StreamSettings, avoidance: Avoidance | None = None) -> None:
        """`avoidance`: what makes answers give way that touch the robot itself; None: nothing does."""
        self.problem, self.settings, self.avoidance = problem, settings, avoidance

    def free(self, q_BN: Tensor, target_BD3: Tensor) -> Tensor:
        """Joint angles (B, N) [rad] after steps away from self-collision, if there are to be any."""
        return q_BN if self.avoidance is None else self.avoidance(q_BN, target_BD3, staying=True)

    def advance(
        self, state: BranchState, network_BN: Tensor, target_BD3: Tensor, passed_B: Tensor
    ) -> tuple[BranchState, Tensor, Tensor]:
        """The next state; how fast the goal moves [rad/s] (B, N), 0 where another answer has been taken up; and which
        joints (B, N) begin to cross over to it: none of a block that is only behind, as its joints cannot go faster.

        Args:
            state: the last one.
            network_BN: the network's answer [rad].
            target_BD3: the human's directions.
            passed_B: time since the last state [s], more than 0.
        """
        problem, kept_BN = self.problem, state.kept_BN
        reach_BN = problem.robot.velocity_N * passed_B[:, None]
        lower_BN = torch.maximum(problem.lower_N, kept_BN - reach_BN)
        upper_BN = torch.minimum(problem.upper_N, kept_BN + reach_BN)
        pull_B = self.settings.smoothness / (REFERENCE_RATE * passed_B).square()
        both_YN, cost_YC = self._steps(
            torch.cat((kept_BN, network_BN)),
            torch.cat((target_BD3, target_BD3)),
            torch.cat((pull_B, torch.zeros_like(pull_B))),
            (torch.cat((lower_BN, problem.lower_N.expand_as(kept_BN))),
             torch.cat((upper_BN, problem.upper_N.expand_as(kept_BN)))),
        )  # fmt: skip
        (moved_BN, other_BN), (cost_BC, other_cost_BC) = both_YN.chunk(2), cost_YC.chunk(2)
        excess_BC = (cost_BC.sqrt() - other_cost_BC.sqrt()) / problem.weights(target_BD3).clamp_min(1e-9).sqrt()
        worse_BC = torch.where(
            excess_BC > math.radians(self.settings.worse_deg), state.worse_BC + passed_B[:, None], 0.0
        )
        leave_BC = worse_BC > max(self.settings.worse_time, 1e-9)
        leave_BN = leave_BC[:, problem.blocks.block_N]
        held_BN = (moved_BN - kept_BN).abs() >= HELD * reach_BN
        held_BC = (held_BN[..., None] * problem.blocks.joints_NC).amax(dim=1) > 0
        kept_BN = torch.where(leave_BN, other_BN, moved_BN)
        goal_BN = self.free(kept_BN, target_BD3)
        velocity_BN = torch.where(leave_BN, 0.0, (goal_BN - state.goal_BN) / passed_B[:, None])
        begun_BN = leave_BN & ~held_BC[:, problem.blocks.block_N]
        return BranchState(kept_BN, torch.where(leave_BC, 0.0, worse_BC), goal_BN), velocity_BN, begun_BN

    def _steps(
        self, q_YN: Tensor, target_YD3: Tensor, pull_Y: Tensor, bounds: tuple[Tensor, Tensor]
    ) -> tuple[Tensor, Tensor]:
        """Answers (Y, N) after steps on cost plus pull, inside bounds, and the blocks' costs (Y, C) without pull."""
        problem, centre_YN = self.problem, q_YN
        block_N, joints_NC = problem.blocks.block_N, problem.blocks.joints_NC
        model = problem.quadratic(q_YN, target_YD3)
        damping_YC = torch.full_like(model.cost_BC, _DAMPING)
        for _ in range(_STEPS):
            pulled = _pulled(model, q_YN - centre_YN, pull_Y)
            trial_YN = torch.clamp(q_YN + problem.step(q_YN, pulled, damping_YC[:, block_N], bounds), *bounds)
            trial = problem.quadratic(trial_YN, target_YD3)
            pull_YC = pull_Y[:, None] * ((trial_YN - centre_YN).square() - (q_YN - centre_YN).square()) @ joints_NC
            better_YC = trial.cost_BC + pull_YC < model.cost_BC
            q_YN = torch.where(better_YC[:, block_N], trial_YN, q_YN)
            model = model.where(better_YC, block_N, trial)
            damping_YC = damping_YC * torch.where(better_YC, _EASIER, _HARDER)
        return q_YN, model.cost_BC


def _pulled(model: Quadratic, moved_YN: Tensor, pull_Y: Tensor) -> Quadratic:
    """The model with  pull |q - centre|^2,  which is no cost of the answer's own, in gradient and Hessian."""
    pull_Y1 = pull_Y[:, None]
    return Quadratic(
        model.cost_BC, model.gradient_BN + pull_Y1 * moved_YN,
        model.hessian_BNN + torch.diag_embed(pull_Y1.expand_as(moved_YN)),
    )  # fmt: skip
