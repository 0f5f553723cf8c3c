"""Human poses with what follows from them: the skeleton's own answers, also where the rotations are a little oblique."""

from __future__ import annotations

import torch

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.body.pose import HumanPose


def random_pose(count: int) -> torch.Tensor:
    turn = 0.7 * torch.randn(count, 21, 3, generator=torch.Generator().manual_seed(0))
    return rotation.axis_angle_to_matrix(turn)


def test_it_agrees_with_the_skeleton() -> None:
    """Of any skeleton: here of one with longer arms and legs."""
    usual, local = Skeleton(), random_pose(30)
    for skeleton in (usual, Skeleton(1.3 * usual.offsets_J3)):
        human = HumanPose.of(local, skeleton)
        points, rotations = skeleton.keypoints_and_rotations(local)
        torch.testing.assert_close(human.local_BJ33, local, atol=1e-6, rtol=0)
        assert human.keypoint_BK3.shape == (30, len(KEYPOINT_NAMES), 3) and human.rotation_BJ33.shape == (30, 22, 3, 3)
        torch.testing.assert_close(human.keypoint_BK3, points, atol=2e-6, rtol=0)
        torch.testing.assert_close(human.rotation_BJ33, rotations, atol=2e-6, rtol=0)
        torch.testing.assert_close(human.rotation_BJ33, skeleton.global_rotations(local), atol=2e-6, rtol=0)
    assert float((HumanPose.of(local, usual).keypoint_BK3 - points).abs().max()) > 0.1  # the skeletons differ


def test_oblique_rotations_are_mended_before_anything_follows_from_them() -> None:
    skeleton, local = Skeleton(), random_pose(30)
    oblique = local + 0.02 * torch.randn(local.shape, generator=torch.Generator().manual_seed(1))
    human = HumanPose.of(oblique, skeleton)
    for rotations in (human.local_BJ33, human.rotation_BJ33):
        identity = torch.eye(3).expand_as(rotations)
        torch.testing.assert_close(rotations.mT @ rotations, identity, atol=5e-6, rtol=0)
        torch.testing.assert_close(torch.linalg.det(rotations), torch.ones(rotations.shape[:2]), atol=5e-6, rtol=0)
    assert torch.equal(human.local_BJ33, rotation.orthonormal(oblique))
    points, rotations = skeleton.keypoints_and_rotations(human.local_BJ33)
    assert torch.equal(human.keypoint_BK3, points) and torch.equal(human.rotation_BJ33, rotations)
    spoilt, _ = skeleton.keypoints_and_rotations(oblique)
    assert float((spoilt - points).abs().max()) > 1e-2  # else nothing had to be mended


def test_gradients_reach_the_rotations() -> None:
    local = random_pose(2).requires_grad_()
    HumanPose.of(local, Skeleton()).keypoint_BK3.square().sum().backward()
    assert local.grad is not None and bool(torch.isfinite(local.grad).all()) and float(local.grad.abs().max()) > 0
