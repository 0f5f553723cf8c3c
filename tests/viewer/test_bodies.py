"""Bodies are where forward kinematics has their links, and look like the URDF, as far as its files are there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mrhubo.errors import UserError
from mrhubo.robot import Robot, link_poses
from mrhubo.viewer import perform
from mrhubo.viewer.bodies import dress, link_places, read_bodies
from tests.viewer.conftest import random_motion

ARM = """<robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base"><visual><geometry><box size="0.1 0.1 0.2"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1" rpy="0 0.3 0"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <link name="upper"><visual><origin xyz="0 0 0.5"/><geometry><mesh filename="rod.stl" scale="1 1 2"/></geometry>
    <material name="red"/></visual></link>
  <joint name="follow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" velocity="1" effort="1"/><mimic joint="turn" multiplier="-2" offset="0.1"/></joint>
  <link name="lower"><visual><geometry><mesh filename="missing.stl"/></geometry></visual>
    <collision><geometry><sphere radius="0.2"/></geometry></collision></link>
  <joint name="out" type="prismatic"><parent link="lower"/><child link="tip"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.5" velocity="1" effort="1"/></joint>
  <link name="tip"/>
</robot>"""


@pytest.fixture
def arm(tmp_path: Path) -> Robot:
    (tmp_path / "arm.urdf").write_text(ARM)
    trimesh.creation.box(extents=(0.02, 0.02, 0.5)).export(tmp_path / "rod.stl")
    return Robot(tmp_path / "arm.urdf", ["turn"], ["tip"])


@pytest.mark.parametrize("name", ["nao-whole-body", "reachy"])
def test_bodies_are_where_forward_kinematics_has_them(root: Path, name: str) -> None:
    robot = Robot.from_config(root / "conf" / f"{name}.yaml")
    motion = random_motion(robot, 3)
    names, poses_TL44 = link_places(read_bodies(robot, robot.joint_names), motion.q)
    for frame in range(3):
        wanted = link_poses(robot.description.parsed, robot.configuration(motion.q[frame]))
        assert set(wanted) == set(names)
        np.testing.assert_allclose(poses_TL44[frame], [wanted[link] for link in names], atol=1e-6)


def test_joints_that_mimic_and_held_ones(arm: Robot) -> None:
    bodies = read_bodies(arm, ["turn"])
    assert [body.name for body in bodies] == ["base", "upper", "lower"] and set(bodies[2].links) == {"lower", "tip"}
    names, poses_TL44 = link_places(bodies, np.array([[0.4]]))
    wanted = link_poses(arm.description.parsed, {"turn": 0.4, "out": 0.0})
    np.testing.assert_allclose(poses_TL44[0], [wanted[link] for link in names], atol=1e-9)
    bodies = read_bodies(arm, ["turn", "out"])  # a motion may move joints that the config holds
    names, poses_TL44 = link_places(bodies, np.array([[0.4, 0.3]]))
    wanted = link_poses(arm.description.parsed, {"turn": 0.4, "out": 0.3})
    np.testing.assert_allclose(poses_TL44[0], [wanted[link] for link in names], atol=1e-9)


def test_looks(arm: Robot) -> None:
    """A mesh that is there, in its colour and at its scale; collision shapes where it is not."""
    bodies = read_bodies(arm, ["turn"])
    dress(bodies, arm)
    base, upper, lower = bodies
    assert [np.ptp(mesh.vertices_V3, axis=0).tolist() for mesh in base.meshes] == [[0.1, 0.1, 0.2]]
    (rod,), (ball,) = upper.meshes, lower.meshes
    np.testing.assert_allclose([rod.vertices_V3.min(axis=0), rod.vertices_V3.max(axis=0)], [[-0.01, -0.01, 0], [0.01, 0.01, 1]], atol=1e-6)  # fmt: skip
    assert rod.color == (1.0, 0.0, 0.0)
    np.testing.assert_allclose(np.linalg.norm(ball.vertices_V3, axis=1), 0.2, atol=1e-9)


def test_a_robot_without_shapes_gets_sticks(arm: Robot, tmp_path: Path) -> None:
    from tests.view.test_pictures import bare

    robot = Robot(bare(arm.urdf, tmp_path), ["turn"], ["tip"])
    bodies = read_bodies(robot, ["turn"])
    dress(bodies, robot)
    points_V3 = np.concatenate([mesh.vertices_V3 for mesh in bodies[1].meshes])  # from the elbow upwards
    assert points_V3[:, 2].max() > 1.0 and abs(points_V3[:, 2].min()) < 0.1


def test_size(arm: Robot) -> None:
    """As tall as the human, or as it is; lengths grow, angles do not."""
    motion = random_motion(arm, 2)
    large, own = perform("arm", arm, motion), perform("arm", arm, motion, true_size=True)
    assert own.scale == 1.0 and large.scale > 1.0
    _, large_TL44 = large.links()
    _, own_TL44 = own.links()
    np.testing.assert_allclose(large_TL44[..., :3, 3], large.scale * own_TL44[..., :3, 3], atol=1e-6)
    np.testing.assert_allclose(large_TL44[..., :3, :3], own_TL44[..., :3, :3], atol=1e-6)
    assert large.lower_N.tolist() == own.lower_N.tolist() == arm.lower_N.tolist()


def test_motions_that_are_none_of_the_robot(arm: Robot) -> None:
    with pytest.raises(UserError, match=r"joint 'trun' does not exist; nearest: 'turn'"):
        read_bodies(arm, ["trun"])
    with pytest.raises(UserError, match=r"joint 'follow' mimics 'turn' in .*arm\.urdf, so nothing else can move it"):
        read_bodies(arm, ["follow"])
    with pytest.raises(UserError, match="does not tell its frame rate; give --rate"):
        perform("arm", arm, random_motion(arm, 2, frame_rate=None))
    with pytest.raises(UserError, match="has no frames"):
        perform("arm", arm, random_motion(arm, 0))
