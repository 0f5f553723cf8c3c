"""The network for every robot in an ONNX file answers as its iterations in NumPy do."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

import mrhubo
from mrhubo import export, rotation
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.exporting import onnx_universal, write_onnx
from mrhubo.fast import FastRetargeter
from mrhubo.retargeter import Retargeter, UniversalJoints, build_network
from mrhubo.robot import BodyMap, Robot, build_body_map
from tests.fast.untrained import random_network

pytest.importorskip("onnx")
onnxruntime = pytest.importorskip("onnxruntime")

pytestmark = pytest.mark.usefixtures("few_poses")
SAME_RAD = 1e-5


@pytest.fixture(scope="module")
def retargeter(request: pytest.FixtureRequest) -> Retargeter:
    network = random_network(request.param)
    body_map, prior = BodyMap.of(Robot.from_config(request.param)), BodyPrior(hidden=8).eval()
    return Retargeter(UniversalJoints(body_map, network), body_map, prior, None, phi_threshold=0.01)


@pytest.fixture(scope="module")
def poses() -> np.ndarray:
    """Some far out of reach, and a person at rest, whose straight arms have no plane."""
    turns = torch.randn(40, 21, 3, generator=torch.Generator().manual_seed(0))
    turns[20:] *= 0.4
    turns[-1] = 0
    return rotation.axis_angle_to_matrix(turns).numpy()


@pytest.mark.parametrize(
    ("retargeter", "given"),
    [("nao", "poses"), ("nao", "directions"), ("coman", "poses"), ("reachy", "poses"), ("reachy", "directions")],
    indirect=["retargeter"],
)
def test_it_answers_as_the_plain_form(retargeter: Retargeter, poses: np.ndarray, given: str, tmp_path: Path) -> None:
    path, plain = tmp_path / "robot.onnx", FastRetargeter(retargeter.describe(), "numpy")
    assert write_onnx(retargeter, path, given) < 1e-3
    session = onnxruntime.InferenceSession(path)
    name, asked = ("local_rotations", poses) if given == "poses" else ("directions", plain.directions(poses))
    asked = np.asarray(asked, np.float32)
    (found_BN,) = session.run(None, {name: asked})
    wanted_BN = plain.predict(poses) if given == "poses" else plain.imitate(asked, polish=0).q
    assert np.quantile(np.abs(found_BN - wanted_BN), 0.98) < SAME_RAD, "random weights enlarge the rounding of some"
    limits = (limit.cpu().numpy() for limit in (retargeter.directions.lower_N, retargeter.directions.upper_N))
    lower_N, upper_N = limits
    assert ((found_BN >= lower_N) & (found_BN <= upper_N)).all() and np.ptp(found_BN, axis=0).min() > 0.01
    one_BN = np.concatenate([session.run(None, {name: asked[row : row + 1]})[0] for row in range(4)])
    np.testing.assert_allclose(one_BN, found_BN[:4], atol=SAME_RAD)
    broken = asked[:4].copy()
    broken[2, 1, 0] = np.inf
    assert np.isnan(session.run(None, {name: broken})[0]).all(1).tolist() == [False, False, True, False]
    told = session.get_modelmeta().custom_metadata_map
    assert json.loads(told["joint_names"]) == list(retargeter.joint_names)
    assert told["network"] == "the one for every robot, in five iterations"


def test_a_tuned_package(root: Path, tmp_path: Path, poses: np.ndarray) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["model.start=universal"])
    body_map = build_body_map(config.robot)
    network, prior = build_network(config, body_map), BodyPrior(hidden=8).eval()
    assert isinstance(network, UniversalJoints)
    with torch.no_grad():
        network.optimiser.network.later.bias += 0.01  # what a fit leaves is not what is shipped
    package = Retargeter(network, body_map, prior, config, phi_threshold=0.01).save(tmp_path / "package", {})
    path = tmp_path / "nao.onnx"
    export.main(["--retargeter", str(package), "--to", "onnx", "--out", str(path)])
    (found_BN,) = onnxruntime.InferenceSession(path).run(None, {"local_rotations": poses})
    wanted_BN = mrhubo.load_fast(package, "numpy").predict(poses)
    assert np.quantile(np.abs(found_BN - wanted_BN), 0.98) < SAME_RAD


def test_a_robot_without_a_package(tmp_path: Path, capsys: pytest.CaptureFixture[str], poses: np.ndarray) -> None:
    path = tmp_path / "nao.onnx"
    export.main(["--robot", "nao", "--to", "onnx", "--out", str(path)])
    assert "8 joints of 'nao'" in capsys.readouterr().out
    (found_BN,) = onnxruntime.InferenceSession(path).run(None, {"local_rotations": poses})
    assert found_BN.shape == (len(poses), 8) and np.isfinite(found_BN).all()


@pytest.mark.parametrize("retargeter", ["nao"], indirect=True)
def test_a_wrong_file_is_not_written(retargeter: Retargeter, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(onnx_universal, "silu", lambda x: x)
    with pytest.raises(UserError, match="from mrhubo's"):
        write_onnx(retargeter, tmp_path / "robot.onnx")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["--robot", "nao", "--to", "numpy", "--out", "nao.py"], "write an ONNX file"),
        (["--robot", "nao-whole-body", "--to", "onnx", "--out", "nao.onnx"], "does not know a branch of this one"),
        (["--retargeter", "nao", "--whole-body", "--to", "onnx", "--out", "nao.onnx"], "goes with --robot alone"),
    ],
)
def test_what_no_file_can_have_is_refused(
    arguments: list[str], fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=fault):
        export.main(arguments)
    assert not list(tmp_path.iterdir())
