"""The reference retargeter's cost of a batch of branches, its gradient, and damped Gauss-Newton steps.

    cost(q) = sum_s w_s |t_s| |dir_s(q) - t_s / |t_s||^2  +  eps sum_n ((q_n - mid_n) / half_n)^2

as `mrhubo.reference.terms` has it; |t_s| is 1 but for bend axes, whose target's length is how much they count.

Legend: B problems, N joints, S slots of directions, K dampings.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.fast.plain.steps import FLOOR
from mrhubo.reference.terms.posture import EPSILON
from mrhubo.universal.chains import Local


@dataclass(frozen=True)
class Bounds:
    """Limits of joints."""

    lower_BN: Tensor
    upper_BN: Tensor
    """[rad]"""
    present_BN: Tensor
    """1 where there is a joint, else 0."""

    @property
    def middle_BN(self) -> Tensor:
        """The middle of the limits [rad]."""
        return (self.lower_BN + self.upper_BN) / 2

    @property
    def half_BN(self) -> Tensor:
        """Half of their range [rad]."""
        return (self.upper_BN - self.lower_BN) / 2

    def clip(self, q_BN: Tensor) -> Tensor:
        """The nearest angles inside the limits."""
        return torch.clamp(q_BN, self.lower_BN, self.upper_BN)


@dataclass(frozen=True)
class Quadratic:
    """Cost (B,), and halves of gradient (B, N) and Gauss-Newton Hessian (B, N, N); differences of directions."""

    cost_B: Tensor
    gradient_BN: Tensor
    hessian_BNN: Tensor
    miss_BS3: Tensor
    weight_BS: Tensor
    rows_BRN: Tensor
    """The weighted Jacobian (B, 3 S, N)."""


def quadratic(local: Local, q_BN: Tensor, bounds: Bounds, target_BS3: Tensor, weight_BS: Tensor) -> Quadratic:
    """The model around joint angles [rad]. The length of targets counts (1, but for bend axes), and so do weights."""
    length_BS = target_BS3.norm(dim=-1)
    unit_BS3 = target_BS3 / length_BS.clamp_min(1e-6)[..., None]
    weight_BS = weight_BS * length_BS
    miss_BS3 = (local.direction_BS3 - unit_BS3) * (weight_BS > 0)[..., None]
    root_BS = weight_BS.sqrt()
    rows_BRN = (local.jacobian_BS3N * root_BS[..., None, None]).flatten(1, 2)
    miss_BR1 = (miss_BS3 * root_BS[..., None]).flatten(1)[..., None]
    ridge_BN = EPSILON * bounds.present_BN / bounds.half_BN.square()
    away_BN = q_BN - bounds.middle_BN
    cost_B = (weight_BS * miss_BS3.square().sum(-1)).sum(-1) + (ridge_BN * away_BN.square()).sum(-1)
    gradient_BN = (rows_BRN.mT @ miss_BR1)[..., 0] + ridge_BN * away_BN
    hessian_BNN = rows_BRN.mT @ rows_BRN + torch.diag_embed(ridge_BN)
    return Quadratic(cost_B, gradient_BN, hessian_BNN, miss_BS3, weight_BS, rows_BRN)


def frozen(q_BN: Tensor, gradient_BN: Tensor, bounds: Bounds) -> Tensor:
    """1 (B, N) for joints at a limit beyond which descent would push them, and for those that are absent."""
    held = ((q_BN <= bounds.lower_BN) & (gradient_BN > 0)) | ((q_BN >= bounds.upper_BN) & (gradient_BN < 0))
    return (held | (bounds.present_BN == 0)).to(q_BN)


def steps(model: Quadratic, q_BN: Tensor, bounds: Bounds, damping_BK: Tensor) -> Tensor:
    """Damped Gauss-Newton steps (B, K, N) [rad] of the joints that no limit holds, clipped to the limits.

    A joint that a step would push beyond its limit goes there, and the others' steps are worked out again for that
    (once).
    """
    frozen_BN = frozen(q_BN, model.gradient_BN, bounds)[:, None]
    diagonal_BN = model.hessian_BNN.diagonal(dim1=-2, dim2=-1)[:, None]
    damped_BKNN = model.hessian_BNN[:, None] + torch.diag_embed(damping_BK[..., None] * (diagonal_BN + FLOOR))
    gradient_BKN = model.gradient_BN[:, None].expand(-1, damping_BK.shape[1], -1)
    lower_B1N, upper_B1N = (limit[:, None] for limit in (bounds.lower_BN - q_BN, bounds.upper_BN - q_BN))
    step_BKN = _solve(damped_BKNN, -gradient_BKN, frozen_BN.expand_as(gradient_BKN))
    fixed_BKN = torch.clamp(step_BKN, lower_B1N, upper_B1N)
    hits_BKN = (fixed_BKN != step_BKN).to(q_BN)
    held_BKN = torch.maximum(frozen_BN, hits_BKN)
    fixed_BKN = fixed_BKN * hits_BKN
    right_BKN = -gradient_BKN - (damped_BKNN @ fixed_BKN[..., None])[..., 0]
    return torch.clamp(_solve(damped_BKNN, right_BKN, held_BKN) + fixed_BKN, lower_B1N, upper_B1N)


def _solve(matrix_BKNN: Tensor, right_BKN: Tensor, held_BKN: Tensor) -> Tensor:
    """x (B, K, N) with A x = b among the components that are not held; those are 0."""
    free_BKN = 1 - held_BKN
    system_BKNN = matrix_BKNN * (free_BKN[..., :, None] * free_BKN[..., None, :]) + torch.diag_embed(held_BKN)
    factor_BKNN = torch.linalg.cholesky_ex(system_BKNN).L
    return torch.cholesky_solve((right_BKN * free_BKN)[..., None], factor_BKNN)[..., 0]
