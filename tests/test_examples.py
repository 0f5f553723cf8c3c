"""The numbered examples and the Python that README and docs show, run against a package whose networks are untrained."""

from __future__ import annotations

import importlib.util
import re
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image

import mrhubo
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.robot import build_body_map
from tests.chain import cut_motion

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
MAX_LINES = 60


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> str:
    config = load_config(ROOT / "conf" / "nao.yaml", ["model.hidden=24"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    retargeter = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    return str(retargeter.save(tmp_path_factory.mktemp("packages") / "nao", {}))


@pytest.fixture(autouse=True)
def somewhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is written into the checkout; relative paths in `data` are found."""
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)


def run(name: str, *arguments: Any) -> None:
    spec = importlib.util.spec_from_file_location("example", ROOT / "examples" / name)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main(*arguments)


def blocks(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_numbered_short_and_tested(path: Path) -> None:
    number = EXAMPLES.index(path) + 1
    assert path.name.startswith(f"{number:02}_")
    assert len(path.read_text().splitlines()) < MAX_LINES
    assert f'"{path.name}"' in Path(__file__).read_text(), "no test runs it"


def test_retarget_a_file(package: str, tmp_path: Path) -> None:
    run("01_retarget_a_file.py", package, str(cut_motion("wave", tmp_path, (0, 2))), "angles.csv")
    assert len((tmp_path / "angles.csv").read_text().splitlines()) == 1 + 120


def test_your_own_arrays(package: str, capsys: pytest.CaptureFixture[str]) -> None:
    run("02_your_own_arrays.py", package)
    text = capsys.readouterr().out
    assert "(63,) -> joint angles (8,)" in text and "(2, 2, 63) -> joint angles (2, 2, 8)" in text
    differences = [float(number) for number in re.findall(r"within (\S+) rad", text)]
    assert len(differences) == 2 and max(differences) < 1e-3


def test_optimization_without_training(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("03_optimization_without_training.py", "nao")
    (angle,) = re.findall(r"are (\S+) degrees off", capsys.readouterr().out)
    assert float(angle) < 10  # NAO can follow a wave
    with np.load(tmp_path / "wave_on_nao.npz") as file:
        assert file["q"].shape == (433, 8)


@pytest.mark.parametrize("robot", ["nao", "reachy"])
def test_robot_kinematics(robot: str, capsys: pytest.CaptureFixture[str]) -> None:
    run("04_robot_kinematics.py", robot)
    text = capsys.readouterr().out
    assert text.startswith(f"{robot}: {8 if robot == 'nao' else 17} joints")
    (touching,) = re.findall(r"touches itself in (\d+)%", text)
    assert 0 < int(touching) < 100


def test_body_prior(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("05_body_prior.py", "prior.png")
    sampled, spoilt, mended = (float(e) for e in re.findall(r"error (\S+) on average", capsys.readouterr().out))
    assert sampled < 0.2 * spoilt and mended < 0.2 * spoilt
    with Image.open(tmp_path / "prior.png") as picture:
        assert picture.format == "PNG" and min(picture.size) > 500


def test_moving_picture(package: str, tmp_path: Path) -> None:
    run("06_moving_picture.py", package, str(ROOT / "data" / "motions" / "wave.npz"), "nao.gif", 1.0, 0.5)
    with Image.open(tmp_path / "nao.gif") as picture:
        assert getattr(picture, "n_frames", 1) == 6


def test_ros_bag(package: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mcap_ros2", reason="the extra `ros` is not installed")
    run("07_ros_bag.py", package)
    text = capsys.readouterr().out
    assert "wave.mcap: 433 points at 60 per second" in text and "what was written: 0 rad" in text


def test_stream(package: str, capsys: pytest.CaptureFixture[str]) -> None:
    run("08_stream.py", package)
    text = capsys.readouterr().out
    speeds = re.findall(r"(\S+) rad/s at most, of (\S+)", text)
    assert text.startswith("120 frames, ") and len(speeds) == 8
    assert all(float(speed) <= float(limit) for speed, limit in speeds)
    assert any(float(speed) > 0.1 for speed, _ in speeds)


def test_onnx(package: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for needed in ("onnx", "onnxruntime"):
        pytest.importorskip(needed)
    run("09_onnx.py", package)
    text = capsys.readouterr().out
    assert (tmp_path / "robot.onnx").is_file() and "joints: LShoulderPitch, " in text
    (off,) = re.findall(r"433 frames, (\S+) rad off at most", text)
    assert float(off) < 1e-4


def test_live(package: str, capsys: pytest.CaptureFixture[str]) -> None:
    run("10_live.py", package, str(ROOT / "data" / "motions" / "wave.npz"), "0.3")
    text = capsys.readouterr().out
    assert text.startswith("8 joints, 60 times a second") and "following" in text and "ended" in text
    (fastest,) = re.findall(r"faster than (\S+) rad/s", text)
    assert 0 < float(fastest) <= 5


def test_code_of_a_sink_and_a_session_runs(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from mrhubo import live

    arm = SimpleNamespace(
        told=[], angles=lambda names: robot.home_N + arm.off, set_watchdog=lambda seconds: None, is_well=lambda: True,
        target=lambda names, q_N, velocity_N: arm.told.append(q_N), disconnect=lambda: arm.told.append("end"), off=1.0,
    )  # fmt: skip
    sink, session = [code for code in blocks("docs/live.md") if "MyArm" in code]
    names: dict[str, Any] = {"my_sdk": SimpleNamespace(connect=lambda address: arm)}
    calls: list[Any] = []
    monkeypatch.setattr(live, "run", lambda *arguments: calls.append(arguments))
    exec(sink, names)
    exec(re.sub(r"mlruns/packages/nao-\w+", package, session), names)
    ((robot, (source,), (made,), config),) = calls
    assert config.rate == 100 and source.endpoint.port == 8766
    with pytest.raises(mrhubo.UserError, match="at home"):
        made.open(robot, config)
    arm.off = 0.0
    own = live.Session.of(robot, [], [made], config)
    own.open()
    own.step(0.0)
    own.close()
    assert np.allclose(arm.told[0], robot.home_N) and arm.told[1] == "end"


def test_code_that_writes_runs(package: str) -> None:
    (code,) = [code for code in blocks("docs/python.md") if "read_joint_order" in code]
    motion = mrhubo.read_motion(ROOT / "data" / "motions" / "wave.npz")
    names: dict[str, Any] = {"mrhubo": mrhubo, "result": mrhubo.load(package)(motion, polish=0, together=False)}
    exec(code, names)
    assert len(names["same"]) == 433 and "held" in names["notes"][0]


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/python.md"])
def test_code_that_retargets_runs(page: str, package: str) -> None:
    shown = [code for code in blocks(page) if "mrhubo.load" in code]
    assert shown
    for code in shown:
        names: dict[str, Any] = {}
        exec(re.sub(r"mlruns/packages/nao-\w+|models:/mrhubo-nao/1", package, code), names)
        result = names["result"]
        assert tuple(result.q.shape) == (433, 8) and len(result.joint_names) == 8
        assert bool(((result.confidence >= 0) & (result.confidence <= 1)).all())


def test_code_without_pytorch_runs(package: str) -> None:
    (code,) = [code for code in blocks("docs/fast.md") if 'load_fast("mlruns' in code]
    names: dict[str, Any] = {"poses": np.tile(np.eye(3), (2, 21, 1, 1))}
    exec(re.sub(r"mlruns/packages/nao-\w+", package, code), names)
    assert names["answer"].q.shape == (433, 8) and names["angles"].shape == (2, 8)


@pytest.mark.usefixtures("few_poses")
def test_whole_bodies_without_pytorch_run() -> None:
    """The code for a robot on feet, with a person who stands before the camera and a robot that takes note."""
    (code,) = [code for code in blocks("docs/fast.md") if "nao-whole-body" in code]
    sent: list[tuple[Any, ...]] = []
    robot = SimpleNamespace(move=lambda *told: sent.append(told))
    person = np.tile(np.eye(3), (21, 1, 1)), np.eye(3), np.array([0.0, 0.9, 0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec("import mrhubo\n" + code, {"camera": [person] * 3, "robot": robot})
    assert len(sent) == 3 and all(np.isfinite(part).all() for told in sent for part in told)
    assert sent[-1][1].shape == (3,) and sent[-1][3].all()


def test_the_readme_shows_six_lines() -> None:
    (code,) = blocks("README.md")
    assert len([line for line in code.splitlines() if line]) == 6


def test_code_that_optimises_runs() -> None:
    (code,) = [code for code in blocks("docs/python.md") if "OptimizationRetargeter" in code]
    names: dict[str, Any] = {}
    exec(code, names)
    assert tuple(names["result"].q.shape) == (433, 8)
