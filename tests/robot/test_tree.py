"""Links and joints are all that kinematics need: what else is broken is left out and listed, what is needed is named with
its line."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot import Robot, SelfCollision, build_body_map, link_poses, read_geometry
from tests.robot.two_arms import PAIR, joint_of, line_of

Pair = Callable[..., RobotConfig]
YAW = joint_of("l_yaw")


def within(joint: str, old: str, new: str) -> tuple[str, str]:
    """A replacement in the element of one joint alone."""
    element = joint_of(joint)
    assert old in element
    return element, element.replace(old, new)


NEEDED = [
    (within("l_yaw", 'axis xyz="0 0 1"', 'axis xyz="0 0 1 0"'), r'\'l_yaw\': <axis xyz="0 0 1 0"> must be three numbers, not 4'),
    (within("l_yaw", 'axis xyz="0 0 1"', 'axis xyz="0 1"'), r"<axis xyz=\"0 1\"> must be three numbers, not 2"),
    (within("l_yaw", 'axis xyz="0 0 1"', 'axis xyz="0 0 0"'), r"<axis xyz=\"0 0 0\"> is zero, which is no direction"),
    (within("l_yaw", 'axis xyz="0 0 1"', 'axis xyz="0 0 1e200"'), r"<axis xyz=\"0 0 1e200\"> is beyond"),
    (within("l_yaw", 'xyz="0 0 -0.25"', 'xyz="0 0 -1e200"'), r"<origin xyz=\"0 0 -1e200\"> is beyond 1,000; lengths are in metres"),
    (within("l_yaw", 'xyz="0 0 -0.25"', 'xyz="0 0 nan"'), r"<origin xyz=\"0 0 nan\"> holds NaN"),
    (within("l_yaw", 'xyz="0 0 -0.25"', 'xyz="0 0 -inf"'), r"<origin xyz=\"0 0 -inf\"> holds an infinite number"),
    (within("l_yaw", 'xyz="0 0 -0.25"', 'xyz="0,0 0,0 -0,25"'), r"<origin xyz=\"0,0 0,0 -0,25\"> must be three numbers"),
    (within("l_yaw", 'xyz="0 0 -0.25"', 'xyz=""'), r"<origin xyz=\"\"> must be three numbers, not 0"),
    (within("l_yaw", 'xyz="0 0 -0.25"', 'xyz="0 0 -0.25" rpy="0 ${pi} 0"'), r"<origin rpy=\"0 \${pi} 0\"> is an expression, .*`xacro FILE"),
    (within("l_yaw", 'lower="-1.5"', 'lower="${-pi/2}"'), r"'l_yaw' has impossible limits: <limit lower=\"\${-pi/2}\"> is an expression, .*`xacro FILE"),
    (within("l_yaw", 'lower="-1.5"', 'lower="-1,5"'), r"has impossible limits: <limit lower=\"-1,5\"> is no number"),
    (within("l_yaw", 'upper="1.5"', 'upper="nan"'), r"has impossible limits: <limit upper=\"nan\"> is NaN"),
    (within("l_wrist", 'xyz="0 0 -0.22"', 'xyz="0 0 -22 cm"'), r"'l_wrist': <origin xyz=\"0 0 -22 cm\"> must be three numbers"),
    (within("l_yaw", "<axis", '<mimic joint="r_yaw" multiplier="?"/><axis'), r"<mimic multiplier=\"\?\"> is no number"),
    (within("l_yaw", "<axis", "<mimic/><axis"), r"'l_yaw': <mimic> names no joint"),
]  # fmt: skip


@pytest.mark.parametrize(("edit", "message"), NEEDED)
def test_what_is_needed_is_named_with_its_line(pair: Pair, edit: tuple[str, str], message: str) -> None:
    with pytest.raises(UserError, match=r"robot\.urdf: .*pair\.urdf, line \d+: joint .*" + message):
        build_body_map(pair(edit))


def test_the_line_is_the_elements(pair: Pair) -> None:
    line = line_of(YAW) + YAW[: YAW.index("<axis")].count("\n")
    with pytest.raises(UserError, match=rf"pair\.urdf, line {line}: joint 'l_yaw'"):
        build_body_map(pair(within("l_yaw", 'axis xyz="0 0 1"', 'axis xyz="0"')))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('type="revolute"', 'type="Revolute"', r"joint 'neck' has an unknown type: .*'Revolute' does not exist; nearest: 'revolute'"),
        ('type="revolute"', 'type="ball"', r"joint 'neck' has an unknown type: .*available: continuous, fixed"),
        ('type="revolute"', 'type="${kind}"', r"joint 'neck'.*xacro FILE"),
        ('type="revolute"', "", r"joint 'neck' has no type; write one of revolute"),
        ('<parent link="chest"/>', "", r"joint 'neck' has no <parent link=\"...\">"),
        ('<child link="head"/>', '<child link="heed"/>', r"joint 'neck' has the child link 'heed', which does not exist"),
        ('<child link="head"/>', '<child link="l_hand"/>', r"link 'l_hand' hangs on two joints, "),
        ('name="neck"', 'name="waist"', r"joint 'waist' appears twice"),
        ('name="neck"', 'name=""', r"a joint has no name"),
        ('type="revolute"', 'type="floating"', r"joint 'neck' is floating; only"),
    ],
)  # fmt: skip
def test_how_links_hang_together_must_be_right_everywhere(pair: Pair, old: str, new: str, message: str) -> None:
    """The neck is not needed; still, who knows what a file with such a joint means?"""
    with pytest.raises(UserError, match=r"pair\.urdf, line \d+: .*" + message):
        build_body_map(pair(within("neck", old, new)))


UNNEEDED = [
    (within("neck", "<axis", '<mimic joint="l_yaw" multiplier="nan"/><axis'), r"joint 'neck': <mimic multiplier=\"nan\"> is NaN"),
    (within("neck", 'lower="-1.5"', 'lower="low"'), r"joint 'neck' has impossible limits: <limit lower=\"low\"> is no number"),
    (within("neck", 'xyz="0 0 0.4"', 'xyz="0 0 nan"'), r"joint 'neck': <origin xyz=\"0 0 nan\"> holds NaN"),
    (within("neck", 'axis xyz="0 0 1"', 'axis xyz="up"'), r"joint 'neck': <axis xyz=\"up\"> must be three numbers"),
    (within("l_yaw", 'effort="1"', 'effort="max"'), r"joint 'l_yaw': <limit effort=\"max\"> is no number"),
    (within("l_yaw", "<axis", '<dynamics damping="x"/><axis'), r"joint 'l_yaw': <dynamics damping=\"x\"> is no number"),
    (("<link name=\"l_hand\"/>", '<link name="l_hand"><inertial><mass value="?"/></inertial></link>'), r"link 'l_hand': <mass value=\"\?\"> is no number"),
    (("<link name=\"l_hand\"/>", '<link name="l_hand"><inertial><inertia ixx="a"/></inertial></link>'), r"<inertia ixx=\"a\"> is no number"),
    *[(("<link name=\"l_hand\"/>", f'<link name="l_hand"><{kind}>{inside}</{kind}></link>'), rf"the {kind} of link 'l_hand' {message}")
      for kind in ("visual", "collision") for inside, message in (
        ("", "has no shape"),
        ("<geometry/>", "has no shape"),
        ('<geometry><cone radius="0.1" length="0.2"/></geometry>', "is a <cone>, which is no shape of URDF"),
        ('<geometry><capsule radius="0.1"/></geometry>', "is a <capsule> without length"),
        ('<geometry><sphere/></geometry>', "is a <sphere> without radius"),
        ('<geometry><sphere radius="big"/></geometry>', "has <sphere radius=\"big\"> is no number"),
        ('<geometry><box size="1 1"/></geometry>', "has <box size=\"1 1\"> must be three numbers, not 2"),
        ('<geometry><cylinder radius="1" length="nan"/></geometry>', "has <cylinder length=\"nan\"> is NaN"),
        ('<origin xyz="0 0"/><geometry><sphere radius="1"/></geometry>', "has <origin xyz=\"0 0\"> must be three numbers"),
    )],
    (("<link name=\"l_hand\"/>", '<link name="l_hand"><visual><geometry><sphere radius="0.1"/></geometry><material name="m"><color rgba="red"/></material></visual></link>'), r"the colour of a material"),
]  # fmt: skip


@pytest.mark.parametrize(("edit", "message"), UNNEEDED)
def test_what_nobody_needs_is_left_out_and_listed(pair: Pair, edit: tuple[str, str], message: str) -> None:
    good = build_body_map(pair()).robot
    with pytest.warns(
        InputWarning, match=r"pair\.urdf: left out what cannot be read and is not needed: line .*" + message
    ):
        robot = build_body_map(pair(edit)).robot
    q_BN = good.sample(5, torch.Generator().manual_seed(0))
    assert torch.equal(robot.forward(q_BN).position_BL3, good.forward(q_BN).position_BL3)
    parsed = robot.description.parsed  # what is drawn and what bumps
    assert len(link_poses(parsed, robot.configuration(robot.home().numpy()))) == len(parsed.robot.links)
    read_geometry(parsed)
    SelfCollision(robot)
    assert robot.description.kinematics


def test_the_list_is_short(pair: Pair) -> None:
    edit = ('<link name="l_hand"/>', '<link name="l_hand">' + "<visual/>" * 40 + "</link>")
    with pytest.warns(InputWarning, match=r"; and 35 more$"):
        build_body_map(pair(edit))


def test_a_link_without_a_place_cannot_be_asked_for(pair: Pair) -> None:
    """But what hangs on the broken joint has no place either, and is not drawn."""
    nose = (
        '<link name="nose"/><joint name="face" type="fixed"><parent link="head"/><child link="nose"/></joint></robot>'
    )
    edits = (within("neck", 'xyz="0 0 0.4"', 'xyz="0 0 nan"'), ("</robot>", nose))
    with pytest.warns(InputWarning, match=r"joint 'neck'"):
        drawn = {link.name for link in build_body_map(pair(*edits)).robot.description.parsed.robot.links}
    assert "chest" in drawn and not {"head", "nose"} & drawn
    for links in (["head", "l_hand"], ["nose", "l_hand"]):
        with pytest.raises(UserError, match=r"line \d+: joint 'neck': <origin xyz=\"0 0 nan\"> holds NaN"):
            build_body_map(pair(*edits, key_links=links))


def test_a_collision_shape_that_cannot_be_read_is_not_looked_at(pair: Pair) -> None:
    shape = "<collision><geometry><cone radius='0.1' length='0.2'/></geometry></collision>"
    with pytest.warns(InputWarning, match="the collision of link 'l_hand' is a <cone>"):
        robot = build_body_map(pair(('<link name="l_hand"/>', f'<link name="l_hand">{shape}</link>'))).robot
    assert SelfCollision(robot).uncovered == ("l_hand",)


@pytest.mark.parametrize("edit", [within("l_yaw", 'xyz="0 0 -0.25"', 'xyz="0 0 -0.25" rpy="0 0 90"')])
def test_a_turn_of_ninety_radians_is_doubted(pair: Pair, edit: tuple[str, str]) -> None:
    with pytest.warns(InputWarning, match=r"line \d+: joint 'l_yaw': <origin rpy=\"0 0 90\"> .*are these degrees\?"):
        build_body_map(pair(edit))


def test_good_robots_pass_in_silence(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    robot = Robot(pair().urdf, ["l_pitch"], ["l_hand"])
    assert robot.description.links[:2] == ("base", "chest") and list(robot.description.joints)[:2] == ["waist", "neck"]
    assert PAIR.count("<link name") == len(robot.description.links)
    build_body_map(pair())
    assert not recwarn.list
