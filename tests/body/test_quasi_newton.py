"""The quasi-Newton search in the latent space, on targets that robots set and on targets that a human can reach."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mrhubo.body import BodyPrior, Skeleton, quasi_newton
from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton
from mrhubo.pairing import solve_lbfgs

MakeProblem = Callable[..., tuple[LatentProblem, Tensor]]
ROBOTS = ["nao", "coman", "reachy"]


def test_the_first_guess_is_the_best_of_the_samples() -> None:
    prior = BodyPrior.open()
    problem = LatentProblem(prior.decoder, Skeleton(), [18, 19, 20, 21])
    target = problem.keypoints_of(torch.randn(30, prior.latent, generator=torch.Generator().manual_seed(2)))
    start = nearest_samples(problem, target)
    torch.testing.assert_close(start, nearest_samples(problem, target))
    others = torch.randn(4_096, prior.latent, generator=torch.Generator().manual_seed(0))
    for i in range(3):
        best = problem.cost(others, target[i : i + 1].expand(4_096, -1, -1)).min()
        assert float(problem.cost(start[i : i + 1], target[i : i + 1])) == pytest.approx(float(best), rel=1e-3)
    solved = problem.cost(solve_quasi_newton(problem, start, target, 40), target)
    assert bool((solved <= problem.cost(start, target)).all())


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_optimum_near_the_start_is_found(latent_problem: MakeProblem, robot: str) -> None:
    problem, _ = latent_problem(robot)
    generator = torch.Generator().manual_seed(0)
    truth = 0.6 * torch.randn(40, problem.latent, generator=generator)
    target = problem.keypoints_of(truth)
    start = truth + 0.2 * torch.randn(40, problem.latent, generator=generator)
    found = solve_quasi_newton(problem, start, target, 200, tolerance=1e-7)
    before, after = problem.cost(start, target), problem.cost(found, target)
    assert bool((after <= before).all()), "no pose gets worse"
    assert bool((after <= problem.cost(truth, target) + 1e-3).float().mean() > 0.97)
    _, gradient_before = problem.normal_equations(start, target)
    _, gradient_after = problem.normal_equations(found, target)
    assert float(gradient_after.norm(dim=1).median()) < 1e-2 * float(gradient_before.norm(dim=1).median())


@pytest.mark.parametrize(("w_prior", "share"), [(0.01, 0.99), (0.001, 0.7)])  # VPoser's weight, and the pairs' own
def test_it_improves_on_lbfgs(latent_problem: MakeProblem, w_prior: float, share: float) -> None:
    problem, target = latent_problem("nao", w_prior)
    start = solve_lbfgs(problem, target := target[:40])
    found = solve_quasi_newton(problem, start, target, 100, tolerance=1e-4)
    assert bool((problem.cost(found, target) <= problem.cost(start, target)).all())
    assert float(problem.cost(found, target).mean()) < share * float(problem.cost(start, target).mean())


def test_poses_are_solved_independently_of_their_batch(
    latent_problem: MakeProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, target = latent_problem("nao")
    start = nearest_samples(problem, target)

    def cost(count: int) -> torch.Tensor:
        found = solve_quasi_newton(problem, start[:count], target[:count], 120, 1e-6)
        return problem.cost(found, target[:count])

    together, alone = cost(60)[:25], cost(25)
    monkeypatch.setitem(quasi_newton._WIDTH, "cpu", 20)  # poses take turns
    in_turns = cost(60)[:25]
    for other in (alone, in_turns):  # rounding leads a pose in ten to another minimum, of much the same cost
        assert float((other - together).abs().median()) < 1e-3
        assert float(other.mean()) == pytest.approx(float(together.mean()), rel=0.03)


@pytest.mark.parametrize("count", [0, 1])
def test_few_poses_are_no_special_case(latent_problem: MakeProblem, count: int) -> None:
    problem, target = latent_problem("nao")
    start = torch.zeros(count, problem.latent)
    found = solve_quasi_newton(problem, start, target[:count], 20)
    assert found.shape == start.shape
    assert bool((problem.cost(found, target[:count]) < problem.cost(start, target[:count])).all())


def test_no_more_steps_are_taken_than_asked_for(latent_problem: MakeProblem) -> None:
    problem, target = latent_problem("nao")
    start = nearest_samples(problem, target)
    costs = [problem.cost(solve_quasi_newton(problem, start, target, n), target) for n in (1, 5, 25)]
    first = problem.cost(start, target)
    assert bool((costs[0] <= first).all()) and float(costs[0].mean()) < float(first.mean())
    assert float(costs[2].mean()) < float(costs[1].mean()) < float(costs[0].mean())


def test_an_impossible_target_gives_a_finite_answer(latent_problem: MakeProblem) -> None:
    problem, target = latent_problem("nao")
    far = target + 1e3
    found = solve_quasi_newton(problem, torch.zeros(200, problem.latent), far, 20)
    assert bool(torch.isfinite(found).all())
