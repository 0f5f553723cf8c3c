"""The robot's limbs, hands and head point where the human's do:  sum_d w_d |t_d| |dir_d(q) - t_d / |t_d||^2

t_d is the human's direction, whose length is how much it counts: less than 1 for bend axes alone (`robot.bending`).

Legend: B problems, D directions, R = 3 D rows of residuals, N joints, C blocks.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.jacobian import DirectionJacobian
from mrhubo.reference.terms.term import Quadratic, State, Term
from mrhubo.robot.swings import direction_weights


class DirectionTerm(Term):
    """The term above; the weights w are those of `mrhubo.robot.swings`."""

    weight_D: Tensor
    partial_D: Tensor
    """1 where a direction may count less than in full."""

    def __init__(self, kinematics: DirectionJacobian) -> None:
        super().__init__()
        self.kinematics = kinematics
        weights = direction_weights(kinematics.body_map)
        partial = [float(i in kinematics.body_map.shared.bend_columns) for i in range(len(weights))]
        self.register_buffer("partial_D", torch.tensor(partial).to(kinematics.robot.lower_N), persistent=False)
        self.register_buffer("weight_D", torch.tensor(weights).to(kinematics.robot.lower_N), persistent=False)

    def couplings(self) -> list[set[int]]:
        """Of each direction the joints that turn it."""
        return [{n for n, moved in enumerate(row) if moved} for row in self.kinematics.moved_DN.tolist()]

    def residual(self, state: State) -> tuple[Tensor, Tensor, Tensor]:
        """Differences of directions (B, D, 3), unweighted, their Jacobian (B, D, 3, N) [1/rad], and their weights
        (B, D).
        """
        target_BD3 = state.target_BD3[:, : len(self.weight_D)]  # other terms' targets come after
        length_BD = torch.where(self.partial_D > 0, target_BD3.norm(dim=-1), 1.0)
        miss_BD3 = state.direction_BD3 - target_BD3 / length_BD.clamp_min(1e-6)[..., None]
        return miss_BD3, state.jacobian_BD3N, self.weight_D * length_BD

    def add_to(self, model: Quadratic | None, state: State, blocks: Blocks) -> Quadratic:
        """As `Term.add_to`."""
        miss_BD3, jacobian_BD3N, weight_BD = self.residual(state)
        root_BD = weight_BD.sqrt()
        cost_BC = (miss_BD3.square().sum(-1) * weight_BD) @ blocks.directions_DC
        rows_BRN = (jacobian_BD3N * root_BD[..., None, None]).flatten(1, 2)
        miss_BR1 = (miss_BD3 * root_BD[..., None]).flatten(1)[..., None]
        gradient_BN, hessian_BNN = (rows_BRN.mT @ miss_BR1)[..., 0], rows_BRN.mT @ rows_BRN
        if model is None:
            return Quadratic(cost_BC, gradient_BN, hessian_BNN)
        return model.plus(cost_BC, gradient_BN, hessian_BNN)
