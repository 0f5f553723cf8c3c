"""Links keep a distance from each other:  weight * sum_p max(0, margin - distance_p(q))^2

Any link may meet any other, so all joints are one block.

Legend: B problems, N joints, C blocks, X contacts.
"""

from __future__ import annotations

from torch import Tensor

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.terms.term import Quadratic, State, Term
from mrhubo.robot import SelfCollision


class SelfCollisionTerm(Term):
    """The term above."""

    def __init__(self, collision: SelfCollision, margin: float, weight: float) -> None:
        """`margin` [m], `weight` [1/m^2]."""
        super().__init__()
        self.collision, self.margin, self.weight = collision, margin, weight

    def couplings(self) -> list[set[int]]:
        """All joints."""
        return [set(range(len(self.collision.robot.joint_names)))]

    def residual(self, state: State) -> tuple[Tensor, Tensor, Tensor]:
        """max(0, margin - distance) [m] of the pairs nearer than the margin (X,), their Jacobian (X, N) [m/rad], and to
        which of the B problems they belong (X,).
        """
        near = self.collision.near(state.q_BN, self.margin, state.poses)
        return self.margin - near.distance_X, -near.jacobian_XN, near.row_X

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
