"""Joints stay near the middle of their ranges:  eps * sum_n ((q_n - mid_n) / half_n)^2

Small, it makes a choice where the directions leave one (redundant joints, the twist of a straight arm), the same choice
for similar poses.

Legend: B problems, N joints, C blocks.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.terms.term import Quadratic, State, Term

EPSILON = 1e-4


class PostureTerm(Term):
    """The term above."""

    mid_N: Tensor
    half_N: Tensor
    ridge_N: Tensor
    """eps / half^2 [1/rad^2]."""

    def __init__(self, lower_N: Tensor, upper_N: Tensor) -> None:
        """`lower_N`, `upper_N`: joint limits [rad]."""
        super().__init__()
        half_N = (upper_N - lower_N) / 2
        self.register_buffer("mid_N", (upper_N + lower_N) / 2, persistent=False)
        self.register_buffer("half_N", half_N, persistent=False)
        self.register_buffer("ridge_N", EPSILON / half_N.square(), persistent=False)

    def couplings(self) -> list[set[int]]:
        """Every joint for itself."""
        return [{n} for n in range(len(self.mid_N))]

    def residual(self, q_BN: Tensor) -> tuple[Tensor, Tensor]:
        """sqrt(eps) (q - mid) / half (B, N), and its Jacobian (N, N) [1/rad]."""
        root_N = self.ridge_N.sqrt()
        return (q_BN - self.mid_N) * root_N, torch.diag(root_N)

    def add_to(self, model: Quadratic | None, state: State, blocks: Blocks) -> Quadratic:
        """As `Term.add_to`."""
        from_mid_BN = state.q_BN - self.mid_N
        cost_BC = (from_mid_BN.square() * self.ridge_N) @ blocks.joints_NC
        gradient_BN, hessian_NN = from_mid_BN * self.ridge_N, torch.diag(self.ridge_N)
        if model is None:
            return Quadratic(cost_BC, gradient_BN, hessian_NN.expand(len(cost_BC), -1, -1))
        return model.plus(cost_BC, gradient_BN, hessian_NN)
