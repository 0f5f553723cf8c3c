"""Whatever is written comes back with the same numbers, in every format; what a format cannot hold is said."""

from __future__ import annotations

import dataclasses
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from scipy.spatial.transform import Rotation

from mrhubo.errors import UserError
from mrhubo.robot_motion import (
    FORMATS,
    FollowingJoint,
    JointOrder,
    RobotMotion,
    find_format,
    read_robot_motion,
    write_robot_motion,
)
from mrhubo.robot_motion import plain as plain_module
from mrhubo.robot_motion.motion import PER_FRAME
from tests.files.bounded import bounded
from tests.robot_motion.motions import assert_same, motions, plain, standing

WHOLE, TABLES, ANGLES = ("npz", "json", "parquet"), ("csv",), ("mujoco", "unitree", "yaml", "mcap", "gmr")
"""Formats that hold everything, every number a frame, and joint angles alone."""
ROOT = ("root_position", "root_quaternion_wxyz")


def need(name: str) -> None:
    if name == "mcap":
        pytest.importorskip("mcap_ros2", reason="the extra `ros` is not installed")


def there_and_back(motion: RobotMotion, folder: Path, name: str) -> RobotMotion:
    path = folder / f"motion{FORMATS[name].ending}"
    write_robot_motion(motion, path, name)
    return read_robot_motion(path, motion.joint_names, motion.frame_rate)


@pytest.mark.parametrize("name", [*WHOLE, *TABLES, *ANGLES])
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(motion=motions())
def test_the_same_numbers_come_back(tmp_path: Path, name: str, motion: RobotMotion) -> None:
    need(name)
    if name in ("yaml", "mcap", "gmr") and motion.frame_rate is None:
        motion = dataclasses.replace(motion, frame_rate=30.0)
    found = there_and_back(motion, tmp_path, name)
    if name in WHOLE:
        assert_same(found, motion)
        for field in ("name", "source", "branch_names", "direction_names", "contact_names"):
            assert getattr(found, field) == getattr(motion, field)
        for field in ("name", "made_by", "checksum", "others"):
            assert getattr(found.robot, field) == getattr(motion.robot, field)
        for field in ("lower", "upper", "velocity"):
            np.testing.assert_array_equal(getattr(found.robot, field), getattr(motion.robot, field))
    else:
        root = ROOT if motion.root_position is not None and name in ("mujoco", "unitree", "mcap", "gmr") else ()
        assert_same(found, motion, PER_FRAME if name in TABLES else ("q", *root))
    if motion.frame_rate is not None and (len(motion) > 1 or name in (*WHOLE, "mujoco", "unitree", "gmr")):
        exact = 1e-5 if name in ("yaml", "mcap") else 1e-14  # whole nanoseconds
        assert found.frame_rate == pytest.approx(motion.frame_rate, rel=exact)


def test_a_bag_tells_base_and_contacts_frame_by_frame(tmp_path: Path) -> None:
    need("mcap")
    motion = standing()
    found = there_and_back(motion, tmp_path, "mcap")
    assert_same(found, motion, ("q", *ROOT, "contact"))
    assert found.contact_names == motion.contact_names
    odd = dataclasses.replace(motion, contact_names=("ein Fuß", "ein_Fu_"))  # no names that ROS has for topics
    told = there_and_back(odd, tmp_path, "mcap")
    assert told.contact_names == ("ein_Fu_", "ein_Fu__1")
    assert_same(told, motion, ("contact",))


@pytest.mark.parametrize("rate", [24.0, 29.97, 60.0, 120.0, 239.01])
@pytest.mark.parametrize("name", ["csv", "yaml"])
def test_a_rate_comes_back_from_times(tmp_path: Path, name: str, rate: float) -> None:
    assert there_and_back(plain(50, rate), tmp_path, name).frame_rate == rate


@pytest.mark.parametrize("name", [*WHOLE, "csv", "mujoco", "unitree", "gmr"])
def test_bytes_depend_on_the_motion_alone(tmp_path: Path, name: str) -> None:
    first, second = (tmp_path / f"{number}{FORMATS[name].ending}" for number in (1, 2))
    for path in (first, second):
        write_robot_motion(plain(), path, name)
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.parametrize("name", ["csv", "unitree", "json", "yaml", "mcap"])
def test_what_is_written_block_by_block_is_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    need(name)
    motion, written = standing(100), []
    for block in (10**9, 64, 1):
        monkeypatch.setattr(plain_module, "_BLOCK", block)
        write_robot_motion(motion, path := tmp_path / f"{block}{FORMATS[name].ending}", name)
        written.append(path.read_bytes())
    assert written[0] == written[1] == written[2]


def test_blocks_are_all_rows_once() -> None:
    for rows, width in ((0, 3), (1, 1), (100_000, 40), (7, 10**6)):
        found = [row for block in plain_module.blocks(rows, width) for row in range(rows)[block]]
        assert found == list(range(rows))
        assert all(
            len(range(rows)[block]) * width <= 2**16 or width > 2**16 for block in plain_module.blocks(rows, width)
        )


def test_json_is_what_json_makes_of_it(tmp_path: Path) -> None:
    """To the byte: facts, then every array as lists of the shortest decimals."""
    for motion in (
        standing(9),
        RobotMotion([0.5, 0.1], ("a", "b"), collision=True),
        RobotMotion(np.zeros((2, 0, 1)), ("ä",)),
    ):
        write_robot_motion(motion, tmp_path / "a.json")
        arrays = {name: array for name in PER_FRAME if (array := getattr(motion, name)) is not None}
        lists = {
            name: array.tolist() if array.dtype == bool or not array.size else array.astype(str).astype(float).tolist()
            for name, array in arrays.items()
        }
        text = json.dumps({**plain_module.facts_of(motion), **lists}, ensure_ascii=False) + "\n"
        assert (tmp_path / "a.json").read_text(encoding="utf-8") == text


@pytest.mark.parametrize("name", ["csv", "json", "yaml"])
def test_writing_takes_little_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """As text at once these numbers would take 130 bytes each."""
    monkeypatch.setattr(plain_module, "_BLOCK", 2_000)
    motion = RobotMotion(np.random.default_rng(0).normal(size=(2_000, 10)), tuple("abcdefghij"), 120.0)
    write_robot_motion(motion, tmp_path / "first.json")  # what is imported on demand
    with bounded(megabytes=60 * motion.q.size / 1e6, seconds=60):
        write_robot_motion(motion, tmp_path / f"a{FORMATS[name].ending}", name)


def test_several_motions_fit_into_an_npz_alone(tmp_path: Path) -> None:
    batch = RobotMotion(np.zeros((2, 3, 1)), ("a",), 30.0)
    assert_same(there_and_back(batch, tmp_path, "npz"), batch)
    assert_same(there_and_back(RobotMotion([0.5], ("a",)), tmp_path, "npz"), RobotMotion([0.5], ("a",)))
    assert there_and_back(RobotMotion([0.5], ("a",)), tmp_path, "csv").q.tolist() == [[0.5]]
    for name in ("csv", "parquet", "mujoco", "unitree", "yaml", "gmr"):
        with pytest.raises(UserError, match=r"x: .*holds one motion, found joint angles of shape \(2, 3, 1\)"):
            write_robot_motion(batch, tmp_path / "x", name)
    assert not (tmp_path / "x").exists()


def test_csv_is_a_table_that_people_read(tmp_path: Path) -> None:
    motion = RobotMotion(
        np.float32([[0.1, -1.5], [1 / 3, 1e-9]]), ("left, elbow", "head"), 4.0, collision=[True, False]
    )
    write_robot_motion(motion, tmp_path / "new" / "a.csv")
    lines = (tmp_path / "new" / "a.csv").read_text().splitlines()
    assert lines == ['time [s],"left, elbow [rad]",head [rad],collision', "0.0,0.1,-1.5,1", "0.25,0.33333334,1e-09,0"]


def test_gmrs_pickle_is_what_its_readers_take(tmp_path: Path) -> None:
    half = np.float32(np.sqrt(0.5))
    motion = plain(1, root_position=[[1, 2, 3]], root_quaternion_wxyz=[[half, 0, 0, -half]])
    write_robot_motion(motion, tmp_path / "a.pkl")
    data = (tmp_path / "a.pkl").read_bytes()
    assert b"numpy.core.multiarray" in data and b"numpy._core" not in data  # NumPy 1 knows no other
    value = pickle.loads(data)
    assert set(value) == {"fps", "root_pos", "root_rot", "dof_pos", "local_body_pos", "link_body_list", "joint_names"}
    assert value["fps"] == 30 and isinstance(value["fps"], int) and value["local_body_pos"] is None
    assert value["root_rot"][0].tolist() == pytest.approx([0, 0, -half, half])
    np.testing.assert_array_equal(value["dof_pos"], motion.q)
    value["root_pos"][:, 2] -= 0.1  # as they do
    with pytest.raises(UserError, match="frame rate is not known"):
        write_robot_motion(dataclasses.replace(motion, frame_rate=None), tmp_path / "b.pkl")


def test_what_gmr_itself_writes_is_read_by_the_names_of_joints(tmp_path: Path) -> None:
    motion = plain(5)
    value = {
        "fps": 30, "root_pos": np.zeros((5, 3)), "root_rot": np.tile([0.0, 0.0, 0.0, 1.0], (5, 1)),
        "dof_pos": motion.q.astype(np.float64), "local_body_pos": None, "link_body_list": None,
    }  # fmt: skip
    path = tmp_path / "g1_walk.pkl"
    path.write_bytes(pickle.dumps(value))
    found = read_robot_motion(path, motion.joint_names)
    assert_same(found, motion, ["q"])
    assert found.frame_rate == 30 and found.root_quaternion_wxyz is not None
    assert found.root_quaternion_wxyz[0].tolist() == [1, 0, 0, 0]
    with pytest.raises(UserError, match="have to be named"):
        read_robot_motion(path)
    with pytest.raises(UserError, match="have shapes"):
        read_robot_motion(path, ["a"])
    path.write_bytes(pickle.dumps({"q": motion.q}))
    with pytest.raises(UserError, match="'dof_pos' is missing"):
        read_robot_motion(path, motion.joint_names)


def test_unitree_has_the_base_first_and_w_last(tmp_path: Path) -> None:
    half = np.float32(np.sqrt(0.5))
    motion = plain(1, root_position=[[1, 2, 3]], root_quaternion_wxyz=[[half, 0, 0, -half]])
    notes = write_robot_motion(motion, tmp_path / "a.csv", "unitree")
    numbers = [float(number) for number in (tmp_path / "a.csv").read_text().strip().split(",")]
    assert numbers[:7] == pytest.approx([1, 2, 3, 0, 0, -half, half])
    assert np.float32(numbers[7:]).tolist() == motion.q[0].tolist()
    assert notes[-1] == "such a file names neither joints nor its frame rate, which is 30: tell who reads it"
    with pytest.raises(UserError, match="no header, so its joints have to be named"):
        read_robot_motion(tmp_path / "a.csv")
    with pytest.raises(UserError, match="has 10 columns; expected 7 of the base and 1 joints"):
        read_robot_motion(tmp_path / "a.csv", ["a"])


def test_qpos_has_the_models_free_joint(tmp_path: Path) -> None:
    order = JointOrder(("knee", "left_elbow"), "model.xml", "base", (0.0, 0.0, 0.8))
    notes = write_robot_motion(motion := plain(), tmp_path / "a.npz", "mujoco", order)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as file:
        assert file["qpos"].shape == (6, 9) and str(file["free_joint"]) == "base"
        assert str(file["quaternion_order"]) == "wxyz" and file["joint_names"].tolist() == ["knee", "left_elbow"]
        assert file["qpos"][0, :8].tolist() == pytest.approx([0, 0, 0.8, 1, 0, 0, 0, 0])
        np.testing.assert_array_equal(file["qpos"][:, 8], motion.q[:, 1])
    assert notes[0] == "held at 0 rad, as the motion does not turn them: knee"
    assert notes[-1] == "the motion tells nothing of the base, which stays where model.xml has it"


def test_a_free_joint_may_move_another_link_than_the_urdfs_base(tmp_path: Path) -> None:
    still, path = standing(), tmp_path / "a.npz"
    turned = Rotation.from_euler("xyz", [20, -30, 50], degrees=True)
    on_base = {"floor": (0.0, 0, 0, 1, 0, 0, 0), "torso": (0.1, 0.2, 0.3, *turned.as_quat(scalar_first=True).tolist())}
    motion = dataclasses.replace(still, robot=dataclasses.replace(still.robot, on_base=on_base))
    assert still.root_position is not None and still.root_quaternion_wxyz is not None
    base = (still.root_position, turn := quaternions(still.root_quaternion_wxyz))
    torso = (still.root_position + turn.apply([0.1, 0.2, 0.3]), turn * turned)
    for body, (place, way), words in (
        ("torso", torso, "moves 'torso', 0.374 m from"), ("floor", base, ""), ("other", base, "'other', which is not fixed"),
    ):  # fmt: skip
        order = JointOrder(motion.joint_names, "model.xml", "free", free_body=body)
        assert words in " ".join(write_robot_motion(motion, path, "mujoco", order))
        assert "does not tell where the base goes" in write_robot_motion(motion, tmp_path / "a.yaml")[-1]
        found = read_robot_motion(path)
        assert found.root_position is not None and found.root_quaternion_wxyz is not None
        np.testing.assert_allclose(found.root_position, place, atol=1e-6)
        assert (quaternions(found.root_quaternion_wxyz) * way.inv()).magnitude().max() < 1e-5


def quaternions(wxyz_T4: np.ndarray) -> Rotation:
    return Rotation.from_quat(wxyz_T4, scalar_first=True)


def test_an_order_turns_what_follows_and_holds_what_is_held(tmp_path: Path) -> None:
    motion = plain()
    order = JointOrder(("finger", "waist", "left_elbow"), "order.txt")
    notes = write_robot_motion(motion, tmp_path / "a.npz", joint_order=order)
    found = read_robot_motion(tmp_path / "a.npz")
    expected = np.stack([0.5 - 2 * motion.q[:, 1], np.full(6, 0.25), motion.q[:, 1]], axis=1)
    np.testing.assert_allclose(found.q, expected, atol=1e-6)
    assert found.robot.others == (FollowingJoint("knee"),) and found.robot.lower is None
    assert notes == (
        "held at 0.25 rad, as the motion does not turn them: waist",
        "joints that mimic others follow them: finger",
        "joints that order.txt does not have are left out: left_shoulder, right_shoulder",
    )
    with pytest.raises(UserError, match=r"order.txt: joint 'waits' does not exist in the robot robo; nearest: 'waist'"):
        write_robot_motion(motion, tmp_path / "b.npz", joint_order=JointOrder(("waits",), "order.txt"))
    assert not (tmp_path / "b.npz").exists()


@pytest.mark.parametrize("name", ["mujoco", "unitree", "gmr"])
def test_joints_that_a_simulator_would_leave_at_0_are_told(tmp_path: Path, name: str) -> None:
    """`knee` is held at 0, where whatever plays the file has it anyway."""
    motion, path = plain(), tmp_path / f"a{FORMATS[name].ending}"
    told = "are not in it: finger, waist; a --joint-order that names them has them written"
    assert any(told in note for note in write_robot_motion(motion, path, name))
    order = JointOrder((*motion.joint_names, "knee"), "order.txt")
    assert not any("not in it" in note for note in write_robot_motion(motion, path, name, order))
    bare = RobotMotion(motion.q, motion.joint_names, motion.frame_rate)
    assert not any("not in it" in note for note in write_robot_motion(bare, path, name))


def test_limits_are_those_of_the_order(tmp_path: Path) -> None:
    motion = plain()
    motion = dataclasses.replace(motion, robot=dataclasses.replace(motion.robot, lower=[-3.0, -2.0, -1.0]))
    write_robot_motion(motion, tmp_path / "a.json", joint_order=JointOrder(motion.joint_names[::-1]))
    found = read_robot_motion(tmp_path / "a.json")
    assert found.robot.lower is not None and found.robot.lower.tolist() == [-1.0, -2.0, -3.0]
    assert_same(found, dataclasses.replace(motion, q=motion.q[:, ::-1], joint_names=motion.joint_names[::-1]), ["q"])


@pytest.mark.parametrize(
    ("path", "name", "found"),
    [
        ("a.npz", None, "npz"), ("a.CSV", None, "csv"), ("a.yml", None, "yaml"), ("a.mcap", None, "mcap"),
        ("a.pkl", None, "gmr"), ("a.anything", "unitree", "unitree"), ("a.npz", "mujoco", "mujoco"),
    ],
)  # fmt: skip
def test_the_ending_says_the_format_unless_one_is_asked_for(path: str, name: str | None, found: str) -> None:
    assert find_format(Path(path), name) == found


@pytest.mark.parametrize("name", FORMATS)
def test_names_need_not_be_utf_8(tmp_path: Path, name: str) -> None:
    """As those of files from another system."""
    need(name)
    path = tmp_path / "w\udce4lle" / f"a\udcfc{FORMATS[name].ending}"
    path.parent.mkdir()
    motion = plain()
    told = dataclasses.replace(motion, name="a\udcfc", source="from w\udce4lle")
    write_robot_motion(told, path, name)
    found = read_robot_motion(path, told.joint_names, told.frame_rate)
    np.testing.assert_allclose(found.q, motion.q, atol=1e-6)
    assert found.name in ("a\ufffd", "a\udcfc", "")


def test_formats_that_do_not_exist_are_told_what_there_is() -> None:
    with pytest.raises(UserError, match=r"a\.txt: the name must end in \.npz, .*or a format be named: lerobot, mujoco"):
        find_format(Path("a.txt"))
    with pytest.raises(UserError, match="format 'mujocco' does not exist; nearest: 'mujoco'"):
        find_format(Path("a.npz"), "mujocco")


@pytest.mark.parametrize("name", ["yaml", "mcap", "lerobot"])
def test_times_need_a_rate(tmp_path: Path, name: str) -> None:
    need(name)
    with pytest.raises(UserError, match="no frame rate|frames a second, the motion's is not known"):
        write_robot_motion(plain(rate=None), tmp_path / "a", name)
    assert not (tmp_path / "a").exists()
