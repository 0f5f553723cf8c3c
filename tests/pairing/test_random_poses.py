"""Human poses drawn joint by joint."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import anatomy
from mrhubo.body.joints import hinge_axis
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.pairing.random_poses import random_poses
from mrhubo.robot import BodyMap, build_body_map


@pytest.fixture(scope="module")
def body_map(root: Path) -> BodyMap:
    return build_body_map(load_config(root / "conf" / "reachy.yaml").robot)


def drawn(body_map: BodyMap, count: int = 4_000, seed: int = 0) -> torch.Tensor:
    return random_poses(body_map.keypoints.parts, count, torch.Generator().manual_seed(seed))


def test_they_are_rotations_and_the_seeds_own(body_map: BodyMap) -> None:
    found = drawn(body_map, 50)
    torch.testing.assert_close(rotation.orthonormal(found), found, atol=1e-5, rtol=0)
    assert torch.equal(found, drawn(body_map, 50)) and not torch.equal(found, drawn(body_map, 50, seed=1))
    assert drawn(body_map, 0).shape == (0, 21, 3, 3)


def test_only_joints_of_the_robots_parts_turn(root: Path, body_map: BodyMap) -> None:
    moved = {"shoulder", "elbow", "wrist", "neck", "head"}
    nao = build_body_map(load_config(root / "conf" / "nao.yaml").robot)
    for robot, parts in ((body_map, moved), (nao, {"shoulder", "elbow"})):
        turned = (drawn(robot, 20) - torch.eye(3)).abs().amax(dim=(0, 2, 3)) > 0
        assert {n.split("_")[-1] for n, t in zip(POSED_JOINT_NAMES, turned.tolist(), strict=True) if t} == parts


def test_upper_arms_point_anywhere_and_elbows_bend_forward(body_map: BodyMap) -> None:
    poses = drawn(body_map)
    directions = body_map.human_directions(poses)
    for side in ("left", "right"):
        upper = directions[:, body_map.direction_names.index(f"{side}_elbow")]
        torch.testing.assert_close(upper.mean(dim=0), torch.zeros(3), atol=0.05, rtol=0)
        torch.testing.assert_close(upper.T @ upper / len(upper), torch.eye(3) / 3, atol=0.03, rtol=0)
        turn = rotation.matrix_to_axis_angle(poses[:, POSED_JOINT_NAMES.index(f"{side}_elbow")])
        bend = turn @ torch.tensor(hinge_axis(f"{side}_elbow"))
        assert float((bend > math.radians(-15)).float().mean()) > 0.97 and float(bend.amax()) > math.radians(140)


def test_thighs_stay_in_the_ranges_of_hips_and_knees_bend_backwards(root: Path) -> None:
    nao = build_body_map(load_config(root / "conf" / "nao-whole-body.yaml").robot)
    poses = drawn(nao, 500)
    hips = [POSED_JOINT_NAMES.index(f"{side}_hip") for side in ("left", "right")]
    assert float(anatomy.excess(poses)[:, hips].max()) < 1e-3
    angles_BX3 = anatomy.joint_angles(poses)[:, hips]
    reach_X3 = angles_BX3.amax(dim=0) - angles_BX3.amin(dim=0)
    limits_X3 = anatomy.LIMITS_J32[hips].diff(dim=-1)[..., 0]
    assert bool((reach_X3 > 0.9 * limits_X3).all())
    directions = nao.human_directions(poses)
    thigh, shin = (directions[:, nao.direction_names.index(f"left_{name}")] for name in ("knee", "ankle"))
    axis = directions[:, nao.direction_names.index("left_knee_axis")]
    bent = torch.linalg.cross(thigh, shin).norm(dim=-1) > 0.5
    assert float(((torch.linalg.cross(thigh, shin) * axis).sum(-1)[bent] >= 0).float().mean()) > 0.99
