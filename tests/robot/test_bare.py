"""Sticks in place of shapes: where a picture would have a gap, and nowhere else."""

from __future__ import annotations

from pathlib import Path

from mrhubo.robot import Robot, bare_sticks

# A leg whose thigh and forearm-like end have no shapes; hips that cross, and a thigh that carries a fixed frame.
ROBOT = """<robot name="r">
  <link name="base_footprint"/><link name="base"/><link name="hip"/><link name="hip2"/><link name="thigh"/>
  <link name="imu"/><link name="shin"/><link name="foot"/><link name="toe"/><link name="head"/>
  <joint name="root" type="fixed"><parent link="base_footprint"/><child link="base"/><origin xyz="0 0 0.9"/></joint>
  <joint name="yaw" type="revolute"><parent link="base"/><child link="hip"/><origin xyz="0 0.1 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="roll" type="revolute"><parent link="hip"/><child link="hip2"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="pitch" type="revolute"><parent link="hip2"/><child link="thigh"/><origin xyz="0 0 -0.02"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="imu" type="fixed"><parent link="thigh"/><child link="imu"/><origin xyz="0 0.3 0"/></joint>
  <joint name="knee" type="revolute"><parent link="thigh"/><child link="shin"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="ankle" type="revolute"><parent link="shin"/><child link="foot"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="toe" type="fixed"><parent link="foot"/><child link="toe"/><origin xyz="0.15 0 0" rpy="0 0 1"/></joint>
  <joint name="head" type="fixed"><parent link="base"/><child link="head"/><origin xyz="0 0 0.4"/></joint>
</robot>"""


def test_where_links_have_no_shapes(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(ROBOT)
    description = Robot(tmp_path / "r.urdf", ["knee"], ["foot"]).description
    assert bare_sticks(description, {"base", "shin", "head", "hip"}) == {"shin": "thigh", "toe": "foot"}
    assert bare_sticks(description, {"base", "imu", "head", "toe"}) == {"foot": "shin"}, "a body has its links' shapes"
    assert bare_sticks(description, set(description.links)) == {}
    every = {joint.child: joint.parent for joint in description.joints.values()}
    assert bare_sticks(description, {"base"}) == bare_sticks(description, set()) == every


def test_robots_that_ship_need_none(root: Path) -> None:
    from mrhubo.robot import read_geometry

    for name in ("nao", "coman", "reachy"):
        description = Robot.from_config(root / "conf" / f"{name}.yaml").description
        assert bare_sticks(description, {shape.link for shape in read_geometry(description.parsed)}) == {}, name
