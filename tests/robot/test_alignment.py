"""Human poses turned until they point where the robot does."""

from __future__ import annotations

import functools
from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior, mirror_pose
from mrhubo.body.joints import hinge_axis
from mrhubo.body.skeleton import JOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.robot import BodyMap, align_pose, build_body_map

ROBOTS = ["nao", "coman", "reachy"]
ELBOWS = ("left_elbow", "right_elbow")


@pytest.fixture(scope="module")
def humans() -> torch.Tensor:
    """Poses of the prior, with elbows that are pure hinges, bent by 0 to 115 degrees."""
    generator = torch.Generator().manual_seed(0)
    prior = BodyPrior.open()
    poses = prior.decode_matrices(torch.randn(64, prior.latent, generator=generator))
    for name in ELBOWS:
        angle_B1 = 2.0 * torch.rand(64, 1, generator=generator)
        hinge_3 = torch.tensor(hinge_axis(name))
        poses[:, POSED_JOINT_NAMES.index(name)] = rotation.axis_angle_to_matrix(angle_B1 * hinge_3)
    return poses


@functools.cache
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
    found_BD3, columns = body_map.human_directions(aligned), body_map.measured
    torch.testing.assert_close(found_BD3[:, columns], direction_BD3[:, columns], atol=1e-4, rtol=0)
    torch.testing.assert_close(rotation.orthonormal(aligned), aligned, atol=1e-5, rtol=0)
    changed = (aligned - humans).abs().amax((0, 2, 3)) > 1e-6
    parts = {"shoulder", "elbow", "wrist", "neck", "head"}
    assert {name.split("_")[-1] for name, c in zip(POSED_JOINT_NAMES, changed.tolist(), strict=True) if c} <= parts


@pytest.mark.parametrize("name", ROBOTS)
def test_a_pose_that_points_there_already_stays(root: Path, name: str, humans: torch.Tensor) -> None:
    body_map, _ = of(root, name)
    kept = align_pose(body_map, humans, body_map.human_directions(humans))
    torch.testing.assert_close(kept, humans, atol=2e-3, rtol=0)


@pytest.mark.parametrize("name", ROBOTS)
def test_elbows_bend_about_their_hinges(root: Path, name: str) -> None:
    """From the rest pose, whatever the robot does, the elbow's whole turn is about its hinge, where it is bent."""
    body_map, direction_BD3 = of(root, name)
    rest = torch.eye(3).expand(64, 21, 3, 3)
    aligned = align_pose(body_map, rest, direction_BD3)
    for elbow in ELBOWS:
        turn_B3 = rotation.matrix_to_axis_angle(aligned[:, POSED_JOINT_NAMES.index(elbow)])
        bent_B = turn_B3.norm(dim=1) > 0.25
        assert int(bent_B.sum()) > 20
        hinge = torch.tensor(hinge_axis(elbow))
        torch.testing.assert_close((turn_B3 @ hinge)[bent_B], turn_B3.norm(dim=1)[bent_B], atol=1e-3, rtol=0)


def test_a_straight_arm_is_turned_about_itself_as_the_robots_is(root: Path) -> None:
    """Reachy's elbow decides, from a few degrees of bend on the plane of the limbs."""
    body_map, _ = of(root, "reachy")
    robot, names = body_map.robot, list(body_map.direction_names)
    q_BN = robot.sample(64, torch.Generator().manual_seed(1))
    q_BN[:, robot.joint_names.index("l_elbow_pitch")] = -0.02
    direction_BD3 = body_map.robot_directions(robot.forward(q_BN))
    aligned = align_pose(body_map, torch.eye(3).expand(64, 21, 3, 3), direction_BD3)
    column = names.index("left_elbow_axis")
    found_B3 = body_map.human_directions(aligned)[:, column]
    torch.testing.assert_close(found_B3, direction_BD3[:, column], atol=2e-2, rtol=0)


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
    mirrored_BD3[:, body_map.shared.bend_columns] *= -1  # what turns one way turns the other way in a mirror
    found = align_pose(body_map, mirrored(humans), mirrored_BD3)
    torch.testing.assert_close(found, mirrored(align_pose(body_map, humans, direction_BD3)), atol=2e-3, rtol=0)


def test_an_opposite_direction_gives_a_finite_pose(root: Path) -> None:
    body_map, _ = of(root, "nao")
    rest = torch.eye(3).expand(1, 21, 3, 3)
    opposite = -body_map.human_directions(rest)
    aligned = align_pose(body_map, rest, opposite)
    torch.testing.assert_close(aligned @ aligned.mT, torch.eye(3).expand_as(aligned), atol=1e-5, rtol=0)
