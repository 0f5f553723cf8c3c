"""Some joints of a whole motion give way to what the floor asks for, by the optimiser's cost with a term for that.

Legend: T frames, X those worked on together, D directions and rows of other terms, N joints, C blocks.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from mrhubo.fast.together.motion import AHEAD, WINDOW
from mrhubo.reference.avoidance import Avoidance
from mrhubo.reference.refine import refine_around
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.speed import nearest_slow, speed_bound
from mrhubo.reference.terms import Smoothness, Term
from mrhubo.robot import BodyMap

SWEEPS, TOLERANCE = 10, 3e-4
"""How long joints give way, as for `refine`."""


class GivingWay(nn.Module):
    """What moves some joints of one robot."""

    def __init__(self, body_map: BodyMap, terms: Sequence[Term], moved_N: Tensor) -> None:
        """`terms` are those besides directions and posture; `moved_N` says which joints give way."""
        super().__init__()
        self.body_map, self._given = body_map, tuple(terms)
        self.problem = DirectionProblem(body_map, self._given)
        self._moved_N = moved_N.to(self.problem.device)
        self._moved_C = self._moved_N.float() @ self.problem.blocks.joints_NC > 0
        self._avoidance: Avoidance | None = None

    @property
    def avoidance(self) -> Avoidance:
        """What makes answers give way that touch the robot itself, with the same terms; made when first asked for."""
        if self._avoidance is None:
            self._avoidance = Avoidance(self.body_map, self._given)
        return self._avoidance

    def forward(
        self,
        q_TN: Tensor,
        target_TX3: Tensor,
        free_T: Tensor,
        frame_rate: float,
        smoothness: Smoothness,
        avoid_collisions: bool,
    ) -> Tensor:
        """Joint angles (T, N) [rad] within limits and limits of speed, which differ in the frames that are free.

        Args:
            q_TN: where to begin [rad], within the limits.
            target_TX3: the person's directions, and after them the rows of the terms.
            free_T: frames that may change.
            frame_rate: frames per second.
            smoothness: of the motion.
            avoid_collisions: free frames in which the robot would touch itself give way, with all joints.
        """
        step_N, around = speed_bound(self.body_map.robot.velocity_N, frame_rate)
        found, settled = [q_TN[:0]], 0
        while settled < len(q_TN):
            before_LN = torch.cat(found[-2:])[-smoothness.reach :]
            part = slice(settled - len(before_LN), settled + WINDOW)
            motion_XN = torch.cat((before_LN, q_TN[settled : settled + WINDOW]))
            fixed_X = torch.arange(len(motion_XN), device=q_TN.device) < len(before_LN)
            fixed_X |= ~free_T[part]
            if not bool(fixed_X.all()):
                near = smoothness.at(torch.arange(len(q_TN), device=q_TN.device)[part])
                motion_XN = self._refine(motion_XN, target_TX3[part], near, step_N, fixed_X)
                if avoid_collisions:
                    motion_XN = self._apart(motion_XN, target_TX3[part], near, step_N, around, fixed_X)
            used = WINDOW - AHEAD if settled + WINDOW < len(q_TN) else WINDOW
            found.append(motion_XN[len(before_LN) :][:used])
            settled += used
        return nearest_slow(torch.cat(found), step_N)

    def _refine(
        self, q_XN: Tensor, target_XD3: Tensor, smoothness: Smoothness, step_N: Tensor, fixed_X: Tensor
    ) -> Tensor:
        """The best joints near others for some frames, of which the first are settled."""
        if len(q_XN) == 1:
            found_XN = self.problem.minimise(q_XN, target_XD3)[0]
        else:
            q_XN = nearest_slow(q_XN, step_N, fixed_X)
            found_XN = refine_around(
                self.problem, q_XN, target_XD3, smoothness, ~fixed_X, SWEEPS, TOLERANCE, step_N, self._moved_C
            )
            found_XN = nearest_slow(found_XN, step_N, fixed_X)
        return torch.where(self._moved_N, found_XN, q_XN)

    def _apart(
        self, q_XN: Tensor, target_XD3: Tensor, smoothness: Smoothness, step_N: Tensor, around: int, fixed_X: Tensor
    ) -> Tensor:
        """The same with frames that gave way where the robot would touch itself."""
        if len(q_XN) == 1:
            return self.avoidance(q_XN, target_XD3)
        return self.avoidance.in_motion(q_XN, target_XD3, smoothness, step_N, around, fixed_X)
