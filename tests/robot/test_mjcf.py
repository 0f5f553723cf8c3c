"""A MuJoCo model and the URDF that is made of it stand alike at any joint positions; MuJoCo itself is the measure."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mrhubo.errors import UserError
from mrhubo.robot import link_poses, read_collision_geometry
from mrhubo.robot.mjcf import is_mjcf, urdf_of_mjcf
from mrhubo.robot.urdf import Description, describe

MODEL = """
<mujoco model="toy">
  <compiler angle="degree" meshdir="meshes"/>
  <default><joint damping="1"/><default class="looks"><geom type="mesh" contype="0" conaffinity="0"/></default></default>
  <asset>
    <mesh name="torso" file="torso.stl" scale="0.001 0.001 0.001"/><texture name="t" type="2d" file="x.png"/>
    <material name="m" texture="t"/>
  </asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/><light pos="0 0 3"/>
    <body name="ball" pos="3 0 0"><freejoint/><geom type="sphere" size="0.1"/></body>
    <body name="pelvis" pos="0 0 1" euler="0 0 30"> <freejoint name="root"/>
      <geom class="looks" mesh="torso" pos="0 0 0.1" euler="10 0 0" material="m"/> <geom type="box" size="0.1 0.2 0.3"/>
      <body name="chest" pos="0 0 0.3" quat="0.9 0.1 0 0.2">
        <joint name="waist_z" axis="0 0 1" range="-30 40" pos="0.01 0.02 0"/>
        <joint name="waist_y" axis="0 1 0" range="-30 40" ref="10" pos="-0.02 0.01 0.05"/>
        <joint name="lift" type="slide" axis="1 1 0" range="-0.1 0.2" ref="0.05"/>
        <geom type="capsule" fromto="0 0 0 0.1 0.1 0.3" size="0.05"/>
        <body name="arm" pos="0 0.2 0.3"> <joint name="ball" type="ball" range="0 90"/>
          <geom type="ellipsoid" size="0.03 0.1 0.04" pos="0 0.1 0"/>
          <body name="fore" pos="0 0.3 0"> <joint name="elbow" axis="1 0 0.3" ref="-20"/><geom type="cylinder" size="0.03 0.1"/>
            <body pos="0 0.2 0"><joint axis="0 1 0" range="-10 10"/><geom type="sphere" size="0.03"/></body>
            <body name="tip" pos="0 0.25 0.01" euler="0 90 0"><geom type="sphere" size="0.01"/></body>
            <body name="follow" pos="0 0.1 0">
              <joint name="f" axis="0 0 1" range="-90 90" ref="5"/><geom type="sphere" size="0.03"/></body>
  </body></body></body></body></worldbody>
  <equality><joint joint1="f" joint2="elbow" polycoef="0.1 0.5 0 0 0"/>
    <connect body1="tip" body2="pelvis" anchor="0 0 0"/></equality>
  <actuator><motor joint="elbow"/></actuator><sensor><jointpos joint="elbow"/></sensor>
  <keyframe><key qpos="0 0 0 1 0 0 0 0 0 0 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0"/></keyframe>
</mujoco>"""
ANCHORS = {"chest": "lift", "arm": "ball", "fore": "elbow", "follow": "f", "tip": None}
"""The joint at whose anchor a link's frame is, by the body that the link is."""


def converted(folder: Path, text: str = MODEL) -> tuple[Description, tuple[str, ...]]:
    (folder / "toy.xml").write_text(text)
    made = urdf_of_mjcf(folder / "toy.xml", folder)
    (folder / "toy.urdf").write_text(made.urdf)
    return describe(folder / "toy.urdf"), made.notes


def random_positions(mujoco: Any, model: Any, generator: np.random.Generator) -> tuple[np.ndarray, dict[str, float]]:
    """MuJoCo's positions, and the angles of the URDF's joints that they mean."""
    positions, angles = np.array(model.qpos0), {}
    for joint in range(model.njnt):
        name = model.joint(joint).name or f"body_{model.jnt_bodyid[joint]}_joint_{joint}"
        place, kind = int(model.jnt_qposadr[joint]), int(model.jnt_type[joint])
        if kind in (2, 3):
            positions[place] = angles[name] = generator.uniform(-0.5, 0.5)
        elif kind == 1:
            turns = generator.uniform(-0.5, 0.5, 3)
            positions[place : place + 4] = np.roll(Rotation.from_euler("XYZ", turns).as_quat(), 1)
            angles |= {f"{name}_{letter}": turn for letter, turn in zip("xyz", turns, strict=True)}
    del angles["f"]  # follows the elbow: from its own zero on, 0.1 and half of what the elbow is from its
    positions[model.joint("f").qposadr] = np.radians(5) + 0.1 + 0.5 * (angles["elbow"] - np.radians(-20))
    return positions, angles


def test_links_stand_where_mujoco_puts_them(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo, of the extra mjcf, is not installed")
    description, notes = converted(tmp_path)
    bare = re.sub("<asset>.*</asset>", "", MODEL, flags=re.S).replace('<geom class="looks" mesh="torso"', "<site")
    model = mujoco.MjModel.from_xml_string(
        re.sub(r'material="m"/>|<keyframe>.*</keyframe>', lambda m: "/>" * ("m" in m[0][:10]), bare)
    )
    data, generator = mujoco.MjData(model), np.random.default_rng(0)

    def pose(body: str, anchor: str | None = None) -> np.ndarray:
        pose_44 = np.eye(4)
        pose_44[:3, :3], pose_44[:3, 3] = data.body(body).xmat.reshape(3, 3), data.body(body).xpos
        if anchor is not None:
            pose_44[:3, 3] += pose_44[:3, :3] @ model.joint(anchor).pos
        return pose_44

    for _ in range(10):
        data.qpos[:], angles = random_positions(mujoco, model, generator)
        mujoco.mj_kinematics(model, data)
        poses, base_44 = link_poses(description.parsed, angles), np.linalg.inv(pose("pelvis"))
        for body, anchor in ANCHORS.items():
            assert np.allclose(poses[body], base_44 @ pose(body, anchor), atol=1e-7), body
    assert len(notes) == 3 and "ball" in notes[0] and "became three" in notes[1] and "constraints" in notes[2]
    assert not (Path.cwd() / "MUJOCO_LOG.TXT").exists()


def test_limits_and_shapes_are_kept(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo, of the extra mjcf, is not installed")
    description, _ = converted(tmp_path)
    waist, elbow, follow = (description.joints[name] for name in ("waist_z", "elbow", "f"))
    assert (waist.lower, waist.upper) == pytest.approx((np.radians(-30), np.radians(40)))
    assert elbow.kind == "continuous" and follow.mimic is not None and follow.mimic.multiplier == 0.5
    assert description.joints["lift"].kind == "prismatic" and description.root == "pelvis"
    shapes = {(shape.link, shape.kind): shape for shape in read_collision_geometry(description.parsed)}
    assert shapes["pelvis", "box"].size == pytest.approx((0.2, 0.4, 0.6))
    assert shapes["chest", "capsule"].size == pytest.approx((0.05, np.sqrt(0.11)))
    thick = shapes["arm", "capsule"]
    assert thick.size == pytest.approx((0.035, 0.13)) and abs(thick.origin_44[1, 2]) == pytest.approx(1.0)
    (looks,) = next(link for link in description.parsed.robot.links if link.name == "pelvis").visuals
    assert looks.geometry.mesh.filename == "meshes/torso.stl" and looks.geometry.mesh.scale == pytest.approx([1e-3] * 3)
    assert looks.origin[:3, 3] == pytest.approx([0, 0, 0.1])


def test_a_joint_without_limits_has_the_range_of_its_position_actuator(tmp_path: Path) -> None:
    servo = '<position joint="elbow" kp="20" gear="2" ctrlrange="-3 4"/><position joint="waist_z" ctrlrange="-1 1"/>'
    description, notes = converted(tmp_path, MODEL.replace('<motor joint="elbow"/>', servo))
    elbow, waist = (description.joints[name] for name in ("elbow", "waist_z"))
    assert (elbow.lower, elbow.upper, waist.lower) == pytest.approx((-1.5, 2.0, np.radians(-30)))
    assert any("actuators' ranges: elbow" in note for note in notes)


def test_limits_that_no_joint_could_have_in_degrees_are_radians(tmp_path: Path) -> None:
    """As in models that are made to be put into another one, which says radians."""
    body, end = "<body><joint range='-1.2 {}'/><geom size='1'/>", "</body>" * 4
    for most, degrees in ((2.5, 1.0), (7.0, 180 / np.pi)):
        text = "".join(body.format(upper) for upper in (1, 2, 1, most))
        description, notes = converted(tmp_path, f"<mujoco><worldbody>{text}{end}</worldbody></mujoco>")
        lower = [joint.lower for joint in description.joints.values() if joint.kind == "revolute"]
        assert lower == pytest.approx([-1.2 / degrees] * 4) and (degrees == 1.0) == any("radians" in n for n in notes)


def test_masses_are_those_that_the_model_gives(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo, of the extra mjcf, is not installed")
    given = '<inertial pos="0.01 0.2 0.3" quat="0.7 0 0.7 0.1" mass="1.5" diaginertia="0.1 0.2 0.25"/>'
    text = MODEL.replace('<geom class="looks"', f'{given}<geom class="looks"').replace(
        '<geom type="cylinder"', f'{given}<geom type="cylinder"'
    )
    description, _ = converted(tmp_path, text)
    assert set(description.masses) == {"pelvis", "fore"}
    anchor_3 = np.array(
        mujoco.MjModel.from_xml_string(
            re.sub("<asset>.*</asset>|<keyframe>.*</keyframe>|<geom class.*?/>", "", text, flags=re.S)
        )
        .joint("elbow")
        .pos
    )
    assert description.masses["pelvis"] == pytest.approx((1.5, 0.01, 0.2, 0.3))
    assert description.masses["fore"] == pytest.approx((1.5, *(np.array([0.01, 0.2, 0.3]) - anchor_3)))


def test_an_equality_that_is_switched_off_makes_no_joint_mimic_another(tmp_path: Path) -> None:
    description, notes = converted(tmp_path, MODEL.replace("<joint joint1", '<joint active="false" joint1'))
    assert description.joints["f"].mimic is None and any("left out: 1" in note for note in notes)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("</equality>", '<tendon tendon1="t"/></equality><tendon><fixed name="t"><joint joint="elbow" coef="1"/></fixed></tendon>'),
        ("</asset>", '<hfield name="hills" file="hills.png" size="1 1 1 1"/></asset>'),
    ],
    ids=["tendon", "field of heights"],
)  # fmt: skip
def test_what_hangs_on_something_that_is_left_out_is_left_out_too(tmp_path: Path, old: str, new: str) -> None:
    text = MODEL.replace(old, new)
    if "hills" in new:
        text = text.replace('<geom type="plane"', '<geom type="hfield" hfield="hills"/><geom type="plane"')
    assert converted(tmp_path, text)[0].joints.keys() == converted(tmp_path)[0].joints.keys()


def test_a_base_that_turns_hangs_on_the_world(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo, of the extra mjcf, is not installed")
    description, _ = converted(
        tmp_path,
        MODEL.replace('<freejoint name="root"/>', '<joint name="turn" axis="0 0 1"/>').split("<equality>")[0]
        + "</mujoco>",
    )
    assert description.root == "base" and description.joints["turn"].child == "pelvis"


def test_two_arms_beside_each_other_on_the_world_are_one_robot(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo, of the extra mjcf, is not installed")
    arm = (
        '<body name="{0}" pos="0 {1} 1" euler="0 0 {1}"><body name="{0}_upper"><joint name="{0}_a" axis="0 1 0"/>'
        '<geom size="0.1"/><body name="{0}_fore" pos="0.3 0 0"><joint name="{0}_b" axis="0 0 1"/><geom size="0.1"/>'
        "</body></body></body>"
    )
    text = (
        f"<mujoco><worldbody>{arm.format('l', 0.3)}<body name='drawer'><joint type='slide'/><geom size='1'/></body>"
        f"{arm.format('r', -0.3)}<body name='cup' pos='1 0 0'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
    )
    description, notes = converted(tmp_path, text)
    assert set(description.joints) >= {"l_a", "l_b", "r_a", "r_b"} and description.root == "base"
    assert len(notes) == 1 and notes[0].endswith("left out: cup, drawer")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for name in ("l_a", "r_b"):
        data.joint(name).qpos = 0.4
    mujoco.mj_kinematics(model, data)
    poses = link_poses(description.parsed, {"l_a": 0.4, "r_b": 0.4})
    for body in ("l_fore", "r_fore"):
        assert np.allclose(poses[body][:3, :3], data.body(body).xmat.reshape(3, 3), atol=1e-7)
        assert np.allclose(poses[body][:3, 3], data.body(body).xpos, atol=1e-7)
    floating, _ = converted(tmp_path, text.replace(
        "<body name=\"r\" pos=\"0 -0.3 1\" euler=\"0 0 -0.3\">", '<body name="r" pos="0 0 1"><freejoint/><geom size="1"/>'
    ))  # fmt: skip
    assert not {"l_a", "r_a"} <= set(floating.joints)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>", "has no joint"),
        (
            "<mujoco><worldbody><body><joint axis='0 0 0'/><geom size='1'/></body></worldbody></mujoco>",
            "MuJoCo refuses",
        ),
        ("<mujoco><worldbody><nonsense/></worldbody></mujoco>", "MuJoCo refuses"),
        (
            "<mujoco><worldbody><replicate count='9999999'><geom size='1'/></replicate></worldbody></mujoco>",
            "<replicate>",
        ),
        ("<mujoco><worldbody>", "no well-formed XML"),
    ],
)
def test_what_is_no_robot_is_a_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo, of the extra mjcf, is not installed")
    with pytest.raises(UserError, match=sentence) as refused:
        converted(tmp_path, text)
    assert str(tmp_path / "toy.xml") in str(refused.value) and "\n" not in str(refused.value)


def test_a_model_without_mujoco_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(UserError, match=r"pip install 'mrhubo\[mjcf\]'"):
        converted(tmp_path)


def test_models_are_known_by_their_root(tmp_path: Path) -> None:
    for name, text, known in (
        ("a.xml", MODEL, True),
        ("a\udcfc.xml", MODEL, True),
        ("b.xml", '<robot name="x"/>', False),
        ("c.xml", "x", False),
    ):
        (tmp_path / name).write_text(text.strip())
        assert is_mjcf(tmp_path / name) == known
    assert not is_mjcf(tmp_path / "none.xml") and not is_mjcf(tmp_path)
