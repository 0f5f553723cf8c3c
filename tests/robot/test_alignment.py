"""Human poses turned until they point where the robot does."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior, mirror_pose
from mrhubo.body.skeleton import JOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.robot import BodyMap, align_pose, build_body_map

ROBOTS = ["nao", "coman", "reachy"]


@pytest.fixture(scope="module")
def humans() -> torch.Tensor:
    return BodyPrior.open().decode_matrices(torch.randn(64, 32, generator=torch.Generator().manual_seed(0)))


def of(root: Path, name: str) -> tuple[BodyMap, torch.Tensor]:
    body_map = build_body_map(load_config(root / "conf" / f"{name}.yaml").robot)
    q_BN = body_map.robot.sample(64, torch.Generator().manual_seed(1))
    return body_map, body_map.robot_directions(body_map.robot.forward(q_BN))


def mirrored(local_BJ33: torch.Tensor) -> torch.Tensor:
    return rotation.stack_columns(mirror_pose(rotation.matrix_to_sixd(local_BJ33)))


@pytest.mark.parametrize("name", ROBOTS)
def test_the_human_points_where_the_robot_does(root: Path, name: str, humans: torch.Tensor) -> None:
    body_map, direction_BD3 = of(root, name)
    aligned = align_pose(body_map, humans, direction_BD3)
    torch.testing.assert_close(body_map.human_directions(aligned), direction_BD3, atol=1e-4, rtol=0)
    torch.testing.assert_close(rotation.orthonormal(aligned), aligned, atol=1e-5, rtol=0)
    changed = (aligned - humans).abs().amax((0, 2, 3)) > 1e-6
    parts = {"shoulder", "elbow", "wrist", "neck", "head"}
    assert {name.split("_")[-1] for name, c in zip(POSED_JOINT_NAMES, changed.tolist(), strict=True) if c} <= parts


@pytest.mark.parametrize("name", ROBOTS)
def test_a_pose_that_points_there_already_stays(root: Path, name: str, humans: torch.Tensor) -> None:
    body_map, _ = of(root, name)
    kept = align_pose(body_map, humans, body_map.human_directions(humans))
    torch.testing.assert_close(kept, humans, atol=2e-3, rtol=0)


def test_an_arm_is_not_twisted(root: Path, humans: torch.Tensor) -> None:
    """The upper arm turns about an axis across itself: nothing of the turn is about the arm."""
    body_map, direction_BD3 = of(root, "nao")
    skeleton, joint = body_map.skeleton, JOINT_NAMES.index("left_shoulder")
    before, after = (
        skeleton.global_rotations(p)[:, joint] for p in (humans, align_pose(body_map, humans, direction_BD3))
    )
    turn = rotation.matrix_to_axis_angle(after @ before.mT)
    assert float(turn.norm(dim=1).max()) > 0.5
    arm = before @ torch.tensor([1.0, 0.0, 0.0])  # the bone at rest
    assert float((turn * arm).sum(1).abs().max()) < 1e-3


def test_neck_and_head_share_the_heads_turn(root: Path, humans: torch.Tensor) -> None:
    body_map, direction_BD3 = of(root, "reachy")
    before, after = (
        body_map.skeleton.global_rotations(p) for p in (humans, align_pose(body_map, humans, direction_BD3))
    )
    neck_B, head_B = (
        rotation.geodesic_distance(before[:, joint], after[:, joint])
        for joint in (JOINT_NAMES.index("neck"), JOINT_NAMES.index("head"))
    )
    assert float(head_B.max()) > 0.5
    torch.testing.assert_close(neck_B, head_B / 2, atol=2e-3, rtol=0)


def test_mirrored_poses_are_aligned_in_mirror_image(root: Path, humans: torch.Tensor) -> None:
    body_map, direction_BD3 = of(root, "reachy")
    flip = torch.tensor([-1.0, 1.0, 1.0])
    names = list(body_map.direction_names)
    swap = [names.index({"left": "right", "right": "left"}.get(n.split("_")[0], "") + n[len(n.split("_")[0]) :])
            if n.split("_")[0] in ("left", "right") else names.index(n) for n in names]  # fmt: skip
    mirrored_BD3 = direction_BD3[:, swap] * flip
    found = align_pose(body_map, mirrored(humans), mirrored_BD3)
    torch.testing.assert_close(found, mirrored(align_pose(body_map, humans, direction_BD3)), atol=2e-3, rtol=0)


def test_an_opposite_direction_gives_a_finite_pose(root: Path) -> None:
    body_map, _ = of(root, "nao")
    rest = torch.eye(3).expand(1, 21, 3, 3)
    opposite = -body_map.human_directions(rest)
    aligned = align_pose(body_map, rest, opposite)
    torch.testing.assert_close(aligned @ aligned.mT, torch.eye(3).expand_as(aligned), atol=1e-5, rtol=0)
