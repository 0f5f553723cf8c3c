"""The command `mrhubo retarget` as a user runs it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mrhubo
from mrhubo import rotation
from mrhubo.errors import UserError
from mrhubo.motion import mirror, read_motion, resample, write_motion
from mrhubo.retarget import main
from mrhubo.robot_motion import read_robot_motion
from tests.chain import cut_motion, new_package
from tests.motion.bvh_writer import Style, write_bvh
from tests.reference.standing.steppers import squat

pytestmark = pytest.mark.usefixtures("few_poses")


@pytest.fixture(scope="module")
def package(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return new_package(root / "conf" / "nao.yaml", tmp_path_factory.mktemp("packages") / "nao", "model.hidden=8")


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    return cut_motion("wave", tmp_path, (1, 2), every=6)


def test_a_package_answers_a_file(
    root: Path, package: Path, wave: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["--retargeter", str(package), "--motion", str(wave), "--out", str(tmp_path / "wave.json")]
    assert main([*given, "--from", "0.2", "--to", "0.7", "--out-rate", "20", "--mirror"]) == 0
    found = read_robot_motion(tmp_path / "wave.json")
    assert found.name == "wave_mirrored" and found.frame_rate == 20.0 and len(found) == 11
    assert found.robot.name == "nao" and found.robot.made_by == "package nao" and len(found.robot.checksum) == 16
    assert found.robot.lower is not None and (found.q >= found.robot.lower).all()
    assert "SMPL-family" in found.source and found.confidence is not None
    output = capsys.readouterr().out
    assert "package nao: robot 'nao', 8 joints" in output and f"written: {tmp_path}/wave.json" in output
    assert "touches itself" in output.splitlines()[-2] and output.splitlines()[-1].startswith("wave_mirrored")
    order = root / "data" / "robots" / "nao" / "nao.urdf"
    assert main([*given[:-1], str(tmp_path / "q.csv"), "--format", "unitree", "--joint-order", str(order)]) == 0
    output = capsys.readouterr().out
    assert "as the motion does not turn them" in output and "RHipYawPitch" in output
    assert "names neither joints nor its frame rate, which is 10" in output


def test_a_package_answers_files_without_pytorch(package: Path, wave: Path, tmp_path: Path) -> None:
    """Nor do SciPy and the robot's libraries take their time; the answer is PyTorch's."""
    (tmp_path / "walk.bvh").write_text(write_bvh(read_motion(wave), Style()))
    script = (
        "import sys\n"
        "class Refuse:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name.partition('.')[0] in ('torch', 'lightning', 'scipy', 'yourdfpy', 'pytorch_kinematics', 'mlflow'):\n"
        "            raise ModuleNotFoundError(name)\n"
        "sys.meta_path.insert(0, Refuse())\n"
        "from mrhubo.cli import dispatch\n"
        "sys.exit(dispatch(['retarget', *sys.argv[1:]]))\n"
    )
    given = ["--retargeter", str(package), "--motion", str(wave), "walk.bvh", "--out", "out/", "--out-rate", "15"]
    done = subprocess.run(
        [sys.executable, "-c", script, *given, "--mirror"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for name, file in (("wave_mirrored", wave), ("walk_mirrored", tmp_path / "walk.bvh")):
        found = read_robot_motion(tmp_path / "out" / f"{name}.npz")
        wanted = mrhubo.load(package)(mirror(resample(read_motion(file), 15.0))).robot_motion
        assert found.robot.made_by == wanted.robot.made_by and found.robot.checksum == wanted.robot.checksum
        assert (found.name, found.source, found.frame_rate) == (name, wanted.source, 15.0)
        for field in ("joint_names", "branch_names", "direction_names"):
            assert getattr(found, field) == getattr(wanted, field)
        for field, most in (("q", 1e-3), ("confidence", 1e-2), ("direction_error_deg", 0.1), ("phi", 1e-3)):
            np.testing.assert_allclose(getattr(found, field), getattr(wanted, field), atol=most)


@pytest.mark.parametrize(
    ("method", "maker", "said"),
    [
        ([], "the universal network of mrhubo, without training", "the universal network answers"),
        (["--method", "reference"], "the optimiser of mrhubo", "by optimisation and without any training"),
    ],
)
def test_a_robot_without_a_package_is_answered(
    method: list[str], maker: str, said: str, wave: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["--robot", "nao", *method, "--motion", str(wave), "--out", f"{tmp_path}/out/", "--to", "0.3"]
    assert main(given) == 0
    found = read_robot_motion(tmp_path / "out" / "wave.npz")
    assert found.robot.made_by == maker and (found.confidence is None) == bool(method) and len(found) == 4
    assert said in capsys.readouterr().out


def test_a_video_has_a_flag_of_its_name(wave: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[str] = []
    monkeypatch.setattr("mrhubo.retargeting.find_files", lambda paths: found.extend(map(str, paths)) or [wave])
    for flag in ("--video", "--motion"):
        assert main(["--robot", "nao", flag, "dance.mp4", "--out", str(tmp_path / f"{flag}.npz"), "--to", "0.1"]) == 0
    assert found == ["dance.mp4"] * 2
    with pytest.raises(UserError, match="not allowed with|go together|--video"):
        main(["--robot", "nao", "--video", "dance.mp4", "--motion", "wave.npz", "--out", str(tmp_path / "x.npz")])


def test_a_whole_bodys_base_is_written(tmp_path: Path) -> None:
    motion = squat(frames=6)
    turns_TJ3 = rotation.matrix_to_axis_angle(motion.local_TJ33).flatten(1).numpy()
    place_T3 = motion.arrays.root_position_T3
    write_motion(tmp_path / "squat.npz", turns_TJ3, 0 * place_T3, place_T3, 24.0, "squats")
    given = ["--robot", "nao-whole-body", "--motion", str(tmp_path / "squat.npz"), "--no-avoid-collisions", "--quiet"]
    assert main([*given, "--out", str(tmp_path / "robot.npz")]) == 0
    assert main([*given, "--out", str(tmp_path / "qpos.npz"), "--format", "mujoco"]) == 0
    found, qpos = read_robot_motion(tmp_path / "robot.npz"), np.load(tmp_path / "qpos.npz")["qpos"]
    assert found.root_position is not None and found.root_quaternion_wxyz is not None
    assert qpos.shape == (6, 7 + len(found.joint_names))
    np.testing.assert_allclose(qpos[:, :3], found.root_position, atol=1e-6)
    np.testing.assert_allclose(qpos[:, 3:7], found.root_quaternion_wxyz, atol=1e-6)
    # NAO's base lies 0.33 m under its torso, where its feet are when it stands.
    assert abs(found.root_position[:, 2]).max() < 0.15
    np.testing.assert_allclose(found.root_quaternion_wxyz, np.tile([1, 0, 0, 0], (6, 1)), atol=1e-5)


def test_a_whole_body_needs_no_config(root: Path, tmp_path: Path) -> None:
    motion = squat(frames=3)
    turns_TJ3 = rotation.matrix_to_axis_angle(motion.local_TJ33).flatten(1).numpy()
    place_T3 = motion.arrays.root_position_T3
    write_motion(tmp_path / "squat.npz", turns_TJ3, 0 * place_T3, place_T3, 24.0, "squats")
    given = ["--motion", str(tmp_path / "squat.npz"), "--no-avoid-collisions", "--quiet"]
    urdf = str(root / "data/robots/nao/nao.urdf")
    for name, robot in (("yaml", ["nao-whole-body"]), ("urdf", [urdf, "--whole-body"])):
        assert main(["--robot", *robot, *given, "--out", str(tmp_path / f"{name}.npz")]) == 0
    by_hand, found = (read_robot_motion(tmp_path / f"{name}.npz") for name in ("yaml", "urdf"))
    assert found.root_position is not None and set(by_hand.joint_names) < set(found.joint_names)
    legs = [name for name in by_hand.joint_names if "Hip" in name or "Knee" in name]
    q_by_hand, q_found = (m.q[:, [m.joint_names.index(name) for name in legs]] for m in (by_hand, found))
    np.testing.assert_allclose(q_found, q_by_hand, atol=0.02)


def test_a_bad_file_among_several_is_told_at_the_end(
    package: Path, wave: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.npz"
    bad.write_text("nothing")
    given = ["--retargeter", str(package), "--quiet", "--out", f"{tmp_path}/out/"]
    assert main([*given, "--motion", str(bad), str(wave)]) == 2
    said = capsys.readouterr()
    assert said.err.splitlines()[-1] == f"error: 1 of 2 motions could not be retargeted: {bad}"
    assert len(said.err.splitlines()) == 2 and (tmp_path / "out" / "wave.npz").is_file()
    with pytest.raises(UserError, match="bad.npz"):
        main([*given, "--motion", str(bad)])


def test_the_robot_gives_way_unless_told_otherwise(root: Path, tmp_path: Path) -> None:
    motion = str(root / "data" / "motions" / "crossing_arms.npz")
    given = ["--robot", "nao", "--motion", motion, "--from", "2", "--to", "3", "--out-rate", "12"]
    assert main([*given, "--out", str(tmp_path / "free.npz")]) == 0
    assert main([*given, "--no-avoid-collisions", "--out", str(tmp_path / "shown.npz")]) == 0
    free, shown = (read_robot_motion(tmp_path / f"{name}.npz") for name in ("free", "shown"))
    assert free.collision is not None and shown.collision is not None
    assert shown.collision.sum() > free.collision.sum() == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "a.npz"], "--retargeter --robot is required|--motion FILE"),
        (["--robot", "nao", "--retargeter", "x"], "does not go together with"),
        (["wave.npz", "--robot", "nao", "--motion", "a", "--out", "b"], "'wave.npz' stands alone"),
        (["a=b", "--robot", "nao", "--motion", "a", "--out", "b"], "'a=b' is not a flag"),
        (["--to", "-1"], "--to must be a number of at least 0"),
        (["--robot", "nao", "--motion", "a.npz", "--out", "a.csv", "--rate", "0"], "the rate is 0"),
        (["--robot", "nao", "--motion", "a.npz", "--out", "a.csv", "--format", "cvs"], "format 'cvs' does not exist"),
        (
            ["--robot", "nao", "--motion", "a.npz", "--out", "a.csv", "--joint-order", "none.txt"],
            "none.txt: there is no",
        ),
        (["--robot", "nao", "--motion", "a", "--out", "b", "--method", "refrence"], "nearest: 'reference'"),
        (["--retargeter", "x", "--motion", "a", "--out", "b", "--method", "reference"], "goes with --robot alone"),
        (["--robot", "nao", "--whole-body", "--motion", "a.npz", "--out", "b.npz"], "says itself what of a body"),
        (["--retargeter", "x", "--whole-body", "--motion", "a", "--out", "b"], "--whole-body goes with --robot alone"),
        (["--robot", "nobody", "--motion", "a.npz", "--out", "a.csv"], "'nobody' is no file"),
        (["--retargeter", "nobody", "--motion", "a.npz", "--out", "a.csv"], "nobody: is no package"),
    ],
)
def test_mistakes_are_said_before_any_work(arguments: list[str], message: str) -> None:
    with pytest.raises(UserError, match=message):
        main(arguments)
