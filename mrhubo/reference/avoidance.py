"""Answers that touch the robot itself give way: what `retarget` and streams do about self-collision.

    cost(q)  +  weight * sum_p max(0, clearance_p - distance_p(q))^2

over the pairs of collision shapes (`SelfCollision`). Where no pair is nearer than its clearance, an answer stays as it
is, to the bit. Elsewhere damped Gauss-Newton steps go on from it, in all joints together. The second term begins at
zero where a pair comes near, so an answer that follows the human into a touch gives way gradually and does not leap.

Who needs every frame free, at any price, asks `collision_free`; who needs it within the limits of joints' speeds, or at
once, asks here: nearly all frames become free (docs/results.md), and who is not is still told so.

Legend: B frames of their own, T frames of a motion, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from mrhubo.fast.plain.avoidance import CLEARANCE, STEPS, WEIGHT
from mrhubo.fast.together.avoiding import SWEEPS, TOLERANCE
from mrhubo.reference.refine import refine_around, widen
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.speed import keep_speed
from mrhubo.reference.terms import SelfCollisionTerm, Smoothness, Term
from mrhubo.robot import BodyMap


class Avoidance(nn.Module):
    """The cost above for one robot, and steps on it; deterministic, each frame's answer is the same in any batch."""

    def __init__(self, body_map: BodyMap, more: Sequence[Term] = ()) -> None:
        """`more` are terms besides directions, posture and distances; targets below then hold theirs too."""
        super().__init__()
        self.collision = body_map.collision
        clear_P = self.collision.clearance(CLEARANCE)
        self.contact = SelfCollisionTerm(self.collision, CLEARANCE, WEIGHT, clear_P)
        self.problem = DirectionProblem(body_map, [*more, self.contact])

    def close(self, q_BN: Tensor) -> Tensor:
        """Which frames (B,) have a pair nearer than its clearance, at joint angles (B, N) [rad]."""
        near = self.collision.near(q_BN, CLEARANCE)
        found_B = torch.zeros(len(q_BN), dtype=torch.bool, device=q_BN.device)
        return found_B.index_fill(0, near.row_X[self.contact.lack(near) > 0], True)

    def forward(self, q_BN: Tensor, target_BD3: Tensor) -> Tensor:
        """Joint angles (B, N) [rad], inside the limits, of which as few as possible touch.

        Args:
            q_BN: where to begin [rad], inside the limits.
            target_BD3: the human's directions.
        """
        row_X = torch.nonzero(self.close(q_BN))[:, 0]
        if not len(row_X):
            return q_BN
        return q_BN.index_copy(0, row_X, self.problem.minimise(q_BN[row_X], target_BD3[row_X], STEPS)[0])

    def in_motion(
        self,
        q_TN: Tensor,
        target_TD3: Tensor,
        smoothness: Smoothness,
        step_N: Tensor,
        around: int,
        fixed_T: Tensor,
    ) -> Tensor:
        """A motion (T, N) [rad] of which as few frames as possible touch, and which keeps to the bound of its steps.

        Frames that give way one by one may leap from one way out to another. So frames that are at most `around` away
        from those are then refined together, by the same cost and the motion's smoothness.

        Args:
            q_TN: the motion, which keeps to the bound; without close frames it stays as it is.
            target_TD3: the human's directions.
            smoothness: the motion's.
            step_N: the longest step of a joint from one frame to the next [rad].
            around: how far away frames may change.
            fixed_T: frames that stay.
        """
        close_T = self.close(q_TN) & ~fixed_T
        if not bool(close_T.any()):
            return q_TN
        free_T = widen(close_T, around) & ~fixed_T
        found_TN = torch.where(close_T[:, None], self(q_TN, target_TD3), q_TN)
        found_TN = refine_around(self.problem, found_TN, target_TD3, smoothness, free_T, SWEEPS, TOLERANCE)
        return keep_speed(self.problem, found_TN, target_TD3, smoothness, step_N, around, fixed_T, SWEEPS)
