"""Latent inverse kinematics as users call it."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, BodyPrior, Skeleton, inverse_kinematics
from mrhubo.body.prior_training.measures import IK_KEYPOINTS
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
    found = points_of(inverse_kinematics(prior, targets), IK_KEYPOINTS)
    error = torch.stack([(found[n] - targets[n]).norm(dim=-1) for n in IK_KEYPOINTS])
    assert float(error.mean()) < 0.008
    loose = points_of(inverse_kinematics(prior, targets, w_prior=1.0), IK_KEYPOINTS)
    assert float(torch.stack([(loose[n] - targets[n]).norm(dim=-1) for n in IK_KEYPOINTS]).mean()) > 0.02


def test_another_skeleton_gets_other_poses(prior: BodyPrior) -> None:
    longer = Skeleton(1.2 * Skeleton().offsets_J3, 1.2 * Skeleton().point_offsets_E3)
    pose = prior.decode(torch.randn(20, prior.latent, generator=torch.Generator().manual_seed(3)))
    targets = points_of(pose, IK_KEYPOINTS, longer)
    right, wrong = (inverse_kinematics(prior, targets, skeleton=s) for s in (longer, None))
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
        inverse_kinematics(prior, targets)
