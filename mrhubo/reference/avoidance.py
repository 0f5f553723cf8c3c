"""Answers that touch the robot itself give way: what `retarget` and streams do about self-collision.

    cost(q)  +  weight * sum_p max(0, clearance_p - distance_p(q))^2

over the pairs of collision shapes (`SelfCollision`). Where no pair is nearer than its clearance, an answer stays as it
is, to the bit. Elsewhere damped Gauss-Newton steps go on from it, in all joints together, which foresee what pairs
will be near after them (`mrhubo.fast.plain.contact_steps`). The second term begins at zero where a pair comes near, so
an answer that follows the human into a touch gives way gradually and does not leap.

Who needs every frame free, at any price, asks `collision_free`; who needs it within the limits of joints' speeds, or at
once, asks here: nearly all frames become free (docs/results.md), and who is not is still told so.

Legend: B frames of their own, T frames of a motion, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from mrhubo.fast.plain.avoidance import CLEARANCE, STEPS, WEIGHT, WORTH
from mrhubo.fast.plain.contact_steps import REACH
from mrhubo.fast.plain.steps import DAMPING, EASIER, HARDER, LEAST, MOST, STUCK
from mrhubo.fast.plain.steps import TOLERANCE as STILL
from mrhubo.fast.together.avoiding import SWEEPS, TOLERANCE
from mrhubo.reference.contact_steps import Contacts, foreseeing_step
from mrhubo.reference.refine import refine_around, widen
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.speed import keep_speed
from mrhubo.reference.terms import Quadratic, SelfCollisionTerm, Smoothness, Term
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

    def forward(self, q_BN: Tensor, target_BD3: Tensor, staying: bool = False) -> Tensor:
        """Joint angles (B, N) [rad], inside the limits, of which as few as possible touch.

        Args:
            q_BN: where to begin [rad], inside the limits.
            target_BD3: the human's directions.
            staying: those that touch keep to their own directions, and not to the human's: who goes from one frame to
                the next knows where the arm is on its way to, and is not to give way to another place.
        """
        row_X = torch.nonzero(self.close(q_BN))[:, 0]
        if not len(row_X):
            return q_BN
        found = []
        for x in row_X.split(self.problem.chunk):
            target_XD3 = self._own_directions(q_BN[x], target_BD3[x]) if staying else target_BD3[x]
            found.append(self._give_way(q_BN[x], target_XD3))
        return q_BN.index_copy(0, row_X, torch.cat(found))

    def _own_directions(self, q_BN: Tensor, target_BD3: Tensor) -> Tensor:
        """Targets with the robot's directions in place of the human's, which count as much."""
        body_map = self.problem.body_map
        own_BD3 = body_map.robot_directions(body_map.robot.forward(q_BN))
        human_BD3, more_BX3 = target_BD3[:, : own_BD3.shape[1]], target_BD3[:, own_BD3.shape[1] :]
        return torch.cat((own_BD3 * human_BD3.norm(dim=-1, keepdim=True), more_BX3), dim=1)

    def _give_way(self, q_BN: Tensor, target_BD3: Tensor) -> Tensor:
        bounds = self.problem.lower_N, self.problem.upper_N
        found_BN, row_B = q_BN.clone(), torch.arange(len(q_BN), device=q_BN.device)
        damping_B = q_BN.new_full((len(q_BN),), DAMPING)
        cost_B, model, touching = self._look(q_BN, target_BD3)
        for _ in range(STEPS):
            trial_BN, won_B = foreseeing_step(bounds, q_BN, model, damping_B, touching)
            worth_B = won_B > WORTH
            if not bool(worth_B.any()):
                break
            row_B, q_BN, trial_BN, target_BD3, cost_B, damping_B = (
                own_B[worth_B] for own_B in (row_B, q_BN, trial_BN, target_BD3, cost_B, damping_B)
            )
            trial_cost_B, model, touching = self._look(trial_BN, target_BD3)
            better_B, moved_B = trial_cost_B < cost_B, (trial_BN - q_BN).abs().amax(dim=1)
            found_BN[row_B[better_B]] = trial_BN[better_B]
            going_B = ~((moved_B < STILL) | (~better_B & (damping_B > STUCK)))
            if not bool(going_B.any()):
                break
            q_BN, cost_B = torch.where(better_B[:, None], trial_BN, q_BN), torch.where(better_B, trial_cost_B, cost_B)
            damping_B = (damping_B * torch.where(better_B, EASIER, HARDER)).clamp(LEAST, MOST)
            row_B, q_BN, target_BD3, cost_B, damping_B = (
                own_B[going_B] for own_B in (row_B, q_BN, target_BD3, cost_B, damping_B)
            )
            if bool(better_B[going_B].all()):
                model, touching = model.rows(going_B), touching.rows(going_B)
            else:  # some are where they were
                _, model, touching = self._look(q_BN, target_BD3)
        return found_BN

    def _look(self, q_BN: Tensor, target_BD3: Tensor) -> tuple[Tensor, Quadratic, Contacts]:
        """What frames cost (B,), the model of that without contacts, and the contacts."""
        state = self.problem.state(q_BN, target_BD3)
        model, scale = self.problem.quadratic_at(state, self.contact), self.contact.weight**0.5
        short_X, rows_XN, row_X = self.contact.residual(state, REACH)
        touching = Contacts(row_X, scale * short_X, scale * rows_XN)
        return model.cost_BC[:, 0] + touching.costs(touching.short_X, len(q_BN)), model, touching

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
