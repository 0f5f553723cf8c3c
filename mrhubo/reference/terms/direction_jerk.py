"""The jerk of the robot's directions, as they are seen from their parts:

    sum_t  sum_d  weight_td * |third difference of direction d - goal_td|^2

Joints that turn evenly do not make limbs move evenly: where an arm lies along the axis of a joint, that joint has to
run so that the arm moves at all, and elsewhere the same turn moves it far. So what is seen of a motion needs a term of
its own. Its goal is most of the human's own third difference, for a|r - h|^2 + (1 - a)|r|^2 is, but for a constant,
|r - a h|^2: the share a of the weight is on what the robot does otherwise than the human, the rest on what it does.

Legend: T frames, Y = T - 3 differences of third order, X frames of some lag, D directions, E some of them, N joints,
M some of them, R = 3 E rows, C blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from mrhubo.reference.terms.differences import THIRD, bands, share, spread


@dataclass(frozen=True)
class DirectionJerk:
    """The term above."""

    weight_YD: Tensor
    """0 for directions that do not count."""
    goal_YD3: Tensor

    def at(self, frame_X: Tensor) -> DirectionJerk:
        """The same for some frames alone (X,), by their numbers."""
        return DirectionJerk(self.weight_YD[frame_X[3:] - 3], self.goal_YD3[frame_X[3:] - 3])

    def costs(self, direction_TD3: Tensor, directions_DC: Tensor) -> Tensor:
        """What each frame bears (T, C), for directions (T, D, 3)."""
        return share(self.weight_YD * self._off(direction_TD3).square().sum(-1), 3) @ directions_DC

    def gradient(self, direction_TD3: Tensor, jacobian_TD3N: Tensor) -> Tensor:
        """Half of the gradient (T, N), by the directions' Jacobian (T, D, 3, N) [1/rad]."""
        force_TR = spread((self.weight_YD[..., None] * self._off(direction_TD3)).flatten(1), THIRD)
        return (force_TR[:, None] @ jacobian_TD3N.flatten(1, 2))[:, 0]

    def hessian(self, jacobian_TE3M: Tensor, columns_E: Tensor) -> list[Tensor]:
        """Half of the Gauss-Newton Hessian of some joints, by how they turn the directions of some columns: entries
        within a frame (T, M, M), then between the joints of the next frame, the rows, and those of a frame (T - 1, M,
        M), of the one after that (T - 2, M, M), and so on; float64.
        """
        rows_TRM, found = jacobian_TE3M.double().flatten(1, 2), []
        for lag, band_XE in enumerate(bands(self.weight_YD[:, columns_E].double(), THIRD)):
            weighted_XRM = rows_TRM[: len(band_XE)] * band_XE.repeat_interleave(3, dim=1)[..., None]
            found.append(rows_TRM[lag:].mT @ weighted_XRM)
        return found

    def _off(self, direction_TD3: Tensor) -> Tensor:
        return direction_TD3.diff(n=3, dim=0) - self.goal_YD3
