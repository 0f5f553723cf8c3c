"""Joint angles whose directions match a human's, frame by frame: batched, bounded Levenberg-Marquardt.

    cost(q) = sum_d w_d |dir_d(q) - dir_d(H)|^2  +  eps * sum_n ((q_n - mid_n) / half_n)^2,      lower <= q <= upper

The small second term makes a choice where the directions leave one (redundant joints, the twist of a straight arm), the
same choice for similar poses. Joints fall into blocks (left arm, right arm, neck) that turn different directions, so
the cost is a sum over blocks: each block of each problem has its own damping, its own steps, and its own best start.

Legend: B problems, D directions, R rows of their Jacobian (three per direction), N joints, C blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.reference.jacobian import DirectionJacobian
from mrhubo.robot import BodyMap

_CHUNK = {"cpu": 2048, "cuda": 65_536}


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


class DirectionProblem:
    """The cost above for one body map, on the device on which the body map is when this is built."""

    def __init__(self, body_map: BodyMap, regularisation: float = 1e-4, hand_weight: float = 0.5) -> None:
        self.body_map, self.robot = body_map, body_map.robot
        self.kinematics = DirectionJacobian(body_map)
        self.lower_N, self.upper_N = self.robot.lower_N, self.robot.upper_N
        self.device = self.lower_N.device
        self.mid_N, self.half_N = (self.upper_N + self.lower_N) / 2, (self.upper_N - self.lower_N) / 2
        self.ridge_N = regularisation / self.half_N.square()
        weights = [hand_weight if "hand" in name else 1.0 for name in body_map.direction_names]
        self.weight_D = torch.tensor(weights, device=self.device)
        blocks = self.kinematics.blocks
        self.block_N = torch.tensor([next(c for c, (_, joints) in enumerate(blocks) if n in joints)
                                     for n in range(len(self.lower_N))], device=self.device)  # fmt: skip
        self.joints_NC = torch.stack([self.block_N == c for c in range(len(blocks))], dim=1).float()
        self.directions_DC = torch.tensor([[float(d in directions) for directions, _ in blocks]
                                           for d in range(len(weights))], device=self.device)  # fmt: skip

    @property
    def chunk(self) -> int:
        """How many problems are worked on at a time."""
        return _CHUNK["cpu" if self.device.type == "cpu" else "cuda"]

    def quadratic(self, q_BN: Tensor, target_BD3: Tensor) -> Quadratic:
        """Cost and Gauss-Newton model at joint angles (B, N) [rad] for human directions (B, D, 3)."""
        directions_BD3, jacobian_BD3N = self.kinematics.forward(q_BN)
        miss_BD3, root_D = directions_BD3 - target_BD3, self.weight_D.sqrt()
        from_mid_BN = q_BN - self.mid_N
        cost_BC = (miss_BD3.square().sum(-1) * self.weight_D) @ self.directions_DC
        cost_BC = cost_BC + (from_mid_BN.square() * self.ridge_N) @ self.joints_NC
        rows_BRN = (jacobian_BD3N * root_D[:, None, None]).flatten(1, 2)
        miss_BR1 = (miss_BD3 * root_D[:, None]).flatten(1)[..., None]
        gradient_BN = (rows_BRN.mT @ miss_BR1)[..., 0] + from_mid_BN * self.ridge_N
        return Quadratic(cost_BC, gradient_BN, rows_BRN.mT @ rows_BRN + torch.diag(self.ridge_N))

    def frozen(self, q_BN: Tensor, gradient_BN: Tensor) -> Tensor:
        """Active set (B, N): joints at a limit that the gradient's descent would push beyond it."""
        return ((q_BN <= self.lower_N) & (gradient_BN > 0)) | ((q_BN >= self.upper_N) & (gradient_BN < 0))

    def minimise(
        self, q_BN: Tensor, target_BD3: Tensor, steps: int = 40, tolerance: float = 1e-4
    ) -> tuple[Tensor, Tensor]:
        """Local minima (B, N) [rad] from starting angles inside the limits, and the cost of each block there (B, C).

        A block's step counts only if its cost falls, which also steers the block's damping. Problems whose blocks have
        all stopped (step under `tolerance` rad, or no step helps) leave the batch.
        """
        chunks = zip(q_BN.split(self.chunk), target_BD3.split(self.chunk), strict=True)
        found = [self._minimise_chunk(*chunk, steps, tolerance) for chunk in chunks]
        return torch.cat([q for q, _ in found]), torch.cat([cost for _, cost in found])

    def _minimise_chunk(self, q_BN: Tensor, target_BD3: Tensor, steps: int, tolerance: float) -> tuple[Tensor, Tensor]:
        model = self.quadratic(q_BN, target_BD3)
        found_BN, found_cost_BC = q_BN.clone(), model.cost_BC.clone()
        damping_BC = torch.full_like(model.cost_BC, 1e-2)
        row_B = torch.arange(len(q_BN), device=q_BN.device)
        for _ in range(steps):
            trial_BN = q_BN + self.step(q_BN, model, damping_BC[:, self.block_N])
            trial_BN = torch.clamp(trial_BN, self.lower_N, self.upper_N)
            trial = self.quadratic(trial_BN, target_BD3)
            better_BC = trial.cost_BC < model.cost_BC
            moved_BC = ((trial_BN - q_BN).abs()[..., None] * self.joints_NC).amax(dim=1)
            stopped_BC = (moved_BC < tolerance) | (~better_BC & (damping_BC > 1e3))
            q_BN = torch.where(better_BC[:, self.block_N], trial_BN, q_BN)
            model = model.where(better_BC, self.block_N, trial)
            damping_BC = torch.where(better_BC, damping_BC * 0.1, damping_BC * 10).clamp(1e-7, 1e6)
            found_BN[row_B], found_cost_BC[row_B] = q_BN, model.cost_BC
            going_B = ~stopped_BC.all(dim=1)
            if not bool(going_B.any()):
                break
            if not bool(going_B.all()):
                row_B, q_BN, target_BD3, model = row_B[going_B], q_BN[going_B], target_BD3[going_B], model.rows(going_B)
                damping_BC = damping_BC[going_B]
        return found_BN, found_cost_BC

    def step(self, q_BN: Tensor, model: Quadratic, damping_BN: Tensor) -> Tensor:
        """Damped Gauss-Newton step (B, N) [rad] of the joints that are not frozen at a limit; the others stay."""
        free_BN = (~self.frozen(q_BN, model.gradient_BN)).to(q_BN)
        diagonal_BN = model.hessian_BNN.diagonal(dim1=-2, dim2=-1)
        system_BNN = model.hessian_BNN * (free_BN[:, :, None] * free_BN[:, None, :])
        extra_BN = torch.where(free_BN > 0, damping_BN * (diagonal_BN + 0.01), torch.ones_like(diagonal_BN))
        system_BNN.diagonal(dim1=-2, dim2=-1).add_(extra_BN)
        factor_BNN = torch.linalg.cholesky_ex(system_BNN).L
        return -torch.cholesky_solve((model.gradient_BN * free_BN)[..., None], factor_BNN)[..., 0]
