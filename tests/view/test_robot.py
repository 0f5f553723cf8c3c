from __future__ import annotations

import io

import numpy as np
import pytest
import yourdfpy

from mrhubo.robot import read_geometry
from mrhubo.view import render, robot_solids, stick_solids

URDF = """<robot name="toy">
  <material name="orange"><color rgba="1 0.5 0 1"/></material>
  <link name="base">
    <visual><origin xyz="0 0 0.1" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.05" length="0.4"/></geometry>
      <material name="orange"/></visual>
    <visual><geometry><mesh filename="missing.stl"/></geometry></visual>
    <collision><geometry><sphere radius="9"/></geometry></collision>
  </link>
  <link name="arm">
    <visual><geometry><mesh filename="missing.stl"/></geometry></visual>
    <collision><origin xyz="0 0.2 0"/><geometry><box size="0.1 0.4 0.2"/></geometry></collision>
  </link>
  <link name="pill">
    <visual><origin xyz="0 0 0.5" rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.03" length="0.2"/></geometry></visual>
    <visual><origin xyz="0 0.1 0.5"/><geometry><sphere radius="0.03"/></geometry></visual>
    <visual><origin xyz="0 -0.1 0.5"/><geometry><sphere radius="0.03"/></geometry></visual>
    <visual><origin xyz="0 -0.1 0.6"/><geometry><sphere radius="0.03"/></geometry></visual>
  </link>
  <link name="camera"><collision><geometry><cylinder radius="0" length="0"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.2"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="neck" type="fixed"><parent link="base"/><child link="pill"/></joint>
  <joint name="eye" type="fixed"><parent link="arm"/><child link="camera"/><origin xyz="0 0.5 0"/></joint>
</robot>"""


@pytest.fixture(scope="module")
def toy() -> tuple[yourdfpy.URDF, dict[str, np.ndarray], dict[str, str]]:
    urdf = yourdfpy.URDF.load(io.BytesIO(URDF.encode()), load_meshes=False, build_scene_graph=True)
    poses = {link.name: urdf.get_transform(link.name) for link in urdf.robot.links}
    return urdf, poses, {joint.child: joint.parent for joint in urdf.robot.joints}


def test_read_geometry_of_visuals_else_collisions_without_meshes(toy):
    shapes = read_geometry(toy[0])
    assert [(shape.link, shape.kind) for shape in shapes] == [
        ("base", "cylinder"), ("arm", "box"), ("pill", "capsule"), ("pill", "sphere"),
    ]  # fmt: skip
    assert shapes[0].size == (0.05, 0.4)
    assert shapes[0].color == (1.0, 0.5, 0.0), "a material that the robot names"
    np.testing.assert_allclose(shapes[0].origin_44[:3, 2], [1, 0, 0], atol=1e-9)
    assert shapes[1].size == (0.1, 0.4, 0.2)
    assert shapes[2].size == (0.03, 0.2)


def test_rotated_cylinder_lies_along_x(toy):
    urdf, poses, _ = toy
    solids = robot_solids([read_geometry(urdf)[0]], poses)
    np.testing.assert_allclose(solids.bounds(), [[-0.2, -0.05, 0.05], [0.2, 0.05, 0.15]], atol=1e-9)


def test_shapes_follow_their_links(toy):
    urdf, poses, _ = toy
    shapes = [shape for shape in read_geometry(urdf) if shape.link == "arm"]
    np.testing.assert_allclose(robot_solids(shapes, poses).bounds(), [[-0.05, 0.0, 0.1], [0.05, 0.4, 0.3]], atol=1e-9)
    turned = dict(poses)
    turned["arm"] = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])  # y -> -x
    np.testing.assert_allclose(robot_solids(shapes, turned).bounds(), [[0.6, 1.95, 2.9], [1.0, 2.05, 3.1]], atol=1e-9)


def test_pill_is_one_capsule(toy):
    urdf, poses, _ = toy
    pill = [shape for shape in read_geometry(urdf) if shape.kind == "capsule"]
    np.testing.assert_allclose(
        robot_solids(pill, poses).bounds(), [[-0.03, -0.13, 0.47], [0.03, 0.13, 0.53]], atol=1e-9
    )


def test_missing_pose_names_the_link(toy):
    urdf, poses, _ = toy
    with pytest.raises(ValueError, match="'pill' does not exist"):
        robot_solids(read_geometry(urdf), {name: pose for name, pose in poses.items() if name != "pill"})


def test_sticks_join_links_to_their_parents(toy):
    urdf, poses, parents = toy
    sticks = stick_solids(poses, {**parents, "base": None}, radius_m=0.01)
    low, high = sticks.bounds()
    assert low[1] == pytest.approx(-0.0135) and high[1] == pytest.approx(0.5135)
    shapes = read_geometry(urdf)
    assert len(robot_solids(shapes, poses, parents)) == len(shapes) + len(sticks)
    assert len(robot_solids(shapes, poses, {})) == len(shapes)
    assert len(stick_solids(poses, {})) == 0


def test_robot_without_shapes_or_with_shapes_is_never_an_empty_picture(toy):
    urdf, poses, parents = toy
    for solids in (robot_solids(read_geometry(urdf), poses), stick_solids(poses, parents)):
        picture = np.asarray(render(solids, (80, 80), ground=None))
        assert (picture < 250).any(axis=-1).mean() > 0.01


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_our_robots_have_shapes(root, name):
    path = root / "data" / "robots" / name / f"{name}.urdf"
    urdf = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    poses = {link.name: urdf.get_transform(link.name) for link in urdf.robot.links}
    solids = robot_solids(read_geometry(urdf), poses)
    assert len(solids) > 20
    assert (np.asarray(render(solids, (60, 60), supersample=1)) < 200).any()
