"""The hand-written robots are the measure: the same joints, and points within two centimetres, however their files are
written.
"""

from __future__ import annotations

import math
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.robot import read_keypoints
from mrhubo.robot.discovery import Discovery, discover
from mrhubo.robot.generator.variants import variant
from mrhubo.robot.urdf import Description, describe
from mrhubo.runtime.locations import project_root

ROBOTS = ("nao", "coman", "reachy")
NEAR = 0.02
MORE = project_root() / "data/external/robots/more"


@cache
def config_of(robot: str):
    return load_config(project_root() / f"conf/{robot}.yaml").robot


@cache
def found_of(robot: str) -> Discovery:
    return discover(config_of(robot).urdf)


def poses(description: Description, link: str) -> np.ndarray:
    pose_44 = np.eye(4)
    for joint in reversed(description.joints_above(link)):
        pose_44 = pose_44 @ joint.origin_44
    return pose_44


@pytest.mark.parametrize("robot", ROBOTS)
def test_found_is_what_was_written_by_hand(robot: str) -> None:
    config, found = config_of(robot), found_of(robot)
    description = describe(config.urdf)
    # NAO's file leaves out head and wrists, as the paper does.
    assert set(config.joints) <= set(found.joints)
    assert robot == "nao" or set(config.joints) == set(found.joints)
    keypoints = read_keypoints(config.keypoints)
    for name, point in keypoints.points.items():
        pose_44 = poses(description, point.link)
        hand_3 = pose_44[:3, :3] @ np.array(point.offset_3) + pose_44[:3, 3]
        assert np.linalg.norm(hand_3 - found.points[name].root_3) < NEAR, name
        link = poses(description, found.points[name].link)
        there_3 = link[:3, :3] @ np.array(found.points[name].offset_3) + link[:3, 3]
        assert np.allclose(there_3, found.points[name].root_3, atol=1e-5), "link and offset are the point"
    for name, end in keypoints.ends.items():
        hand_23 = end.axes_23.numpy() @ poses(description, end.link)[:3, :3].T
        axes_23 = np.array(list(found.ends[name].axes.values())) @ poses(description, found.ends[name].link)[:3, :3].T
        assert np.allclose(hand_23, axes_23, atol=0.03), name


def same(first: Discovery, second: Discovery, names, turn_33: np.ndarray, scale: float) -> None:
    new = dict(names)
    assert [new.get(joint, joint) for joint in first.joints] == list(second.joints)
    assert first.points.keys() == second.points.keys() and first.ends.keys() == second.ends.keys()
    for name, point in first.points.items():
        other = second.points[name]
        assert np.allclose(scale * turn_33 @ np.array(point.root_3), other.root_3, atol=1e-4 * scale), name
    for name, end in first.ends.items():
        assert new.get(end.link, end.link) == second.ends[name].link
        for word, axis in end.axes.items():
            assert np.allclose(axis, second.ends[name].axes[word], atol=1e-3), (name, word)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(
    "form", ["renamed", "reordered", "negated", "y up", "lying, backwards, half as large, all else at once"]
)
def test_the_form_of_the_file_does_not_matter(robot: str, form: str, tmp_path: Path) -> None:
    all_at_once = "all" in form
    turn = (math.pi / 2, 0.0, 0.0) if form == "y up" else (0.3, 1.4, 2.8) if all_at_once else None
    scale = 0.5 if all_at_once else 1.0
    text, names = variant(
        config_of(robot).urdf, seed=3, rename=form == "renamed" or all_at_once, reorder=form == "reordered" or all_at_once,
        negate=form == "negated" or all_at_once, turn=turn, scale=scale,
    )  # fmt: skip
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    found = discover(path)
    description = describe(path)
    turn_33 = (
        np.eye(3)
        if turn is None
        else description.joints["turned_joint" if not names else names.get("turned_joint", "")].origin_44[:3, :3]
    )
    same(found_of(robot), found, names, turn_33, scale)
    for joint, (low, high) in {name: (r.lower, r.upper) for name, r in found_of(robot).ranges.items()}.items():
        now = found.ranges[names.get(joint, joint)]
        assert sorted(map(abs, (low, high))) == pytest.approx(sorted(map(abs, (now.lower, now.upper))), abs=1e-4)


def test_a_clear_answer_is_sure_and_a_guess_is_asked() -> None:
    assert found_of("nao").sure and found_of("nao").forward.confidence > 0.8
    asked = {question.about for question in found_of("coman").questions}
    assert asked == {"left_hand", "right_hand"}, "nothing in COMAN's file tells where a thumb would be"


@pytest.mark.parametrize(
    ("file", "joints", "head", "forward"),
    [("g1_29dof_rev_1_0", 14, False, 1), ("pepper", 12, True, 1), ("romeo", 18, True, 1)],
)
def test_robots_that_no_config_names(file: str, joints: int, head: bool, forward: int) -> None:
    path = MORE / f"{file}.urdf"
    if not path.exists():
        pytest.skip("the further robots are not in this checkout")
    found = discover(path)
    assert (len(found.joints), "head" in found.ends) == (joints, head)
    assert found.forward.root_3 == (forward, 0, 0) and found.up.root_3 == (0, 0, 1)
    left, right = (np.array(found.points[f"{side}_elbow"].root_3) for side in ("left", "right"))
    assert np.allclose(left * [1, -1, 1], right, atol=2e-3) and left[1] > 0


def test_an_elbow_that_bends_both_ways_is_narrowed(pair, tmp_path: Path) -> None:
    config = pair(('lower="-2.3" upper="0"', 'lower="-2.3" upper="0.7"'))
    found = discover(config.urdf)
    assert found.ranges["l_elbow"].lower == pytest.approx(-2.3) and found.ranges["l_elbow"].upper == pytest.approx(0)
    assert "both ways" in found.ranges["l_elbow"].why


def test_joints_without_limits_get_a_range(pair) -> None:
    yaw = '<joint name="l_yaw" type="revolute">'
    free = yaw.replace("revolute", "continuous")
    whole = discover(pair((yaw, f'{free}<limit effort="1" velocity="1"/>')).urdf).ranges["l_yaw"]
    assert (whole.lower, whole.upper) == pytest.approx((-math.pi, math.pi))
    # A URDF that calls a joint continuous and gives it limits means these.
    given = discover(pair((yaw, free)).urdf).ranges["l_yaw"]
    assert (given.lower, given.upper) == (-1.5, 1.5) and "continuous" in given.why
    wide = discover(pair((yaw, f'{free}<limit lower="-3.14" upper="3.14" effort="1" velocity="1"/>')).urdf).ranges[
        "l_yaw"
    ]
    assert (wide.lower, wide.upper) == pytest.approx((-math.pi, math.pi))


def test_a_joint_behind_a_gear_is_moved_by_what_drives_it(pair) -> None:
    motor = (
        '<link name="motor"/><joint name="l_motor" type="revolute"><parent link="l_upper"/><child link="motor"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    yaw = '<joint name="l_yaw" type="revolute">'
    config = pair((yaw, yaw + '<mimic joint="l_motor" multiplier="-1"/>'), ("</robot>", motor))
    found = discover(config.urdf)
    assert "l_motor" in found.joints and "l_yaw" not in found.joints
    assert "l_yaw" in found.chains["left_arm"]


LEGS = """<robot name="walker"><link name="body"/>{}</robot>"""


def _leg(side: str, y: float) -> str:
    joints = [
        ("hip_roll", "1 0 0", 0.0),
        ("hip_pitch", "0 1 0", 0.0),
        ("knee", "0 1 0", -0.3),
        ("ankle", "0 1 0", -0.3),
    ]
    parts, parent = [], "body"
    for name, axis, z in joints:
        parts.append(
            f'<link name="{side}_{name}_link"/><joint name="{side}_{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{side}_{name}_link"/><origin xyz="0 {y if parent == "body" else 0} {z}"/><axis xyz="{axis}"/>'
            '<limit lower="-1" upper="2" effort="1" velocity="1"/></joint>'
        )
        parent = f"{side}_{name}_link"
    return "".join(parts)


def _finger(name: str, y: float) -> str:
    parts, parent = [], "palm"
    for joint, at in (("proximal", f"0.1 {y} 0"), ("intermediate", "0.04 0 0"), ("distal", "0.03 0 0")):
        link = f"{name}_{joint}"
        parts.append(
            f'<link name="{link}"><inertial><origin xyz="0.02 0 0"/><mass value="0.01"/></inertial></link>'
            f'<joint name="{link}_joint" type="revolute"><parent link="{parent}"/><child link="{link}"/>'
            f'<origin xyz="{at}"/><axis xyz="0 1 0"/><limit lower="0" upper="1.6" effort="1" velocity="1"/></joint>'
        )
        parent = link
    return "".join(parts)


FINGERS = "<robot name='hand'><link name='palm'/>" + _finger("index", 0.02) + _finger("ring", -0.02) + "</robot>"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (FINGERS, "fingers by their names"),
        (LEGS.format(""), "no two arms were found"),
        (LEGS.format(_leg("left", 0.1)), "no two arms were found"),
        (LEGS.format(_leg("left", 0.1) + _leg("right", -0.1)), "the only pair of limbs looks like legs"),
        ("<robot name='x'><link name='a'/><link name='b'/></robot>", "one root link"),
        ("<mujoco/>", "MJCF"),
    ],
)
def test_what_is_no_humanoid_is_refused_in_one_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(UserError, match=sentence) as refusal:
        discover(path)
    assert "\n" not in str(refusal.value)


def test_what_nobody_needs_may_be_missing_or_broken(pair) -> None:
    mess = (
        '<transmission name="t"><joint name="none"/></transmission><gazebo reference="chest"><x/></gazebo>'
        '<material name="m"><texture filename="package://no/where.png"/></material>'
    )
    config = pair(
        ("</robot>", mess + "</robot>"),
        ('<link name="head"/>', '<link name="head"><visual><geometry><mesh filename="package://no.stl"/></geometry></visual>'
         '<inertial><mass value="heavy"/></inertial></link>'),
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert discover(config.urdf).ends["chest"].link == "chest"
