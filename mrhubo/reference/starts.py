"""Where the search for joint angles starts: robot poses of a fixed random pool whose directions are near the human's.

Blocks of joints (see `solve`) choose from the pool independently: the nearest pose in each of S cells of the joint
space, so that solutions far from each other (elbow up, elbow down) are all found.

Legend: B frames, S starts, D directions, N joints, C blocks, U poses in the pool.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mrhubo.reference.solve import DirectionProblem

_POOL = 8192


class StartPool(nn.Module):
    """Random robot poses with their directions, sorted into cells; the same for the same seed."""

    q_UN: Tensor
    cells_CU: Tensor
    """In which cell of its joints' space each pose is, for each block."""

    def __init__(self, problem: DirectionProblem, starts: int, seed: int, poses: int = _POOL) -> None:
        """`starts` per frame; `seed` and number of the poses."""
        super().__init__()
        self.starts = starts
        q_UN = problem.robot.sample(poses, torch.Generator().manual_seed(seed))
        self.register_buffer("q_UN", q_UN, persistent=False)
        directions_UD3 = problem.body_map.robot_directions(problem.robot.forward(q_UN))
        posture, blocks, weight_D = problem.posture, problem.blocks, problem.directions.weight_D
        from_mid_UN = (q_UN - posture.mid_N) / posture.half_N
        ridge_UN = (q_UN - posture.mid_N).square() * posture.ridge_N
        parts, cells_CU = [], []
        for block, joints_N in enumerate(blocks.joints_NC.T.bool()):
            directions_D = blocks.directions_DC[:, block].bool()
            root_D1 = weight_D[directions_D].sqrt()[:, None]
            pool_UX = (directions_UD3[:, directions_D] * root_D1).flatten(1)
            # |a - b|^2 without |a|^2, which is the same for the whole pool
            constant_U = pool_UX.square().sum(1) + ridge_UN[:, joints_N].sum(1)
            cells_CU.append(_cells(from_mid_UN[:, joints_N], starts))
            rows = [torch.nonzero(cells_CU[-1] == k)[:, 0] for k in range(starts)]
            cells = [_Cell(pool_UX[cell_U].T.contiguous(), constant_U[cell_U], q_UN[cell_U][:, joints_N])
                     for cell_U in rows]  # fmt: skip
            parts.append(_BlockPool(joints_N, directions_D, root_D1, cells))
        self.blocks = nn.ModuleList(parts)
        self.register_buffer("cells_CU", torch.stack(cells_CU), persistent=False)

    def near(self, target_BD3: Tensor) -> Tensor:
        """Starting angles (B, S, N) [rad] for human directions (B, D, 3)."""
        start_BSN = self.q_UN.new_empty(len(target_BD3), self.starts, self.q_UN.shape[1])
        for block in self.blocks:
            assert isinstance(block, _BlockPool)
            wanted_BX = (target_BD3[:, block.directions_D] * block.root_D1).flatten(1)
            for start, cell in enumerate(block.cells):
                start_BSN[:, start, block.joints_N] = cell(wanted_BX)
        return start_BSN


class _Cell(nn.Module):
    """The poses of one cell: of one block the weighted directions, what they cost anyway, and the joint angles."""

    pool_XU: Tensor
    constant_U: Tensor
    q_UN: Tensor

    def __init__(self, pool_XU: Tensor, constant_U: Tensor, q_UN: Tensor) -> None:
        super().__init__()
        for name, tensor in (("pool_XU", pool_XU), ("constant_U", constant_U), ("q_UN", q_UN)):
            self.register_buffer(name, tensor, persistent=False)

    def forward(self, wanted_BX: Tensor) -> Tensor:
        """Joint angles (B, N) of the block, of the cheapest pose for each of these weighted directions (B, X)."""
        return self.q_UN[torch.addmm(self.constant_U, wanted_BX, self.pool_XU, alpha=-2).argmin(1)]


class _BlockPool(nn.Module):
    """The cells of one block, and which joints and directions are its own."""

    joints_N: Tensor
    directions_D: Tensor
    root_D1: Tensor

    def __init__(self, joints_N: Tensor, directions_D: Tensor, root_D1: Tensor, cells: list[_Cell]) -> None:
        super().__init__()
        for name, tensor in (("joints_N", joints_N), ("directions_D", directions_D), ("root_D1", root_D1)):
            self.register_buffer(name, tensor, persistent=False)
        self.cells = nn.ModuleList(cells)


def _cells(points_UX: Tensor, count: int) -> Tensor:
    """To which centre each point (U,) is nearest: the middle one first, then always the one farthest from all."""
    centre = int(points_UX.norm(dim=1).argmin())
    distance_UK = (points_UX - points_UX[centre]).norm(dim=1)[:, None]
    for _ in range(count - 1):
        centre = int(distance_UK.amin(1).argmax())
        distance_UK = torch.cat((distance_UK, (points_UX - points_UX[centre]).norm(dim=1)[:, None]), dim=1)
    return distance_UK.argmin(1)
