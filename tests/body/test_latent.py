"""The analytic derivatives against automatic differentiation, the solvers against each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from mrhubo.body import KEYPOINT_NAMES, BodyPrior, inverse
from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton
from mrhubo.body.skeleton import Skeleton, keypoint_indices
from mrhubo.config import load_config
from mrhubo.pairing import solve_lbfgs, solve_levenberg_marquardt
from mrhubo.robot import build_body_map

Solver = Callable[..., torch.Tensor]
ROBOTS = ["nao", "coman", "reachy"]


def problem_of(root: Path, robot: str, w_prior: float = 0.01) -> tuple[LatentProblem, torch.Tensor]:
    body_map = build_body_map(load_config(root / "conf" / f"{robot}.yaml").robot)
    problem = LatentProblem(BodyPrior.open(), body_map.skeleton, body_map.keypoint_indices, w_prior=w_prior)
    q = body_map.robot.sample(200, torch.Generator().manual_seed(3))
    return problem, body_map.targets(body_map.robot.forward(q))


@pytest.mark.parametrize("names", [KEYPOINT_NAMES, ("left_wrist",), ("head", "right_eye", "left_toe")])
def test_jacobian_agrees_with_autograd(names: tuple[str, ...]) -> None:
    prior, skeleton = BodyPrior.open(), Skeleton()
    problem = LatentProblem(prior, skeleton, keypoint_indices(names))
    z = torch.randn(6, prior.latent, generator=torch.Generator().manual_seed(0))
    points, jacobian = problem.linearise(z)
    torch.testing.assert_close(points, problem.keypoints_of(z), atol=1e-6, rtol=0)
    for i in range(len(z)):
        expected = torch.autograd.functional.jacobian(lambda v: problem.keypoints_of(v[None])[0].flatten(), z[i])
        torch.testing.assert_close(jacobian[i], expected, atol=2e-6, rtol=1e-4)


@pytest.mark.parametrize("names", [KEYPOINT_NAMES, ("left_wrist",), ("head", "right_eye", "left_toe"), ("left_hip",)])
def test_cost_and_gradient_agree_with_autograd(names: tuple[str, ...]) -> None:
    prior = BodyPrior.open()
    longer = Skeleton(1.1 * Skeleton().offsets_J3, 0.9 * Skeleton().point_offsets_E3)
    problem = LatentProblem(prior, longer, keypoint_indices(names), w_data=70.0, w_prior=0.02)
    generator = torch.Generator().manual_seed(0)
    z = torch.randn(50, prior.latent, generator=generator).requires_grad_()
    target = problem.keypoints_of(torch.randn(50, prior.latent, generator=generator)).detach()
    expected = problem.cost(z, target)
    (slope,) = torch.autograd.grad(expected.sum(), z)
    cost, gradient = problem.cost_and_gradient(z.detach().T, target.permute(1, 2, 0))
    torch.testing.assert_close(cost, expected.detach(), rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(gradient.T, slope, rtol=1e-3, atol=2e-4)


def test_gradient_is_that_of_the_cost(root: Path) -> None:
    problem, target = problem_of(root, "coman")
    z = torch.randn(200, problem.latent, generator=torch.Generator().manual_seed(0))
    _, gradient = problem.cost_and_gradient(z.T, target.permute(1, 2, 0))
    _, half_gradient = problem.normal_equations(z, target)
    torch.testing.assert_close(2 * half_gradient, gradient.T, atol=1e-3, rtol=1e-3)


def test_the_metric_is_symmetric_positive_and_always_the_same(root: Path) -> None:
    metric, again = problem_of(root, "nao")[0].metric, problem_of(root, "nao")[0].metric
    assert torch.equal(metric, again)
    torch.testing.assert_close(metric, metric.T, rtol=1e-3, atol=1e-3)
    assert float(torch.linalg.eigvalsh(metric).min()) > 0


SOLVERS = [solve_quasi_newton, solve_levenberg_marquardt]


@pytest.mark.parametrize("solve", SOLVERS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_optimum_near_the_start_is_found(root: Path, robot: str, solve: Solver) -> None:
    problem, _ = problem_of(root, robot)
    generator = torch.Generator().manual_seed(0)
    truth = 0.6 * torch.randn(100, problem.latent, generator=generator)
    target = problem.keypoints_of(truth)
    start = truth + 0.2 * torch.randn(100, problem.latent, generator=generator)
    found = solve(problem, start, target, 200, tolerance=1e-7)
    before, after = problem.cost(start, target), problem.cost(found, target)
    assert bool((after <= before).all()), "no pose gets worse"
    assert bool((after <= problem.cost(truth, target) + 1e-3).float().mean() > 0.97)
    _, gradient_before = problem.normal_equations(start, target)
    _, gradient_after = problem.normal_equations(found, target)
    assert float(gradient_after.norm(dim=1).median()) < 1e-2 * float(gradient_before.norm(dim=1).median())


@pytest.mark.parametrize("solve", SOLVERS)
@pytest.mark.parametrize(("w_prior", "share"), [(0.01, 0.99), (0.001, 0.7)])  # VPoser's weight, and the pairs' own
def test_it_improves_on_lbfgs(root: Path, solve: Solver, w_prior: float, share: float) -> None:
    problem, target = problem_of(root, "nao", w_prior)
    start = solve_lbfgs(problem, target[:100])
    found = solve(problem, start, target[:100], 100, tolerance=1e-4)
    assert bool((problem.cost(found, target[:100]) <= problem.cost(start, target[:100])).all())
    assert float(problem.cost(found, target[:100]).mean()) < share * float(problem.cost(start, target[:100]).mean())


@pytest.mark.parametrize("robot", ROBOTS)
def test_with_a_weak_prior_quasi_newton_ends_lower_than_levenberg_marquardt(root: Path, robot: str) -> None:
    problem, target = problem_of(root, robot, w_prior=0.001)
    start = nearest_samples(problem, target)
    ours = problem.cost(solve_quasi_newton(problem, start, target, 200, tolerance=1e-4), target)
    other = problem.cost(solve_levenberg_marquardt(problem, start, target, 200, tolerance=1e-6), target)
    assert float(ours.mean()) < 0.95 * float(other.mean())


def test_poses_are_solved_independently_of_their_batch(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    problem, target = problem_of(root, "nao")
    start = nearest_samples(problem, target)

    def cost(count: int) -> torch.Tensor:
        found = solve_quasi_newton(problem, start[:count], target[:count], 300, 1e-6)
        return problem.cost(found, target[:count])

    together, alone = cost(200)[:40], cost(40)
    monkeypatch.setitem(inverse._WIDTH, "cpu", 32)  # poses take turns
    in_turns = cost(200)[:40]
    for other in (alone, in_turns):  # rounding leads a pose in ten to another minimum, of much the same cost
        assert float((other - together).abs().median()) < 1e-3
        assert float(other.mean()) == pytest.approx(float(together.mean()), rel=0.03)


@pytest.mark.parametrize("count", [0, 1])
def test_few_poses_are_no_special_case(root: Path, count: int) -> None:
    problem, target = problem_of(root, "nao")
    start = torch.zeros(count, problem.latent)
    found = solve_quasi_newton(problem, start, target[:count], 20)
    assert found.shape == start.shape
    assert bool((problem.cost(found, target[:count]) < problem.cost(start, target[:count])).all())


def test_no_more_steps_are_taken_than_asked_for(root: Path) -> None:
    problem, target = problem_of(root, "nao")
    start = nearest_samples(problem, target)
    costs = [problem.cost(solve_quasi_newton(problem, start, target, n), target) for n in (1, 5, 25)]
    first = problem.cost(start, target)
    assert bool((costs[0] <= first).all()) and float(costs[0].mean()) < float(first.mean())
    assert float(costs[2].mean()) < float(costs[1].mean()) < float(costs[0].mean())


@pytest.mark.parametrize("solve", SOLVERS)
def test_an_impossible_target_gives_a_finite_answer(root: Path, solve: Solver) -> None:
    problem, target = problem_of(root, "nao")
    far = target + 1e3
    found = solve(problem, torch.zeros(200, problem.latent), far, 20)
    assert bool(torch.isfinite(found).all())
