"""The analytic derivatives against automatic differentiation."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mrhubo.body import KEYPOINT_NAMES, BodyPrior
from mrhubo.body.latent import LatentProblem
from mrhubo.body.skeleton import Skeleton, keypoint_indices

MakeProblem = Callable[..., tuple[LatentProblem, Tensor]]


@pytest.mark.parametrize("names", [KEYPOINT_NAMES, ("left_wrist",), ("head", "right_eye", "left_toe")])
def test_jacobian_agrees_with_autograd(names: tuple[str, ...]) -> None:
    prior, skeleton = BodyPrior.open(), Skeleton()
    problem = LatentProblem(prior.decoder, skeleton, keypoint_indices(names))
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
    problem = LatentProblem(prior.decoder, longer, keypoint_indices(names), w_data=70.0, w_prior=0.02)
    generator = torch.Generator().manual_seed(0)
    z = torch.randn(50, prior.latent, generator=generator).requires_grad_()
    target = problem.keypoints_of(torch.randn(50, prior.latent, generator=generator)).detach()
    expected = problem.cost(z, target)
    (slope,) = torch.autograd.grad(expected.sum(), z)
    cost, gradient = problem.cost_and_gradient(z.detach().T, target.permute(1, 2, 0))
    torch.testing.assert_close(cost, expected.detach(), rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(gradient.T, slope, rtol=1e-3, atol=2e-4)


def test_gradient_is_that_of_the_cost(latent_problem: MakeProblem) -> None:
    problem, target = latent_problem("coman")
    z = torch.randn(200, problem.latent, generator=torch.Generator().manual_seed(0))
    _, gradient = problem.cost_and_gradient(z.T, target.permute(1, 2, 0))
    _, half_gradient = problem.normal_equations(z, target)
    torch.testing.assert_close(2 * half_gradient, gradient.T, atol=1e-3, rtol=1e-3)


def test_the_metric_is_symmetric_positive_and_always_the_same(latent_problem: MakeProblem) -> None:
    metric, again = latent_problem("nao")[0].metric, latent_problem("nao")[0].metric
    assert torch.equal(metric, again)
    torch.testing.assert_close(metric, metric.T, rtol=1e-3, atol=1e-3)
    assert float(torch.linalg.eigvalsh(metric).min()) > 0
