"""Forward kinematics against a plain recursion, symmetry, names."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mrhubo import rotation
from mrhubo.body import JOINT_NAMES, KEYPOINT_NAMES, Skeleton, mirror_pose
from mrhubo.body.skeleton import KEYPOINT_JOINT, PARENTS, ancestors, joint_index, keypoint_indices
from mrhubo.errors import UserError


def random_pose(count: int, seed: int = 0) -> torch.Tensor:
    generator = torch.Generator().manual_seed(seed)
    return rotation.axis_angle_to_matrix(torch.randn(count, 21, 3, generator=generator))


def test_agrees_with_a_plain_recursion() -> None:
    skeleton, local = Skeleton(), random_pose(3)
    points, rotations = skeleton.keypoints_and_rotations(local)
    for b in range(3):
        turn, place = {0: np.eye(3)}, {0: np.zeros(3)}
        for j in range(1, 22):
            turn[j] = turn[PARENTS[j]] @ local[b, j - 1].numpy()
            place[j] = place[PARENTS[j]] + turn[PARENTS[j]] @ skeleton.offsets_J3[j - 1].numpy()
            np.testing.assert_allclose(points[b, j], place[j], atol=1e-6)
            np.testing.assert_allclose(rotations[b, j], turn[j], atol=1e-6)


def test_fixed_points_keep_their_distance_to_their_joint() -> None:
    skeleton = Skeleton()
    points = skeleton.keypoints(random_pose(50))
    for k in range(22, len(KEYPOINT_NAMES)):
        length = (points[:, k] - points[:, KEYPOINT_JOINT[k]]).norm(dim=-1)
        rest = (skeleton.rest_K3[k] - skeleton.rest_K3[KEYPOINT_JOINT[k]]).norm()
        torch.testing.assert_close(length, rest.expand(50), atol=1e-6, rtol=0)


def test_the_mirrored_pose_puts_the_mirrored_points() -> None:
    skeleton, pose = Skeleton(), rotation.matrix_to_sixd(random_pose(20))
    points = skeleton.keypoints(rotation.sixd_to_matrix(pose))
    mirrored = skeleton.keypoints(rotation.sixd_to_matrix(mirror_pose(pose)))
    swap = [KEYPOINT_NAMES.index(_other_side(name)) for name in KEYPOINT_NAMES]
    torch.testing.assert_close(mirrored[:, swap] * torch.tensor([-1.0, 1.0, 1.0]), points, atol=1e-6, rtol=0)
    assert torch.equal(mirror_pose(mirror_pose(pose)), pose)


def _other_side(name: str) -> str:
    return {"left": "right", "right": "left"}.get(name.split("_")[0], name.split("_")[0]) + name[
        len(name.split("_")[0]) :
    ]


def test_turning_an_elbow_moves_only_what_hangs_on_it() -> None:
    skeleton = Skeleton()
    local = torch.eye(3).repeat(1, 21, 1, 1)
    local[0, JOINT_NAMES.index("left_elbow") - 1] = torch.tensor(Rotation.from_rotvec([0, 1.0, 0]).as_matrix()).float()
    moved = (skeleton.keypoints(local)[0] - skeleton.rest_K3).norm(dim=-1) > 1e-6
    names = {name for name, m in zip(KEYPOINT_NAMES, moved.tolist(), strict=True) if m}
    assert names == {f"left_{part}" for part in ("wrist", "thumb", "index", "middle", "pinky")}


def test_gradients_reach_every_joint() -> None:
    local = random_pose(2).requires_grad_()
    Skeleton().keypoints(local).square().sum().backward()
    assert local.grad is not None and bool(torch.isfinite(local.grad).all())


def test_rest_pose_is_a_t_pose_in_the_human_frame() -> None:
    rest = dict(zip(KEYPOINT_NAMES, Skeleton().rest_K3, strict=True))
    assert rest["left_wrist"][0] > 0.5 > -0.5 > rest["right_wrist"][0]  # x to the body's left
    assert rest["head"][1] > 0.3 and rest["left_ankle"][1] < -0.8  # y up
    assert rest["left_toe"][2] > rest["left_heel"][2] and rest["left_eye"][2] > rest["head"][2]  # z forward


def test_agrees_with_the_cmu_skeleton(external_dir: Path) -> None:
    given = json.loads((external_dir / "cmu" / "skeleton.json").read_text())
    assert tuple(given["joint_names"]) == JOINT_NAMES
    assert tuple(given["parents"]) == PARENTS
    np.testing.assert_allclose(Skeleton().offsets_J3, np.array(given["rest_offsets_m"])[1:], atol=1e-4)


def test_ancestors_lead_to_the_pelvis() -> None:
    assert ancestors(0) == [0]
    assert [JOINT_NAMES[j] for j in ancestors(joint_index("left_wrist"))] == [
        "left_wrist", "left_elbow", "left_shoulder", "left_collar", "spine3", "spine2", "spine1", "pelvis",
    ]  # fmt: skip


def test_unknown_names_name_the_nearest() -> None:
    with pytest.raises(UserError, match="nearest: 'left_wrist'"):
        joint_index("left_wirst")
    with pytest.raises(UserError, match="nearest: 'left_thumb'"):
        keypoint_indices(["left_thum"])
