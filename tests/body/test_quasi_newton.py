"""Latent inverse kinematics as users call it."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, BodyPrior, Skeleton
from mrhubo.body.latent import LatentProblem
from mrhubo.body.prior_training.measures import IK_KEYPOINTS
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton
from mrhubo.errors import UserError


@pytest.fixture(scope="module")
def prior() -> BodyPrior:
    return BodyPrior.open()


def points_of(pose: Tensor, names: tuple[str, ...], skeleton: Skeleton | None = None) -> dict[str, Tensor]:
    found = (skeleton or Skeleton()).keypoints(rotation.sixd_to_matrix(pose))
    return {name: found[:, KEYPOINT_NAMES.index(name)] for name in names}


def test_poses_are_found_again_from_their_keypoints(prior: BodyPrior) -> None:
    pose = prior.decode(torch.randn(100, prior.latent, generator=torch.Generator().manual_seed(5)))
    targets = points_of(pose, IK_KEYPOINTS)
    found = points_of(prior.inverse_kinematics(targets), IK_KEYPOINTS)
    error = torch.stack([(found[n] - targets[n]).norm(dim=-1) for n in IK_KEYPOINTS])
    assert float(error.mean()) < 0.008
    loose = points_of(prior.inverse_kinematics(targets, w_prior=1.0), IK_KEYPOINTS)
    assert float(torch.stack([(loose[n] - targets[n]).norm(dim=-1) for n in IK_KEYPOINTS]).mean()) > 0.02


def test_the_first_guess_is_the_best_of_the_samples(prior: BodyPrior) -> None:
    problem = LatentProblem(prior, Skeleton(), [18, 19, 20, 21])
    target = problem.keypoints_of(torch.randn(30, prior.latent, generator=torch.Generator().manual_seed(2)))
    start = nearest_samples(problem, target)
    torch.testing.assert_close(start, nearest_samples(problem, target))
    others = torch.randn(4_096, prior.latent, generator=torch.Generator().manual_seed(0))
    for i in range(3):
        best = problem.cost(others, target[i : i + 1].expand(4_096, -1, -1)).min()
        assert float(problem.cost(start[i : i + 1], target[i : i + 1])) == pytest.approx(float(best), rel=1e-3)
    solved = problem.cost(solve_quasi_newton(problem, start, target, 40), target)
    assert bool((solved <= problem.cost(start, target)).all())


def test_another_skeleton_gets_other_poses(prior: BodyPrior) -> None:
    longer = Skeleton(1.2 * Skeleton().offsets_J3, 1.2 * Skeleton().point_offsets_E3)
    pose = prior.decode(torch.randn(20, prior.latent, generator=torch.Generator().manual_seed(3)))
    targets = points_of(pose, IK_KEYPOINTS, longer)
    right, wrong = (prior.inverse_kinematics(targets, skeleton=s) for s in (longer, None))
    errors = [
        torch.stack([(points_of(p, IK_KEYPOINTS, s)[n] - targets[n]).norm(dim=-1) for n in IK_KEYPOINTS]).mean()
        for p, s in ((right, longer), (wrong, None))
    ]
    assert float(errors[0]) < 0.01 < 0.03 < float(errors[1])


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ({}, "no keypoint"),
        ({"left_wirst": torch.zeros(2, 3)}, "left_wrist"),
        ({"left_wrist": torch.zeros(2, 3), "head": torch.zeros(3, 3)}, "one shape"),
        ({"left_wrist": torch.zeros(3)}, "one shape"),
        ({"left_wrist": torch.full((2, 3), torch.nan)}, "NaN"),
    ],
)
def test_mistakes_are_named(prior: BodyPrior, targets: dict[str, Tensor], message: str) -> None:
    with pytest.raises(UserError, match=message):
        prior.inverse_kinematics(targets)
