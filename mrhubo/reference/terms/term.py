"""What a term of the cost is: a sum of squares of residuals, with its Gauss-Newton model.

Legend: B problems, N joints, D directions, C blocks (see `blocks`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from mrhubo.reference.blocks import Blocks
from mrhubo.robot import LinkPoses


@dataclass(frozen=True)
class Quadratic:
    """Cost of each block at some q, and the Gauss-Newton model around it: the halves of gradient and Hessian."""

    cost_BC: Tensor
    gradient_BN: Tensor
    hessian_BNN: Tensor

    def where(self, better_BC: Tensor, block_N: Tensor, other: Quadratic) -> Quadratic:
        """`other` in the blocks that are better (B, C) or (C,), this one elsewhere."""
        better_BN = better_BC[..., block_N]
        return Quadratic(
            torch.where(better_BC, other.cost_BC, self.cost_BC),
            torch.where(better_BN, other.gradient_BN, self.gradient_BN),
            torch.where(better_BN[..., None], other.hessian_BNN, self.hessian_BNN),
        )

    def rows(self, keep_B: Tensor) -> Quadratic:
        """Only the problems to keep (B,)."""
        return Quadratic(self.cost_BC[keep_B], self.gradient_BN[keep_B], self.hessian_BNN[keep_B])

    def plus(self, cost_BC: Tensor, gradient_BN: Tensor, hessian_BNN: Tensor) -> Quadratic:
        """The sum with another term's, whose Hessian may be (N, N), the same for all problems."""
        return Quadratic(self.cost_BC + cost_BC, self.gradient_BN + gradient_BN, self.hessian_BNN + hessian_BNN)


@dataclass(frozen=True)
class State:
    """Where the terms are asked for: the same for all of them, worked out once."""

    q_BN: Tensor
    """Joint angles [rad]."""
    poses: LinkPoses
    """The robot's link poses there."""
    target_BD3: Tensor
    """The human's directions."""
    direction_BD3: Tensor
    """The robot's, as they are seen from their parts."""
    jacobian_BD3N: Tensor
    """How they turn [1/rad]."""


class Term(nn.Module):
    """A term of the cost of one robot."""

    def couplings(self) -> Sequence[set[int]]:
        """Sets of joints (columns of q) that one summand depends on together."""
        raise NotImplementedError

    def add_to(self, model: Quadratic | None, state: State, blocks: Blocks) -> Quadratic:
        """The model with this term added; None stands for nothing yet."""
        raise NotImplementedError
