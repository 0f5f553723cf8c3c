"""Joint angles whose directions match a human's, frame by frame: batched, bounded Levenberg-Marquardt.

    cost(q) = sum of the terms of `terms`,      lower <= q <= upper

Joints fall into blocks (left arm, right arm, neck) that share no summand, so the cost is a sum over blocks: each block
of each problem has its own damping, its own steps, and its own best start.

Legend: B problems, D directions, N joints, C blocks.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.jacobian import DirectionJacobian
from mrhubo.reference.terms import DirectionTerm, PostureTerm, Quadratic, State, Term
from mrhubo.robot import BodyMap

_CHUNK = {"cpu": 2048, "cuda": 65_536}


class DirectionProblem(nn.Module):
    """The cost of one body map: directions and posture, and any further terms."""

    def __init__(self, body_map: BodyMap, more: Sequence[Term] = ()) -> None:
        """`more` are terms besides directions and posture."""
        super().__init__()
        self.body_map, self.robot = body_map, body_map.robot
        self.kinematics = DirectionJacobian(body_map)
        self.directions = DirectionTerm(self.kinematics)
        self.posture = PostureTerm(self.robot.lower_N, self.robot.upper_N)
        terms = [self.directions, self.posture, *more]
        self.terms = nn.ModuleList(terms)
        couplings = [joints for term in terms for joints in term.couplings()]
        blocks = Blocks(couplings, len(self.robot.joint_names), len(body_map.directions))
        self.blocks = blocks.to(self.robot.lower_N.device)

    @property
    def lower_N(self) -> Tensor:
        """Lower joint limits [rad]."""
        return self.robot.lower_N

    @property
    def upper_N(self) -> Tensor:
        """Upper joint limits [rad]."""
        return self.robot.upper_N

    @property
    def device(self) -> torch.device:
        """Where it works."""
        return self.robot.lower_N.device

    @property
    def chunk(self) -> int:
        """How many problems are worked on at a time."""
        return _CHUNK["cpu" if self.device.type == "cpu" else "cuda"]

    def quadratic(self, q_BN: Tensor, target_BD3: Tensor) -> Quadratic:
        """Cost and Gauss-Newton model at joint angles (B, N) [rad] for human directions (B, D, 3)."""
        return self.quadratic_at(self.state(q_BN, target_BD3))

    def state(self, q_BN: Tensor, target_BD3: Tensor) -> State:
        """What terms are asked for at joint angles (B, N) [rad] for human directions (B, D, 3)."""
        poses = self.robot.forward(q_BN)
        return State(q_BN, poses, target_BD3, *self.kinematics.at(poses))

    def quadratic_at(self, state: State, without: Term | None = None) -> Quadratic:
        """As `quadratic`, of all terms, or all but one."""
        model: Quadratic | None = None
        for term in self.terms:
            assert isinstance(term, Term)
            if term is not without:
                model = term.add_to(model, state, self.blocks)
        assert model is not None
        return model

    def cost(self, q_BN: Tensor, target_BD3: Tensor) -> Tensor:
        """What each block costs (B, C) at joint angles (B, N) [rad]."""
        chunks = zip(q_BN.split(self.chunk), target_BD3.split(self.chunk), strict=True)
        return torch.cat([self.quadratic(*chunk).cost_BC for chunk in chunks])

    def weights(self, target_BD3: Tensor) -> Tensor:
        """How much the directions of each block count together (B, C): a block costs about this times the mean square
        of its angles to the human.
        """
        length_BD = target_BD3[:, : len(self.directions.weight_D)].norm(dim=-1)  # other terms' targets come after
        return (length_BD * self.directions.weight_D) @ self.blocks.directions_DC

    def frozen(self, q_BN: Tensor, gradient_BN: Tensor, bounds: tuple[Tensor, Tensor] | None = None) -> Tensor:
        """Active set (B, N): joints at a limit that the gradient's descent would push beyond it; limits are the joints'
        or `bounds`.
        """
        lower, upper = bounds or (self.lower_N, self.upper_N)
        return ((q_BN <= lower) & (gradient_BN > 0)) | ((q_BN >= upper) & (gradient_BN < 0))

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
            trial_BN = q_BN + self.step(q_BN, model, damping_BC[:, self.blocks.block_N])
            trial_BN = torch.clamp(trial_BN, self.lower_N, self.upper_N)
            trial = self.quadratic(trial_BN, target_BD3)
            better_BC = trial.cost_BC < model.cost_BC
            moved_BC = ((trial_BN - q_BN).abs()[..., None] * self.blocks.joints_NC).amax(dim=1)
            stopped_BC = (moved_BC < tolerance) | (~better_BC & (damping_BC > 1e3))
            q_BN = torch.where(better_BC[:, self.blocks.block_N], trial_BN, q_BN)
            model = model.where(better_BC, self.blocks.block_N, trial)
            damping_BC = torch.where(better_BC, damping_BC * 0.1, damping_BC * 10).clamp(1e-7, 1e6)
            found_BN[row_B], found_cost_BC[row_B] = q_BN, model.cost_BC
            going_B = ~stopped_BC.all(dim=1)
            if not bool(going_B.any()):
                break
            if not bool(going_B.all()):
                row_B, q_BN, target_BD3, model = row_B[going_B], q_BN[going_B], target_BD3[going_B], model.rows(going_B)
                damping_BC = damping_BC[going_B]
        return found_BN, found_cost_BC

    def step(
        self, q_BN: Tensor, model: Quadratic, damping_BN: Tensor, bounds: tuple[Tensor, Tensor] | None = None
    ) -> Tensor:
        """Damped Gauss-Newton step (B, N) [rad] of the joints that are not `frozen` at a limit; the others stay."""
        free_BN = (~self.frozen(q_BN, model.gradient_BN, bounds)).to(q_BN)
        diagonal_BN = model.hessian_BNN.diagonal(dim1=-2, dim2=-1)
        system_BNN = model.hessian_BNN * (free_BN[:, :, None] * free_BN[:, None, :])
        extra_BN = torch.where(free_BN > 0, damping_BN * (diagonal_BN + 0.01), torch.ones_like(diagonal_BN))
        system_BNN.diagonal(dim1=-2, dim2=-1).add_(extra_BN)
        factor_BNN = torch.linalg.cholesky_ex(system_BNN).L
        return -torch.cholesky_solve((model.gradient_BN * free_BN)[..., None], factor_BNN)[..., 0]
