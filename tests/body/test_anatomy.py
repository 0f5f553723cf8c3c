"""Ranges of motion: known motions give known angles, mirror symmetry, and real people stay inside."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton, anatomy, mirror_pose
from mrhubo.body.joints import hinge_axis
from mrhubo.body.prior_training.poses import load_training_poses
from mrhubo.motion import read_folder


def posed(joint: str, axis: tuple[float, float, float], degrees: float) -> torch.Tensor:
    """Local rotations (1, 21, 3, 3) with one joint turned."""
    angle = torch.zeros(1, 21, 3)
    angle[0, POSED_JOINT_NAMES.index(joint)] = torch.deg2rad(torch.tensor(degrees)) * torch.tensor(axis)
    return rotation.axis_angle_to_matrix(angle)


@pytest.mark.parametrize(
    ("joint", "axis", "inside", "outside"),
    [
        ("left_knee", (1, 0, 0), 140, -30),
        ("right_knee", (1, 0, 0), 140, -30),
        ("left_hip", (1, 0, 0), -120, 80),
        ("left_hip", (0, 0, 1), 45, -70),
        ("right_hip", (0, 0, 1), -45, 70),
        ("left_shoulder", (0, 0, 1), -90, -150),
        ("right_shoulder", (0, 0, 1), 90, 150),
        ("left_shoulder", (0, 1, 0), -120, 100),
        ("right_shoulder", (0, 1, 0), 120, -100),
        ("left_wrist", (0, 0, 1), 70, 120),
        ("head", (0, 1, 0), 50, 90),
    ],
)
def test_ranges(joint: str, axis: tuple[float, float, float], inside: float, outside: float) -> None:
    for degrees, expected in ((inside, True), (outside, False)):
        pose = rotation.matrix_to_sixd(posed(joint, axis, degrees))
        assert bool(anatomy.inside(pose)[0]) is expected
        assert bool(anatomy.inside(mirror_pose(pose))[0]) is expected


@pytest.mark.parametrize("side", ["left", "right"])
def test_hinges_bend_the_way_people_do(side: str) -> None:
    """A flexed knee takes the ankle back, a flexed elbow the wrist forward; backwards they are outside."""
    skeleton = Skeleton()
    for joint, end, forward in (("knee", "ankle", -1), ("elbow", "wrist", 1)):
        axis = hinge_axis(f"{side}_{joint}")
        flexed, backward = (posed(f"{side}_{joint}", axis, degrees) for degrees in (70.0, -70.0))
        tip = KEYPOINT_NAMES.index(f"{side}_{end}")
        moved = skeleton.keypoints(flexed)[0, tip] - skeleton.rest_K3[tip]
        assert float(moved[2]) * forward > 0.1
        assert bool(anatomy.inside(rotation.matrix_to_sixd(flexed))[0])
        assert not bool(anatomy.inside(rotation.matrix_to_sixd(backward))[0])


def test_angles_rebuild_the_rotation() -> None:
    """R = twist . swing, from the angles alone, for both sides."""
    quaternion = torch.randn(300, 21, 4, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    matrices = rotation.quaternion_to_matrix(quaternion)
    angles = anatomy.joint_angles(matrices)
    for j, name in enumerate(POSED_JOINT_NAMES):
        axes = anatomy.AXES_J33[j].double()
        mirror = torch.tensor([1.0, -1.0, -1.0] if name.startswith("right_") else [1.0, 1.0, 1.0], dtype=torch.float64)
        twist = rotation.axis_angle_to_matrix(angles[:, j, :1] * axes[0] * mirror)
        swing = rotation.axis_angle_to_matrix((angles[:, j, 1:, None] * axes[1:]).sum(1) * mirror)
        torch.testing.assert_close(twist @ swing, matrices[:, j], atol=2e-6, rtol=0)


def test_excess_grows_from_zero_with_finite_gradients() -> None:
    degrees = torch.tensor([-9.0, -11.0, -30.0])
    found = torch.cat([anatomy.excess(posed("left_knee", (1, 0, 0), float(d))) for d in degrees]).sum(dim=(1, 2))
    torch.testing.assert_close(torch.rad2deg(found), torch.tensor([0.0, 1.0, 20.0]), atol=1e-3, rtol=0)
    narrower = anatomy.excess(posed("left_knee", (1, 0, 0), -9.0), margin=torch.deg2rad(torch.tensor(3.0)).item())
    assert float(torch.rad2deg(narrower).sum()) == pytest.approx(2.0, abs=1e-3)
    quaternion = torch.randn(500, 21, 4, generator=torch.Generator().manual_seed(1))
    for matrices in (
        rotation.quaternion_to_matrix(quaternion),
        torch.eye(3).expand(2, 21, 3, 3),
        rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.0, torch.pi]).expand(1, 21, 3)),
    ):
        pose = rotation.matrix_to_sixd(matrices).requires_grad_()
        anatomy.excess(rotation.sixd_to_matrix(pose)).sum().backward()
        assert pose.grad is not None and bool(pose.grad.isfinite().all())


def test_real_people_stay_inside(external_dir: Path, tmp_path: Path) -> None:
    with np.load(external_dir / "cmu" / "training_poses.npz") as data:
        some = data["poses"][::50]
    np.savez(tmp_path / "some.npz", poses=some, clip_starts=np.array([0, len(some)]), clip_ids=np.array(["all"]))
    poses, _, _ = load_training_poses(tmp_path / "some.npz")
    assert float(anatomy.inside(poses).float().mean()) > 0.93
    walking = [
        rotation.matrix_to_sixd(m.local_TJ33)
        for m in read_folder(external_dir / "cmu" / "evaluation")
        if m.name != "54_16"
    ]
    assert float(anatomy.inside(torch.cat(walking)).float().mean()) > 0.99
