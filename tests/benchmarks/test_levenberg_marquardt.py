"""The Levenberg-Marquardt solver of the benchmarks, and how ours compares to it."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from levenberg_marquardt import solve_levenberg_marquardt
from torch import Tensor

from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton
from mrhubo.pairing import solve_lbfgs

MakeProblem = Callable[..., tuple[LatentProblem, Tensor]]
ROBOTS = ["nao", "coman", "reachy"]


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_optimum_near_the_start_is_found(latent_problem: MakeProblem, robot: str) -> None:
    problem, _ = latent_problem(robot)
    generator = torch.Generator().manual_seed(0)
    truth = 0.6 * torch.randn(100, problem.latent, generator=generator)
    target = problem.keypoints_of(truth)
    start = truth + 0.2 * torch.randn(100, problem.latent, generator=generator)
    found = solve_levenberg_marquardt(problem, start, target, 200, tolerance=1e-7)
    before, after = problem.cost(start, target), problem.cost(found, target)
    assert bool((after <= before).all()), "no pose gets worse"
    assert bool((after <= problem.cost(truth, target) + 1e-3).float().mean() > 0.97)
    _, gradient_before = problem.normal_equations(start, target)
    _, gradient_after = problem.normal_equations(found, target)
    assert float(gradient_after.norm(dim=1).median()) < 1e-2 * float(gradient_before.norm(dim=1).median())


@pytest.mark.parametrize(("w_prior", "share"), [(0.01, 0.99), (0.001, 0.7)])  # VPoser's weight, and the pairs' own
def test_it_improves_on_lbfgs(latent_problem: MakeProblem, w_prior: float, share: float) -> None:
    problem, target = latent_problem("nao", w_prior)
    start = solve_lbfgs(problem, target[:100])
    found = solve_levenberg_marquardt(problem, start, target[:100], 100, tolerance=1e-4)
    assert bool((problem.cost(found, target[:100]) <= problem.cost(start, target[:100])).all())
    assert float(problem.cost(found, target[:100]).mean()) < share * float(problem.cost(start, target[:100]).mean())


def test_an_impossible_target_gives_a_finite_answer(latent_problem: MakeProblem) -> None:
    problem, target = latent_problem("nao")
    far = target + 1e3
    found = solve_levenberg_marquardt(problem, torch.zeros(200, problem.latent), far, 20)
    assert bool(torch.isfinite(found).all())


@pytest.mark.parametrize("robot", ROBOTS)
def test_with_a_weak_prior_quasi_newton_ends_lower_than_levenberg_marquardt(
    latent_problem: MakeProblem, robot: str
) -> None:
    problem, target = latent_problem(robot, w_prior=0.001)
    start = nearest_samples(problem, target)
    ours = problem.cost(solve_quasi_newton(problem, start, target, 200, tolerance=1e-4), target)
    other = problem.cost(solve_levenberg_marquardt(problem, start, target, 200, tolerance=1e-6), target)
    assert float(ours.mean()) < 0.95 * float(other.mean())
