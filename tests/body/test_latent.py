"""The analytic Jacobian against automatic differentiation, the solvers against each other."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.body import KEYPOINT_NAMES, BodyPrior
from mrhubo.body.inverse import solve_levenberg_marquardt
from mrhubo.body.latent import LatentProblem
from mrhubo.body.skeleton import Skeleton, keypoint_indices
from mrhubo.config import load_config
from mrhubo.pairing import solve_lbfgs
from mrhubo.robot import build_body_map

ROBOTS = ["nao", "coman", "reachy"]


def problem_of(root: Path, robot: str) -> tuple[LatentProblem, torch.Tensor]:
    body_map = build_body_map(load_config(root / "conf" / f"{robot}.yaml").robot)
    problem = LatentProblem(BodyPrior.open(), body_map.skeleton, body_map.keypoint_indices)
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


def test_gradient_is_that_of_the_cost(root: Path) -> None:
    problem, target = problem_of(root, "coman")
    z = torch.randn(200, problem.latent, generator=torch.Generator().manual_seed(0)).requires_grad_()
    (expected,) = torch.autograd.grad(problem.cost(z, target).sum(), z)
    _, half_gradient = problem.normal_equations(z.detach(), target)
    torch.testing.assert_close(2 * half_gradient, expected, atol=1e-3, rtol=1e-3)


@pytest.mark.parametrize("robot", ROBOTS)
def test_levenberg_marquardt_finds_the_optimum_near_its_start(root: Path, robot: str) -> None:
    problem, _ = problem_of(root, robot)
    generator = torch.Generator().manual_seed(0)
    truth = 0.6 * torch.randn(100, problem.latent, generator=generator)
    target = problem.keypoints_of(truth)
    start = truth + 0.2 * torch.randn(100, problem.latent, generator=generator)
    found = solve_levenberg_marquardt(problem, start, target, 100, tolerance=1e-7)
    before, after = problem.cost(start, target), problem.cost(found, target)
    assert bool((after <= before).all()), "no pose gets worse"
    assert bool((after <= problem.cost(truth, target) + 1e-3).float().mean() > 0.97)
    _, gradient_before = problem.normal_equations(start, target)
    _, gradient_after = problem.normal_equations(found, target)
    assert float(gradient_after.norm(dim=1).median()) < 1e-2 * float(gradient_before.norm(dim=1).median())


def test_levenberg_marquardt_improves_on_lbfgs(root: Path) -> None:
    problem, target = problem_of(root, "nao")
    start = solve_lbfgs(problem, target[:100])
    found = solve_levenberg_marquardt(problem, start, target[:100], 100)
    assert bool((problem.cost(found, target[:100]) <= problem.cost(start, target[:100])).all())
    assert float(problem.cost(found, target[:100]).mean()) < 0.99 * float(problem.cost(start, target[:100]).mean())


def test_poses_are_solved_independently_of_their_batch(root: Path) -> None:
    problem, target = problem_of(root, "nao")
    start = torch.zeros(200, problem.latent)
    together = problem.cost(solve_levenberg_marquardt(problem, start, target, 40), target)
    alone = problem.cost(solve_levenberg_marquardt(problem, start[:7], target[:7], 40), target[:7])
    torch.testing.assert_close(together[:7], alone, rtol=0.02, atol=1e-3)


def test_an_impossible_target_gives_a_finite_answer(root: Path) -> None:
    problem, target = problem_of(root, "nao")
    far = target + 1e3
    found = solve_levenberg_marquardt(problem, torch.zeros(200, problem.latent), far, 20)
    assert bool(torch.isfinite(found).all())
