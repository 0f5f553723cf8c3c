"""What is kept of a file that is read again, and what is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from mrhubo.config import load_config
from mrhubo.robot import build_body_map
from mrhubo.robot.discovery import discover
from mrhubo.robot.shapes import read_geometry
from mrhubo.robot.urdf import describe, moved

BOX = (
    '<robot name="x"><link name="a"><collision><geometry><mesh filename="a.stl"/></geometry></collision></link></robot>'
)


def test_the_same_text_is_looked_through_once(root: Path, tmp_path: Path) -> None:
    path = tmp_path / "nao.urdf"
    text = (root / "data" / "robots" / "nao" / "nao.urdf").read_text()
    path.write_text(text)
    first, again = describe(path), describe(path)
    asked: list[str] = []
    assert [first.once("a", lambda: asked.append("a")), again.once("a", lambda: asked.append("a"))] == [None, None]
    assert asked == ["a"]
    assert discover(first) == discover(again) and first.parsed is again.parsed
    path.write_text(text.replace("LShoulderPitch", "LRaise"))
    changed = describe(path)
    assert (
        "LRaise" in changed.joints and "LRaise" in discover(changed).joints and "LRaise" not in discover(again).joints
    )


def test_of_another_form_all_is_found_anew(root: Path) -> None:
    description = describe(root / "data" / "robots" / "nao" / "nao.urdf")
    elbow = description.joint("LElbowRoll")
    turned = description.with_joints({"LElbowRoll": type(elbow)(**{**vars(elbow), "lower": None, "upper": None})})
    assert discover(description).ranges != discover(turned).ranges


def test_a_mesh_that_has_changed_is_read_again(tmp_path: Path) -> None:
    path, mesh = tmp_path / "x.urdf", tmp_path / "a.stl"
    path.write_text(BOX)
    assert describe(path).solids.gaps == {"a"}
    trimesh.creation.box((0.1, 0.2, 0.3)).export(mesh)
    assert not describe(path).solids.gaps


def test_robots_that_share_a_chain_go_where_they_go_alone(root: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml").robot
    one, other = build_body_map(config).robot, build_body_map(config).robot
    q_BN = one.sample(5, torch.Generator().manual_seed(0))
    before = one.forward(q_BN).position_BL3
    assert other.double().forward(q_BN.double()).position_BL3.dtype == torch.float64
    assert torch.equal(one.forward(q_BN).position_BL3, before)


@pytest.mark.parametrize("seed", range(5))
def test_rodrigues(seed: int) -> None:
    """Against the exponential of the cross product's matrix, as a power series."""
    generator = np.random.default_rng(seed)
    axis_3, angle = generator.normal(size=3), generator.uniform(-4, 4)
    turn_33 = np.cross(np.eye(3), angle * axis_3 / np.linalg.norm(axis_3))
    terms = [np.eye(3)]
    for n in range(1, 40):
        terms.append(terms[-1] @ turn_33 / n)
    found_44 = moved(axis_3, angle, slides=False)
    np.testing.assert_allclose(found_44[:3, :3], sum(terms), atol=1e-12)
    np.testing.assert_array_equal(found_44[3], [0, 0, 0, 1])
    np.testing.assert_array_equal(found_44[:3, 3], 0)


@pytest.mark.parametrize("kind", ["visual", "collision"])
def test_a_capsule_is_one(tmp_path: Path, kind: str) -> None:
    """As in the URDFs of RB-Y1, and in those that Bullet reads: as long as it is without its round ends."""
    shape = '<origin xyz="0.1 0 0.2" rpy="0.3 1.2 -0.4"/><geometry><capsule radius="0.05" length="0.3" side="1"/></geometry>'
    (tmp_path / "one.urdf").write_text(f'<robot name="one"><link name="body"><{kind}>{shape}</{kind}></link></robot>')
    found = read_geometry(describe(tmp_path / "one.urdf").parsed)
    assert [(shape.kind, shape.size) for shape in found] == [("capsule", (0.05, 0.3))]
    turn_33 = Rotation.from_euler("xyz", [0.3, 1.2, -0.4]).as_matrix()
    np.testing.assert_allclose(found[0].origin_44[:3], np.c_[turn_33, [0.1, 0.0, 0.2]], atol=1e-9)
