"""The Levenberg-Marquardt solver of the benchmarks, and how ours compares to it."""

from __future__ import annotations

from collections.abc import Callable

import torch
from levenberg_marquardt import solve_levenberg_marquardt
from torch import Tensor

from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton

MakeProblem = Callable[..., tuple[LatentProblem, Tensor]]


def test_the_optimum_near_the_start_is_found(latent_problem: MakeProblem) -> None:
    problem, _ = latent_problem("nao")
    generator = torch.Generator().manual_seed(0)
    truth = 0.6 * torch.randn(40, problem.latent, generator=generator)
    target = problem.keypoints_of(truth)
    start = truth + 0.2 * torch.randn(40, problem.latent, generator=generator)
    found = solve_levenberg_marquardt(problem, start, target, 200, tolerance=1e-7)
    before, after = problem.cost(start, target), problem.cost(found, target)
    assert bool((after <= before).all()), "no pose gets worse"
    assert bool((after <= problem.cost(truth, target) + 1e-3).float().mean() > 0.97)
    _, gradient_before = problem.normal_equations(start, target)
    _, gradient_after = problem.normal_equations(found, target)
    assert float(gradient_after.norm(dim=1).median()) < 1e-2 * float(gradient_before.norm(dim=1).median())


def test_an_impossible_target_gives_a_finite_answer(latent_problem: MakeProblem) -> None:
    problem, target = latent_problem("nao")
    far = target + 1e3
    found = solve_levenberg_marquardt(problem, torch.zeros(200, problem.latent), far, 20)
    assert bool(torch.isfinite(found).all())


def test_with_a_weak_prior_quasi_newton_ends_lower_than_levenberg_marquardt(latent_problem: MakeProblem) -> None:
    problem, target = latent_problem("coman", w_prior=0.001)
    target = target[:30]
    start = nearest_samples(problem, target)
    ours = problem.cost(solve_quasi_newton(problem, start, target, 200, tolerance=1e-4), target)
    other = problem.cost(solve_levenberg_marquardt(problem, start, target, 200, tolerance=1e-6), target)
    assert float(ours.mean()) < 0.95 * float(other.mean())
