"""The terms of a motion's cost that couple frames: joints move slowly and evenly.

    pull * sum_t |q_t - q_(t-1)|^2                                          velocity
    sum_t jerk_t * |q_t - 3 q_(t-1) + 3 q_(t-2) - q_(t-3)|^2                its second derivative in time

and, where it is asked for, the same of directions (`direction_jerk`), which is worked out apart: it needs more of the
robot than its joint angles. Whatever a term costs in several frames, each of them bears the same share of it.

Legend: T frames, X steps between them, Y = T - 3 differences of third order, N joints, C blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from mrhubo.reference.terms.differences import FIRST, THIRD, bands, share, spread
from mrhubo.reference.terms.direction_jerk import DirectionJerk


@dataclass(frozen=True)
class Smoothness:
    """The terms above."""

    pull: float
    """[1/rad^2]."""
    jerk_YN: Tensor | None = None
    """[1/rad^2]; None: it costs nothing."""
    directions: DirectionJerk | None = None
    """What the jerk of directions costs; None: nothing. It comes with that of the joints."""

    @property
    def reach(self) -> int:
        """How many frames before it a frame is coupled to."""
        return 1 if self.jerk_YN is None else 3

    @property
    def of_joints(self) -> Smoothness:
        """The joints' terms alone."""
        return replace(self, directions=None)

    def at(self, frame_X: Tensor) -> Smoothness:
        """The same for some frames alone (X,), by their numbers."""
        if self.jerk_YN is None:
            return self
        directions = None if self.directions is None else self.directions.at(frame_X)
        return Smoothness(self.pull, self.jerk_YN[frame_X[3:] - 3], directions)

    def costs(self, q_TN: Tensor, joints_NC: Tensor) -> Tensor:
        """What each frame bears of the joints' terms (T, C), for joint angles (T, N) [rad]."""
        cost_TN = share(self.pull * q_TN.diff(dim=0).square(), 1)
        if self.jerk_YN is not None and len(self.jerk_YN):
            cost_TN = cost_TN + share(self.jerk_YN * q_TN.diff(n=3, dim=0).square(), 3)
        return cost_TN @ joints_NC.to(q_TN)

    def gradient(self, q_TN: Tensor) -> Tensor:
        """Half of their gradient (T, N)."""
        gradient_TN = spread(self.pull * q_TN.diff(dim=0), FIRST)
        if self.jerk_YN is not None and len(self.jerk_YN):
            gradient_TN = gradient_TN + spread(self.jerk_YN * q_TN.diff(n=3, dim=0), THIRD)
        return gradient_TN

    def hessian(self, q_TN: Tensor) -> list[Tensor]:
        """Half of their Hessian: its diagonal (T, N), then its entries between each frame and the next (T - 1, N), the
        one after that (T - 2, N), and so on; float64, as what frames that move together cost is a millionth of them.
        """
        found = bands(torch.full_like(q_TN[1:], self.pull, dtype=torch.float64), FIRST)
        if self.jerk_YN is not None and len(self.jerk_YN):
            more = bands(self.jerk_YN.double(), THIRD)
            found = [found[0] + more[0], found[1] + more[1], *more[2:]]
        return found
