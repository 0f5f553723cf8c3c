"""The robot's limbs, hands and head point where the human's do:  sum_d w_d |dir_d(q) - dir_d(H)|^2

Legend: B problems, D directions, R = 3 D rows of residuals, N joints, C blocks.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.jacobian import DirectionJacobian
from mrhubo.reference.terms.term import Quadratic, State, Term


class DirectionTerm(Term):
    """The term above; the weights are those of the table of body parts."""

    weight_D: Tensor

    def __init__(self, kinematics: DirectionJacobian) -> None:
        super().__init__()
        self.kinematics = kinematics
        weights = [direction.part.weight for direction in kinematics.body_map.directions]
        self.register_buffer("weight_D", torch.tensor(weights).to(kinematics.robot.lower_N), persistent=False)

    def couplings(self) -> list[set[int]]:
        """Of each direction the joints that turn it."""
        return [{n for n, moved in enumerate(row) if moved} for row in self.kinematics.moved_DN.tolist()]

    def residual(self, state: State) -> tuple[Tensor, Tensor]:
        """Differences of directions (B, D, 3), unweighted, and their Jacobian (B, D, 3, N) [1/rad]."""
        direction_BD3, jacobian_BD3N = self.kinematics.at(state.poses)
        return direction_BD3 - state.target_BD3, jacobian_BD3N

    def add_to(self, model: Quadratic | None, state: State, blocks: Blocks) -> Quadratic:
        """As `Term.add_to`."""
        miss_BD3, jacobian_BD3N = self.residual(state)
        root_D = self.weight_D.sqrt()
        cost_BC = (miss_BD3.square().sum(-1) * self.weight_D) @ blocks.directions_DC
        rows_BRN = (jacobian_BD3N * root_D[:, None, None]).flatten(1, 2)
        miss_BR1 = (miss_BD3 * root_D[:, None]).flatten(1)[..., None]
        gradient_BN, hessian_BNN = (rows_BRN.mT @ miss_BR1)[..., 0], rows_BRN.mT @ rows_BRN
        if model is None:
            return Quadratic(cost_BC, gradient_BN, hessian_BNN)
        return model.plus(cost_BC, gradient_BN, hessian_BNN)
