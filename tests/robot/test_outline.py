"""The outline is where forward kinematics has the collision shapes, and moves as differences say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.config import load_config
from mrhubo.robot import BodyMap, build_body_map
from mrhubo.robot.balls import outermost
from mrhubo.robot.outline import Outline
from mrhubo.robot.urdf import link_poses
from tests.reference.walkers import THICK, walker


@pytest.fixture(scope="module")
def nao(root: Path) -> BodyMap:
    return build_body_map(load_config(root / "conf" / "nao-whole-body.yaml").robot)


def test_balls_are_those_of_the_shapes(tmp_path: Path) -> None:
    """Joint centres have no radius; what the walker has besides are the corners of two soles, and five balls."""
    body_map = walker(tmp_path, thick=True)
    outline, marks = Outline(body_map), Outline(body_map, with_shapes=False)
    assert len(marks.radius_K) == len(body_map.keypoints.points) and not marks.radius_K.any()
    assert len(outline.radius_K) == len(marks.radius_K) + 2 * 8 + 5
    found = sorted(round(float(radius), 6) for radius in outline.radius_K if radius)
    assert found == sorted([*2 * [THICK["shin"][1], THICK["fore"][1]], THICK["chest"][1]])


def test_places_are_those_of_another_library(nao: BodyMap) -> None:
    """NAO's capsules, placed by yourdfpy."""
    outline, robot = Outline(nao), nao.robot
    q_BN = robot.sample(4, torch.Generator().manual_seed(3))
    place_BK3 = outline.places(robot.forward(q_BN)).double().numpy()
    shapes = robot.description.solids.shapes
    assert {shape.kind for shape in shapes} <= {"sphere", "capsule", "box", "cylinder"} and len(shapes) > 10
    for q_N, place_K3 in zip(q_BN.numpy(), place_BK3, strict=True):
        poses = link_poses(robot.description.parsed, robot.configuration(q_N))
        for shape in (shape for shape in shapes if shape.kind in ("sphere", "capsule")):
            half = 0.0 if shape.kind == "sphere" else shape.size[1] / 2
            for end in {-half, half}:
                ball_3 = (poses[shape.link] @ shape.origin_44 @ np.array([0, 0, end, 1]))[:3]
                assert np.linalg.norm(place_K3 - ball_3, axis=1).min() < 1e-5


@pytest.mark.parametrize("link", ["torso", "l_ankle"])
def test_what_moves_against_a_link_is_told_by_its_joints(nao: BodyMap, link: str) -> None:
    """Seen from a link, a ball moves with just those joints; and a link with those above it."""
    outline, robot = Outline(nao), nao.robot
    q_N, row = robot.sample(1, torch.Generator().manual_seed(4))[0], robot.link_index(link)
    poses = robot.forward(torch.cat((q_N[None], q_N + 0.1 * torch.eye(len(q_N)))))
    seen_QK3 = (outline.places(poses) - poses.position_BL3[:, row, None]) @ poses.rotation_BL33[:, row]
    moved_NK = (seen_QK3[1:] - seen_QK3[0]).norm(dim=-1) > 1e-5
    told_NK = (outline.moved_against(link).abs() @ robot.drive_DN.abs()).T > 0
    assert not bool((moved_NK & ~told_NK).any()) and bool(moved_NK.any())
    assert float(outline.moving(link).sum()) == sum(
        joint.name in robot.driven_joints for joint in robot.description.joints_above(link)
    )


def test_of_many_balls_the_outermost_are_kept() -> None:
    """What is left reaches nearly as far in every direction, and the largest ball is there."""
    random = np.random.default_rng(0)
    balls_K4 = np.concatenate((random.normal(size=(3000, 3)), random.uniform(0, 0.3, (3000, 1))), axis=1)
    found_K4, ways_F3 = outermost(balls_K4, 128), random.normal(size=(500, 3))
    ways_F3 /= np.linalg.norm(ways_F3, axis=1, keepdims=True)
    all_F, kept_F = ((some[:, :3] @ ways_F3.T + some[:, 3:]).max(axis=0) for some in (balls_K4, found_K4))
    assert len(found_K4) <= 128 and (kept_F <= all_F + 1e-12).all() and (all_F - kept_F).max() < 0.1 * all_F.max()
