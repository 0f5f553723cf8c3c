"""Where the search for joint angles starts: robot poses of a fixed random pool whose directions are near the human's.

Blocks of joints (see `solve`) choose from the pool independently: the nearest pose in each of S cells of the joint
space, so that solutions far from each other (elbow up, elbow down) are all found.

Legend: B frames, S starts, D directions, N joints, C blocks, U poses in the pool.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference.solve import DirectionProblem

_POOL = 8192


class StartPool:
    """Random robot poses with their directions, sorted into cells; the same for the same seed."""

    def __init__(self, problem: DirectionProblem, starts: int, seed: int) -> None:
        self.problem, self.starts = problem, starts
        self._q_UN = problem.robot.sample(_POOL, torch.Generator().manual_seed(seed))
        directions_UD3 = problem.body_map.robot_directions(problem.robot.forward(self._q_UN))
        from_mid_UN = (self._q_UN - problem.mid_N) / problem.half_N
        ridge_UN = (self._q_UN - problem.mid_N).square() * problem.ridge_N
        self._blocks = []
        for block, joints_N in enumerate(problem.joints_NC.T.bool()):
            directions_D = problem.directions_DC[:, block].bool()
            root_D1 = problem.weight_D[directions_D].sqrt()[:, None]
            pool_UX = (directions_UD3[:, directions_D] * root_D1).flatten(1)
            # |a - b|^2 without |a|^2, which is the same for the whole pool
            constant_U = pool_UX.square().sum(1) + ridge_UN[:, joints_N].sum(1)
            cells = [(pool_UX[cell_U].T.contiguous(), constant_U[cell_U], self._q_UN[cell_U][:, joints_N])
                     for cell_U in _cells(from_mid_UN[:, joints_N], starts)]  # fmt: skip
            self._blocks.append((joints_N, directions_D, root_D1, cells))

    def near(self, target_BD3: Tensor) -> Tensor:
        """Starting angles (B, S, N) [rad] for human directions (B, D, 3)."""
        start_BSN = self._q_UN.new_empty(len(target_BD3), self.starts, self._q_UN.shape[1])
        for joints_N, directions_D, root_D1, cells in self._blocks:
            wanted_BX = (target_BD3[:, directions_D] * root_D1).flatten(1)
            for start, (pool_XU, constant_U, q_UN) in enumerate(cells):
                nearest_B = torch.addmm(constant_U, wanted_BX, pool_XU, alpha=-2).argmin(1)
                start_BSN[:, start, joints_N] = q_UN[nearest_B]
        return start_BSN


def _cells(points_UX: Tensor, count: int) -> list[Tensor]:
    """Indices of the points nearest to each centre: the middle one first, then always the one farthest from all."""
    centre = int(points_UX.norm(dim=1).argmin())
    distance_UK = (points_UX - points_UX[centre]).norm(dim=1)[:, None]
    for _ in range(count - 1):
        centre = int(distance_UK.amin(1).argmax())
        distance_UK = torch.cat((distance_UK, (points_UX - points_UX[centre]).norm(dim=1)[:, None]), dim=1)
    cell_U = distance_UK.argmin(1)
    return [torch.nonzero(cell_U == k)[:, 0] for k in range(count)]
