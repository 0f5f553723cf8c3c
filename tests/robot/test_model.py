"""Forward kinematics against yourdfpy, limits, mimic, and every refusal."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
import yourdfpy
from lxml import etree

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.robot import Robot, build_body_map, link_poses
from mrhubo.robot.tree import read_tree

Arm = Callable[..., Path]


def by_yourdfpy(path: Path) -> yourdfpy.URDF:
    """The robot with yourdfpy's own graph of its links, which poses them."""
    content = io.BytesIO(etree.tostring(read_tree(path).robot))
    return yourdfpy.URDF.load(
        content, load_meshes=False, load_collision_meshes=False, build_collision_scene_graph=False
    )


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_agrees_with_yourdfpy_on_every_link(root: Path, name: str) -> None:
    config = load_config(root / "conf" / f"{name}.yaml").robot
    urdf = by_yourdfpy(config.urdf)
    everything = [link.name for link in urdf.robot.links]
    robot = Robot(config.urdf, config.joints, everything, config.ranges)
    q = torch.cat((robot.home()[None], robot.sample(8, torch.Generator().manual_seed(0))))
    poses = robot.forward(q)
    for b in range(len(q)):
        wanted = robot.configuration(q[b].numpy())
        urdf.update_cfg({joint: wanted[joint] for joint in urdf.actuated_joint_names})
        for link, pose_44 in link_poses(robot.description.parsed, wanted).items():
            np.testing.assert_allclose(pose_44, urdf.get_transform(link, robot.description.root), atol=1e-12)
        for i, link in enumerate(robot.links):
            expected = urdf.get_transform(link, robot.description.root)
            np.testing.assert_allclose(poses.position_BL3[b, i], expected[:3, 3], atol=1e-5, err_msg=link)
            np.testing.assert_allclose(poses.rotation_BL33[b, i], expected[:3, :3], atol=1e-5, err_msg=link)


def test_mimic_and_negative_axis(arm: Arm) -> None:
    path = arm()
    robot, urdf = Robot(path, ["shoulder", "elbow"], ["hand"]), by_yourdfpy(path)
    assert robot.driven_joints == ("shoulder", "elbow", "wrist")
    assert robot.drive_DN.tolist() == [[1, 0], [0, 1], [0, -0.5]]
    for q in robot.sample(5, torch.Generator().manual_seed(0)):
        urdf.update_cfg({"shoulder": float(q[0]), "elbow": float(q[1])})
        expected = urdf.get_transform("hand", "base")
        found = robot.forward(q[None])
        np.testing.assert_allclose(found.position_BL3[0, robot.link_index("hand")], expected[:3, 3], atol=1e-6)
        np.testing.assert_allclose(found.rotation_BL33[0, robot.link_index("hand")], expected[:3, :3], atol=1e-6)


def test_the_order_of_joints_is_the_configs(arm: Arm) -> None:
    path, generator = arm(), torch.Generator()
    one, other = Robot(path, ["shoulder", "elbow"], ["hand"]), Robot(path, ["elbow", "shoulder"], ["hand"])
    q = one.sample(6, generator.manual_seed(0))
    a = one.forward(q).position_BL3[:, one.link_index("hand")]
    b = other.forward(q.flip(1)).position_BL3[:, other.link_index("hand")]
    torch.testing.assert_close(a, b)


def test_samples_lie_inside_the_limits_and_fill_them(arm: Arm) -> None:
    robot = Robot(arm(), ["shoulder", "elbow"], ranges={"shoulder": [-0.5, 0.25]})
    q = robot.sample(20_000, torch.Generator().manual_seed(0))
    assert bool((q >= robot.lower_N).all()) and bool((q <= robot.upper_N).all())
    torch.testing.assert_close(q.amin(0), torch.tensor([-0.5, 0.3]), atol=1e-3, rtol=0)
    torch.testing.assert_close(q.mean(0), torch.tensor([-0.125, 0.75]), atol=1e-2, rtol=0)
    assert robot.home().tolist() == pytest.approx([0.0, 0.3])


def test_float32_limits_never_exceed_the_urdfs(arm: Arm) -> None:
    robot = Robot(arm(('lower="0.3" upper="1.2"', 'lower="0.0349066" upper="1.54462"')), ["elbow"])
    assert float(robot.lower_N[0].double()) >= 0.0349066 and float(robot.upper_N[0].double()) <= 1.54462


def test_held_joints(arm: Arm) -> None:
    assert Robot(arm(), ["shoulder"]).held["elbow"] == pytest.approx(0.3)  # 0 clamped to the limits
    assert Robot(arm(), ["shoulder"], hold={"elbow": 1.0}).held["elbow"] == 1.0


def test_gradients_flow_through(arm: Arm) -> None:
    robot = Robot(arm(), ["shoulder", "elbow"], ["hand"])
    q = robot.sample(4, torch.Generator().manual_seed(0)).requires_grad_()
    robot.forward(q).position_BL3[:, -1].sum().backward()
    assert q.grad is not None and bool((q.grad.abs() > 0).any(0).all())


def test_orientations_are_those_of_the_moved_links(root: Path) -> None:
    robot = build_body_map(load_config(root / "conf" / "nao.yaml").robot).robot
    poses = robot.forward(robot.sample(3, torch.Generator().manual_seed(0)))
    R = robot.moving_orientations(poses)
    i = robot.moving_links.index("LForeArm")
    torch.testing.assert_close(R[:, i, 3:], poses.rotation_BL33[:, robot.link_index("LForeArm"), :, 1])


REFUSALS = [
    ([], {"joints": ["sholder"]}, r"joint 'sholder' does not exist; nearest: 'shoulder'"),
    ([], {"joints": []}, r"robot.joints: is empty"),
    ([], {"joints": ["elbow", "elbow"]}, r"'elbow' appears twice"),
    ([], {"joints": ["wrist"]}, r"'wrist' mimics 'elbow'; name 'elbow' instead"),
    ([], {"joints": ["spin"]}, r"'spin' has no limits; give it a range in robot.ranges"),
    ([], {"joints": ["rail"]}, r"'rail' is prismatic; only rotary joints can be sampled"),
    ([], {"links": ["hnad"]}, r"link 'hnad' does not exist; nearest: 'hand'"),
    ([], {"ranges": {"shoulder": [1.0, -1.0]}}, r"robot.ranges.shoulder: expected \[lower, upper\]"),
    ([], {"ranges": {"shoulder": [-3.0, 1.0]}}, r"leaves the URDF's limits"),
    ([], {"ranges": {"wrist": [-0.1, 0.1]}}, r"robot.ranges.wrist: is not among robot.joints"),
    ([], {"joints": ["shoulder"], "hold": {"elbow": 2.0}}, r"robot.hold.elbow: 2.0 leaves the URDF's limits"),
    ([], {"hold": {"shoulder": 0.0}}, r"is among robot.joints, so it cannot be held"),
    ([('<limit lower="-2" upper="1.5" effort="1" velocity="1"/>', "")], {}, r"'shoulder' has no limits"),
    ([('lower="-2" upper="1.5"', 'lower="0" upper="0"')], {}, r"impossible limits"),
    ([('lower="-2" upper="1.5"', 'lower="nan" upper="1"')], {}, r"impossible limits"),
    ([('name="elbow" type="revolute"', 'name="elbow" type="floating"')], {"joints": ["shoulder"]}, r"'elbow' is floating"),
    ([('<link name="base"/>', '<link name="base"/><link name="lost"/>')], {}, r"has 2: 'base', 'lost'"),
    ([('<parent link="base"/><child link="upper"/>', '<parent link="finger"/><child link="upper"/>'),
      ('<parent link="base"/><child link="slide"/>', '<parent link="upper"/><child link="base"/>')], {}, r"a loop of joints"),
    ([('<child link="fore"/>', '<child link="four"/>')], {}, r"the child link 'four', which does not exist"),
    ([('<child link="slide"/>', '<child link="hand"/>')], {}, r"hangs on two joints"),
    ([('name="finger"', 'name="hand"')], {}, r"link 'hand' appears twice"),
    ([('mimic joint="elbow"', 'mimic joint="wrist"')], {"links": ["hand"]}, r"'wrist' mimics itself"),
    ([('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>')], {}, r"line 5: joint 'shoulder': <axis xyz=\"0 0 0\"> is zero"),
    ([("</robot>", "")], {}, r"no well-formed XML"),
    ([("robot name", "model name"), ("</robot>", "</model>")], {}, r"root element is <model>"),
]  # fmt: skip


@pytest.mark.parametrize(("replacements", "arguments", "message"), REFUSALS)
def test_what_cannot_work_is_refused(arm: Arm, replacements: list, arguments: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        Robot(arm(*replacements), **{"joints": ["shoulder", "elbow"], **arguments})


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"robot.urdf: .*none.urdf does not exist"):
        Robot(tmp_path / "none.urdf", ["shoulder"])


def test_a_floating_base_is_taken_as_fixed(arm: Arm) -> None:
    path = arm(
        ('<link name="base"/>', '<link name="world"/><link name="base"/>'),
        ('<joint name="shoulder"', '<joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>'
         '<joint name="shoulder"'),
    )  # fmt: skip
    assert Robot(path, ["shoulder"]).description.root == "world"


def test_where_a_floating_base_starts_is_no_part_of_the_robot(arm: Arm) -> None:
    """MuJoCo's free joint has the place of the link that floats, and so has an answer, whose base is the root."""
    free = (
        '<joint name="free" type="floating"><origin xyz="0 0 0.9" rpy="0 0 1.5"/><parent link="world"/>'
        '<child link="base"/></joint><joint name="shoulder"'
    )
    path = arm(('<link name="base"/>', '<link name="world"/><link name="base"/>'), ('<joint name="shoulder"', free))
    robot = Robot(path, ["shoulder"], ["base"])
    poses = robot.forward(robot.home()[None])
    base = robot.link_index("base")
    assert torch.equal(poses.position_BL3[0, base], torch.zeros(3))
    assert torch.allclose(poses.rotation_BL33[0, base], torch.eye(3))


def test_entities_are_not_expanded(arm: Arm) -> None:
    bomb = '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot name="arm">&a;'
    path = arm(('<robot name="arm">', bomb))
    assert Robot(path, ["shoulder"]).joint_names == ("shoulder",)


@pytest.mark.parametrize("name", ["g1_29dof_rev_1_0", "pepper", "romeo"])
def test_other_humanoids_load(external_dir: Path, name: str) -> None:
    path = external_dir / "robots" / "more" / f"{name}.urdf"
    joint = "left_shoulder_pitch_joint" if name.startswith("g1") else "LShoulderPitch"
    robot = Robot(path, [joint])
    assert robot.forward(robot.sample(2, torch.Generator())).rotation_BL33.shape == (2, 1, 3, 3)
