"""Bags that outlive a killed process, messages of trajectories, and the robot in simulation."""

from __future__ import annotations

import dataclasses
import json
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mrhubo
from mrhubo.errors import InputWarning, UserError
from mrhubo.live.output import Output
from mrhubo.live.pilot import Pilot
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.file import FileSink
from mrhubo.live.sinks.mcap import McapSink
from mrhubo.live.sinks.mujoco import MujocoSink
from mrhubo.live.sinks.trajectory import trajectory
from mrhubo.robot_motion import FollowingJoint, RobotFacts
from tests.live.robots import AT_ONCE, NAMES, make_robot
from tests.reference.walkers import write_urdf


def test_a_bag_of_a_session_is_its_motion(tmp_path: Path, outputs: list[Output]) -> None:
    pytest.importorskip("mcap_ros2")
    path = tmp_path / "new" / "session.mcap"
    sink = McapSink(path)
    sink.open(make_robot(), AT_ONCE)
    for output in outputs:
        sink.send(output)
    as_killed = path.read_bytes()
    sink.close()
    sink.close()
    found = mrhubo.read_robot_motion(path)
    assert np.allclose(found.q, [output.q_N for output in outputs], atol=1e-6)
    assert found.joint_names == NAMES and found.frame_rate == pytest.approx(60)
    for cut in (
        0,
        1,
        300,
    ):  # nearly all had been handed to the system; of a disk that lost the end, what is before is read
        path.write_bytes(as_killed[: len(as_killed) - cut])
        with pytest.warns(InputWarning, match="ends early"):
            early = mrhubo.read_robot_motion(path)
        assert 60 - 40 <= len(early) < 60
        assert np.array_equal(early.q, found.q[: len(early)])
    path.write_bytes(as_killed[:60])
    with pytest.raises(UserError):
        mrhubo.read_robot_motion(path)


@pytest.mark.parametrize("kind", [FileSink, McapSink])
def test_a_file_has_one_sink(tmp_path: Path, outputs: list[Output], kind: type[FileSink | McapSink]) -> None:
    path = tmp_path / ("a.npz" if kind is FileSink else "a.mcap")
    if kind is McapSink:
        pytest.importorskip("mcap_ros2")
    first, second = kind(path), kind(path)
    first.open(make_robot(), AT_ONCE)
    for output in outputs:
        first.send(output)
    with pytest.raises(UserError, match="another sink writes it"):
        second.open(make_robot(), AT_ONCE)
    first.close()
    assert len(mrhubo.read_robot_motion(path)) == len(outputs)
    second.open(make_robot(), AT_ONCE)
    for output in outputs[:3]:
        second.send(output)
    second.close()
    assert len(mrhubo.read_robot_motion(path)) == 3 and [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_row_that_is_not_whole_is_left_out(tmp_path: Path, outputs: list[Output]) -> None:
    sink = FileSink(tmp_path / "a.npz")
    sink.open(make_robot(), AT_ONCE)
    for output in outputs[:2]:
        sink.send(output)
    assert sink._file is not None
    sink._file.write(b"1234")
    sink.close()
    assert len(mrhubo.read_robot_motion(tmp_path / "a.npz")) == 2


@pytest.mark.parametrize("kind", [FileSink, McapSink])
def test_files_and_bags_tell_where_the_base_is(
    tmp_path: Path, walking: tuple[LiveRobot, list[Output]], kind: Callable[[Path], FileSink | McapSink]
) -> None:
    pytest.importorskip("mcap_ros2")
    robot, outputs = walking
    path = tmp_path / ("session.npz" if kind is FileSink else "session.mcap")
    sink = kind(path)
    sink.open(robot, AT_ONCE)
    for output in outputs:
        sink.send(output)
    as_killed = path.read_bytes() if kind is McapSink else b""
    sink.close()
    found = mrhubo.read_robot_motion(path)
    told = [output.standing for output in outputs if output.standing is not None]
    assert len(told) == len(found) == 40
    np.testing.assert_allclose(found.q, [output.q_N for output in outputs], atol=1e-6)
    assert found.root_position is not None and found.root_quaternion_wxyz is not None
    np.testing.assert_allclose(found.root_position, [one.base.position_3 for one in told], atol=1e-6)
    np.testing.assert_allclose(found.root_quaternion_wxyz, [one.base.quaternion_wxyz_4 for one in told], atol=1e-6)
    assert found.contact_names == robot.foot_names and found.contact is not None
    assert found.contact.tolist() == [list(one.contact.values()) for one in told]
    for cut in (0, 1, 90, 400) if kind is McapSink else ():  # what is read of a part has all that belongs together
        path.write_bytes(as_killed[: len(as_killed) - cut])
        with pytest.warns(InputWarning, match="ends early"):
            early = mrhubo.read_robot_motion(path)
        assert 5 < len(early) < 40 and early.root_position is not None and early.contact is not None
        np.testing.assert_array_equal(early.root_position, found.root_position[: len(early)])


def test_messages_tell_where_the_base_is(walking: tuple[LiveRobot, list[Output]]) -> None:
    output = walking[1][-1]
    told, standing = json.loads(output.message()), output.standing
    assert standing is not None and told["contact"] == standing.contact and told["mrhubo"] == 1
    np.testing.assert_allclose(told["base"]["position"], standing.base.position_3, atol=1e-9)
    np.testing.assert_allclose(told["base"]["quaternion_wxyz"], standing.base.quaternion_wxyz_4, atol=1e-9)
    assert set(told["stop"]) == {"angles", "in", "base"} and set(told["stop"]["base"]) == set(told["base"])
    fixed = json.loads(dataclasses.replace(output, standing=None).message())
    assert set(told) - set(fixed) == {"base", "contact"} and set(fixed["stop"]) == {"angles", "in"}


def test_a_simulated_robot_with_legs_begins_on_its_soles(
    tmp_path: Path, walking: tuple[LiveRobot, list[Output]]
) -> None:
    pytest.importorskip("mujoco")
    robot, outputs = walking
    text = write_urdf(tmp_path / "walker.urdf").read_text()
    inertial = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'  # fmt: skip
    (tmp_path / "walker.urdf").write_text(re.sub(r'<link name="([^"]*)">', rf'<link name="\1">{inertial}', text))
    sink = MujocoSink(tmp_path / "walker.urdf", free=True)
    sink.open(robot, AT_ONCE)
    pilot = Pilot(robot, AT_ONCE, True)
    home = pilot.tick(0.0).standing
    assert home is not None
    np.testing.assert_allclose(sink.data.qpos[:3], home.base.position_3, atol=1e-3)
    np.testing.assert_allclose(sink.data.qpos[3:7], home.base.quaternion_wxyz_4, atol=1e-6)
    sink.send(outputs[0])
    assert "the base, which is free, was" in sink.told()


def test_a_trajectory_ends_where_the_robot_would_stand(outputs: list[Output]) -> None:
    for output in outputs:
        told = trajectory(output, 1 / 60, 1.5)
        first, second = told["points"]
        assert told["header"]["stamp"] == {"sec": 1, "nanosec": 500_000_000}
        assert first["positions"] == output.q_N.tolist() and second["positions"] == output.stop_N.tolist()
        assert not any(second["velocities"])
        times = [
            point["time_from_start"]["sec"] + 1e-9 * point["time_from_start"]["nanosec"] for point in (first, second)
        ]
        assert times[0] == pytest.approx(1 / 60) and 2 / 60 - 1e-6 <= times[1] <= 0.2


@pytest.fixture(scope="module")
def nao(root: Path) -> LiveRobot:
    """NAO's left arm, hand half open; it answers nothing."""
    names = ("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll")
    home = np.array([1.4, 0.2, -1.0, -0.5])
    facts = RobotFacts(
        "nao",
        lower=home - 1,
        upper=home + 1,
        velocity=np.full(4, 5.0),
        others=(FollowingJoint("LFinger11", offset=0.5),),
    )
    robot = make_robot()
    return dataclasses.replace(
        robot, facts=facts, joint_names=names, home_N=home, urdf=root / "data/robots/nao/nao.urdf"
    )


@pytest.mark.parametrize("free", [False, True])
def test_a_simulated_robot_follows(nao: LiveRobot, free: bool) -> None:
    pytest.importorskip("mujoco")
    sink = MujocoSink(free=free)
    sink.open(nao, AT_ONCE)
    assert sink.model.opt.gravity[2] < -9 and sink.model.nq - sink.model.nv == (1 if free else 0)
    assert np.allclose(sink.joints, nao.home_N)
    rest_N = nao.home_N
    for step in range(60):
        q_N = rest_N + 0.3 * np.sin(2 * np.pi * step / 60)
        sink.send(Output(step, 0.0, "following", nao.joint_names, q_N, q_N, q_N, 0.0, {}))
    for step in range(60):
        sink.send(Output(step, 0.0, "stopped", nao.joint_names, rest_N, q_N, q_N, 0.0, {}))
    if free:  # nobody balances it: it falls over, onto its arms too, and stays above the floor
        assert -0.1 < sink.data.qpos[2] < 0.5 and np.isfinite(sink.data.qpos).all()
    else:
        assert np.abs(sink.joints - rest_N).max() < 0.05, "gravity and all it holds up to a few degrees"
        assert sink.told().startswith("mujoco: joints were off by 0.0")
    sink.close()


def test_simulation_without_a_model_or_with_another(nao: LiveRobot, root: Path, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    with pytest.raises(UserError, match="write mujoco:MODEL"):
        MujocoSink().open(make_robot(), AT_ONCE)
    with pytest.raises(UserError, match="has no joint left_a"):
        MujocoSink(root / "data/robots/nao/nao.urdf").open(make_robot(), AT_ONCE)
    (tmp_path / "broken.xml").write_text("<mujoco><worldbody><body>")
    with pytest.raises(UserError, match="cannot load"):
        MujocoSink(tmp_path / "broken.xml").open(nao, AT_ONCE)
    with pytest.raises(UserError, match="no such file"):
        MujocoSink(tmp_path / "none.xml").open(nao, AT_ONCE)


def test_a_model_whose_meshes_are_missing_still_moves(tmp_path: Path, nao: LiveRobot) -> None:
    pytest.importorskip("mujoco")
    links = "".join(f'<link name="l{i}"><visual><geometry><mesh filename="package://x/none_{i}.stl"/></geometry></visual>'
                    f'<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>' for i in range(5))  # fmt: skip
    joints = "".join(f'<joint name="{name}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><axis xyz="0 1 0"/>'
                     f'<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>' for i, name in enumerate(nao.joint_names))  # fmt: skip
    (tmp_path / "arm.urdf").write_text(f'<robot name="arm">{links}{joints}</robot>')
    sink = MujocoSink(tmp_path / "arm.urdf")
    with warnings.catch_warnings():
        sink.open(nao, AT_ONCE)
    assert sink.model.nu == 4 and np.allclose(sink.joints, nao.home_N)
