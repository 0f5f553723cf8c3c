"""Levenberg-Marquardt on a batch of branches, each with its own damping, as `mrhubo.reference.solve` makes it.

Legend: B branches, N joints, U random angles, S starts.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.universal.problem import Problem, choose


def minimise(problem: Problem, q_BN: Tensor, iterations: int) -> tuple[Tensor, Tensor]:
    """Joint angles (B, N) [rad] after so many steps, and their cost (B,), never more than that of the given ones."""
    place = problem.at(q_BN)
    damping_B = torch.full_like(place.model.cost_B, 1e-2)
    for _ in range(iterations):
        trial = place.moved(place.steps(damping_B[:, None])[:, 0])
        better_B = trial.model.cost_B < place.model.cost_B
        damping_B = torch.where(better_B, damping_B * 0.1, damping_B * 10.0).clamp(1e-7, 1e6)
        place = choose(place, trial)
    return place.q_BN, place.model.cost_B


@torch.no_grad()
def search(
    problem: Problem, generator: torch.Generator, tried: int = 32, starts: int = 8, iterations: int = 12
) -> tuple[Tensor, Tensor]:
    """The best angles (B, N) [rad] that are found from several starts, and their cost (B,).

    Args:
        problem: B branches and targets.
        generator: of what is random.
        tried: random angles per branch, of which the cheapest are starts, besides the middle of the ranges.
        starts: how many.
        iterations: steps from each; the best is then converged.
    """
    bounds, count = problem.bounds, len(problem.target_BS3)
    angles, costs = [bounds.middle_BN], [problem.at(bounds.middle_BN).model.cost_B - 1e9]  # always among them
    for _ in range(tried):
        unit_BN = torch.rand(bounds.lower_BN.shape, generator=generator).to(bounds.lower_BN)
        angles.append(bounds.lower_BN + unit_BN * (bounds.upper_BN - bounds.lower_BN))
        costs.append(problem.at(angles[-1]).model.cost_B)
    best_BS = torch.stack(costs, dim=1).topk(starts, dim=1, largest=False).indices
    row_B1 = torch.arange(count, device=best_BS.device)[:, None]
    start_BSN = torch.stack(angles, dim=1)[row_B1, best_BS]
    row_X = torch.arange(count, device=best_BS.device).repeat_interleave(starts)
    q_XN, cost_X = minimise(problem.rows(row_X), start_BSN.flatten(0, 1), iterations)
    best_B = cost_X.unflatten(0, (count, starts)).argmin(dim=1)
    return minimise(problem, q_XN.unflatten(0, (count, starts))[row_B1[:, 0], best_B], iterations)
