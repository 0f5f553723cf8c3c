"""Latent inverse kinematics by Levenberg-Marquardt, which the program's own search is measured against.

Legend: B batch, K used keypoints, Z latent numbers.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.body.latent import LatentProblem


@torch.no_grad()
def solve_levenberg_marquardt(
    problem: LatentProblem, start_BZ: Tensor, target_BK3: Tensor, steps: int, tolerance: float = 1e-3
) -> Tensor:
    """Latents (B, Z) from the given start, each pose with its own damping and its own stop.

    A step is taken only if it lowers that pose's cost; a refused step raises the damping and solves again with the same
    normal equations. A pose leaves the batch when an accepted step lowers its cost by less than `tolerance` of it,
    or when its damping shows that no step helps.

    Args:
        problem: cost and derivatives.
        start_BZ: first guess.
        target_BK3: keypoints to reach [m].
        steps: most steps per pose, refused ones included.
        tolerance: relative decrease at which a pose counts as converged.
    """
    z_BZ = start_BZ.clone()
    cost_B = problem.cost(z_BZ, target_BK3)
    damping_B = torch.full_like(cost_B, 1e-2)
    active = torch.arange(len(z_BZ), device=z_BZ.device)
    matrix, gradient = problem.normal_equations(z_BZ, target_BK3)
    for step in range(steps):
        damping = damping_B[active]
        damped = matrix.clone()
        damped.diagonal(dim1=1, dim2=2).add_(damping[:, None])
        factor, _ = torch.linalg.cholesky_ex(damped)
        trial = z_BZ[active] - torch.cholesky_solve(gradient[..., None], factor)[..., 0]
        trial_cost = problem.cost(trial, target_BK3[active])
        before = cost_B[active]
        better = trial_cost < before  # False for NaN too
        taken = active[better]
        z_BZ[taken], cost_B[taken] = trial[better], trial_cost[better]
        damping_B[active] = torch.where(better, damping * 0.2, damping * 8.0)
        done = torch.where(better, before - trial_cost < tolerance * before, damping > 1e4)
        if step + 1 == steps or bool(done.all()):
            break
        stay = ~done
        active, matrix, gradient, moved = active[stay], matrix[stay], gradient[stay], better[stay]
        again = active[moved]
        if len(again):
            matrix[moved], gradient[moved] = problem.normal_equations(z_BZ[again], target_BK3[again])
    return z_BZ
