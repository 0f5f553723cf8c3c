"""Links keep a distance from each other:  weight * sum_p max(0, margin_p - distance_p(q))^2

Any link may meet any other, so all joints are one block.

Legend: B problems, N joints, C blocks, X contacts.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.terms.term import Quadratic, State, Term
from mrhubo.robot import SelfCollision
from mrhubo.robot.collision import Contacts


class SelfCollisionTerm(Term):
    """The term above."""

    margin_P: Tensor | None

    def __init__(self, collision: SelfCollision, margin: float, weight: float, margin_P: Tensor | None = None) -> None:
        """`margin` [m] of all pairs, or at most, where each has one of its own (P,); `weight` [1/m^2]."""
        super().__init__()
        self.collision, self.margin, self.weight = collision, margin, weight
        self.register_buffer("margin_P", margin_P, persistent=False)

    def lack(self, near: Contacts) -> Tensor:
        """By how much pairs are nearer than they are to be (X,) [m]; negative where they are not."""
        return (self.margin if self.margin_P is None else self.margin_P[near.pair_X]) - near.distance_X

    def couplings(self) -> list[set[int]]:
        """All joints."""
        return [set(range(len(self.collision.robot.joint_names)))]

    def residual(self, state: State, more: float = 0.0) -> tuple[Tensor, Tensor, Tensor]:
        """margin - distance [m] of the pairs nearer than the margin and so much `more` [m] (X,), their Jacobian (X, N)
        [m/rad], and to which of the B problems they belong (X,).
        """
        near = self.collision.near(state.q_BN, self.margin + more, state.poses)
        short_X = self.lack(near)
        x = torch.nonzero(short_X > -more)[:, 0]
        return short_X[x], -near.jacobian_XN[x], near.row_X[x]

    def add_to(self, model: Quadratic | None, state: State, blocks: Blocks) -> Quadratic:
        """As `Term.add_to`."""
        if model is None:
            batch, joints = state.q_BN.shape
            model = Quadratic(
                state.q_BN.new_zeros(batch, blocks.joints_NC.shape[1]),
                state.q_BN.new_zeros(batch, joints),
                state.q_BN.new_zeros(batch, joints, joints),
            )
        short_X, rows_XN, row_X = self.residual(state)
        return Quadratic(
            model.cost_BC.index_add(0, row_X, self.weight * short_X[:, None].square()),
            model.gradient_BN.index_add(0, row_X, self.weight * short_X[:, None] * rows_XN),
            model.hessian_BNN.index_add(0, row_X, self.weight * rows_XN[:, :, None] * rows_XN[:, None, :]),
        )
