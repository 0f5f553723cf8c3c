"""A robot with another root is the same robot: every link is where it was against every other, whatever joints do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.robot.rooted import is_carried, rooted
from mrhubo.robot.urdf import Description, describe, describe_text, link_poses
from mrhubo.runtime.locations import project_root

ODD = """<robot name="odd"><link name="foot"/><link name="slider"/><link name="plate"/><link name="trunk"/>
<link name="arm"/><link name="slide_turned"/>
<joint name="slide" type="prismatic"><parent link="foot"/><child link="slider"/>
  <origin xyz="0.1 -0.2 0.3" rpy="0.3 1.5707963267948966 -0.4"/><axis xyz="0 0.6 0.8"/>
  <limit lower="-0.1" upper="0.2" effort="1" velocity="1"/></joint>
<joint name="bolt" type="fixed"><parent link="slider"/><child link="plate"/><origin xyz="0 0 1" rpy="1 2 3"/></joint>
<joint name="turn" type="revolute"><parent link="plate"/><child link="trunk"/>
  <limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
<joint name="follow" type="revolute"><parent link="slider"/><child link="arm"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>
  <mimic joint="turn" multiplier="-2" offset="0.5"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
<joint name="more" type="floating"><parent link="foot"/><child link="slide_turned"/></joint></robot>"""


def poses(description: Description, angles: dict[str, float]) -> dict[str, np.ndarray]:
    return link_poses(description.parsed, angles)


def same(one: Description, other: Description) -> None:
    random = np.random.default_rng(0)
    moving = [name for name, joint in one.joints.items() if joint.kind != "fixed"]
    for _ in range(3):
        angles = {name: float(random.uniform(-1, 1)) for name in moving}
        here, there = poses(one, angles), poses(other, angles)
        moved_44 = there[one.root]
        assert max(np.abs(moved_44 @ here[link] - there[link]).max() for link in one.links) < 1e-6


@pytest.mark.parametrize("link", ["slider", "plate", "trunk", "arm"])
def test_links_keep_their_places_against_each_other(link: str, tmp_path: Path) -> None:
    (tmp_path / "odd.urdf").write_text(ODD)
    robot = describe(tmp_path / "odd.urdf")
    other = describe_text(robot.path, rooted(robot, link))
    assert other.root == link and set(robot.links) <= set(other.links)
    same(robot, other)
    for name, joint in robot.joints.items():
        assert (other.joints[name].lower, other.joints[name].upper) == (joint.lower, joint.upper)
    same(robot, describe_text(robot.path, rooted(other, "foot")))


def test_every_link_of_a_robot_may_be_its_root() -> None:
    robot = describe(project_root() / "data/robots/coman/coman.urdf")
    for link in robot.links[::4]:
        same(robot, describe_text(robot.path, rooted(robot, link)))


def test_what_is_carried_hangs_on_a_joint(tmp_path: Path) -> None:
    (tmp_path / "odd.urdf").write_text(ODD)
    robot = describe(tmp_path / "odd.urdf")
    assert is_carried("arm", {"slide"}, robot) and not is_carried("foot", {"slide"}, robot)
    assert not is_carried("arm", {"turn"}, robot)


def test_meshes_are_named_from_where_the_text_will_lie(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "arm.stl").write_text("a mesh")
    shape = "<visual><geometry><mesh filename='{}'/></geometry></visual>"
    looks = "".join(map(shape.format, ("meshes/arm.stl", "package://odd/meshes/arm.stl", "package://gone/leg.stl")))
    (tmp_path / "odd.urdf").write_text(ODD.replace('<link name="arm"/>', f'<link name="arm">{looks}</link>'))
    text = rooted(describe(tmp_path / "odd.urdf"), "trunk", tmp_path / "conf").decode()
    assert text.count('filename="../meshes/arm.stl"') == 2 and "package://gone/leg.stl" in text
