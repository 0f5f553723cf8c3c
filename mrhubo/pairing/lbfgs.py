"""The solver that ours is measured against: the paper's L-BFGS over 500 poses at a time.

Legend: B batch, K used keypoints, Z latent numbers.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.body.latent import LatentProblem

_GROUP = 500
_ITERATIONS = 500


def solve_lbfgs(problem: LatentProblem, target_BK3: Tensor) -> Tensor:
    """Latents (B, Z) as the paper finds them: L-BFGS with strong Wolfe search on the summed cost of 500 poses at a
    time.

    Up to 500 iterations from z = 0; one step length and one stop for all 500 poses.
    """
    found = []
    for target in target_BK3.split(_GROUP):
        z = torch.zeros(len(target), problem.latent, device=target.device, requires_grad=True)
        optimizer = torch.optim.LBFGS([z], lr=1.0, max_iter=_ITERATIONS, line_search_fn="strong_wolfe")

        def closure(z: Tensor = z, target: Tensor = target, optimizer: torch.optim.LBFGS = optimizer) -> Tensor:
            optimizer.zero_grad()
            cost = problem.cost(z, target).sum()
            cost.backward()
            return cost

        optimizer.step(closure)  # type: ignore[arg-type]
        found.append(z.detach())
    return torch.cat(found)
