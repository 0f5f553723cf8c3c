"""The order of joints in a file: MuJoCo's models depth first, URDFs as they stand, texts a name a line."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.errors import UserError
from mrhubo.robot_motion import read_joint_order

MODEL = """<mujoco model="robo">
  <default><joint damping="1"/><default class="pin"><joint type="slide"/></default>
    <default class="pivot"><joint type="ball"/></default></default>
  <include file="arm.xml"/>
  <worldbody>
    <body name="pelvis" pos="0 0 0.8" quat="2 0 0 0">
      <freejoint name="base"/>
      <body name="leg"><body name="shin"><joint name="knee"/></body><joint name="hip"/></body>
      <frame><body name="torso" childclass="pin"><joint name="waist"/><joint name="turn" type="hinge"/></body></frame>
    </body>
  </worldbody>
</mujoco>"""
ARM = '<mujocoinclude><worldbody><body name="table"/></worldbody></mujocoinclude>'


def order_of(folder: Path, text: str, name: str = "robot.xml") -> tuple[str, ...]:
    (folder / name).write_text(text)
    return read_joint_order(folder / name).names


def test_a_models_joints_are_in_the_order_of_qpos(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    (tmp_path / "robot.xml").write_text(MODEL)
    order = read_joint_order(tmp_path / "robot.xml")
    assert order.names == ("hip", "knee", "waist", "turn")
    assert (order.free_joint, order.position, order.quaternion_wxyz) == ("base", (0.0, 0.0, 0.8), (1.0, 0.0, 0.0, 0.0))
    assert order.free_body == "pelvis"


def test_it_is_what_mujoco_has(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
    (tmp_path / "arm.xml").write_text(ARM)
    masses = MODEL.replace("</body>", '<geom size="0.1"/></body>')
    (tmp_path / "robot.xml").write_text(masses)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    names = [model.joint(number).name for number in range(model.njnt)]
    order = read_joint_order(tmp_path / "robot.xml")
    assert names == [order.free_joint, *order.names]
    assert model.qpos0[:7].tolist() == pytest.approx([*order.position, *order.quaternion_wxyz])


def test_other_files_list_them_as_they_stand(tmp_path: Path, root: Path) -> None:
    names = ("a", "b c", "d")
    assert order_of(tmp_path, "a # first\n\nb c,d\n") == order_of(tmp_path, "- a\n- 'b c'\n- \"d\"\n") == names
    assert order_of(tmp_path, '["a", "b c", "d"]') == names
    urdf = '<robot><joint name="x" type="fixed"/><joint name="b" type="revolute"/><joint name="a" type="prismatic"/></robot>'
    assert order_of(tmp_path, urdf) == ("b", "a")
    nao = read_joint_order(root / "data" / "robots" / "nao" / "nao.urdf").names
    assert "LShoulderPitch" in nao and len(nao) == len(set(nao))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "names 0 joints"),
        ("a\na\n", "names joint 'a' twice"),
        ("<robot", "is no XML"),
        ("<html/>", "begins with <html>; expected a MuJoCo model or a URDF"),
        ('<robot><joint type="revolute"/></robot>', "has a joint without a name"),
        (MODEL.replace('name="knee"', ""), "line 8: a joint has no name"),
        (MODEL.replace('"pin"><joint name="waist"', '"pivot"><joint name="waist"'), "'waist' is of type 'ball'"),
        (
            MODEL.replace('<joint name="hip"/>', '<joint name="hip" type="free"/>'),
            "free joint 'hip' behind other joints",
        ),
        (MODEL.replace("0 0 0.8", "0 0"), "pos='0 0' are not 3 numbers"),
        (MODEL.replace("<frame>", "<frame><replicate/>"), "has <replicate>, which only MuJoCo can take apart"),
        (
            MODEL.replace('quat="2 0 0 0"', 'euler="0 0 90"'),
            "line 6: the base is turned by 'euler'; write it as 'quat'",
        ),
        (MODEL.replace("arm.xml", "none.xml"), "none.xml: there is no such file"),
        (MODEL.replace("arm.xml", "robot.xml"), "includes more than 50 files"),
    ],
)
def test_what_cannot_be_an_order_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    with pytest.raises(UserError, match=message):
        order_of(tmp_path, text)


def test_entities_and_foreign_files_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    text = f'<!DOCTYPE r [<!ENTITY x SYSTEM "{tmp_path}/secret">]><robot><joint name="a" type="revolute"/>&x;</robot>'
    assert order_of(tmp_path, text) == ("a",)
    with pytest.raises(UserError, match="is no text"):
        (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
        read_joint_order(tmp_path / "binary")
