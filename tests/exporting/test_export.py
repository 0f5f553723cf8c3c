"""What is exported answers as PyTorch does, without mrhubo."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo import export, rotation
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.exporting import standalone, write_numpy, write_onnx
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.robot import build_body_map
from tests.model_kinds import MODELS

SAME_RAD = 2e-6
MOST_LINES = 150


@pytest.fixture(scope="module", params=MODELS)
def retargeter(root: Path, request: pytest.FixtureRequest) -> Retargeter:
    config = load_config(root / "conf" / f"{request.param}.yaml", MODELS[request.param])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    return Retargeter(build_network(config, body_map), body_map, BodyPrior(hidden=8).eval(), config, phi_threshold=0.01)


@pytest.fixture(scope="module")
def poses() -> torch.Tensor:
    turns = torch.randn(12, 21, 3, generator=torch.Generator().manual_seed(0))
    turns[8:] = 0
    return rotation.axis_angle_to_matrix(turns)


def test_onnx(retargeter: Retargeter, poses: torch.Tensor, tmp_path: Path) -> None:
    onnx, reference = pytest.importorskip("onnx"), pytest.importorskip("onnx.reference")
    path = tmp_path / "robot.onnx"
    assert write_onnx(retargeter, path) < SAME_RAD
    model = onnx.load(path)
    evaluator = reference.ReferenceEvaluator(model)
    for batch in (poses, poses[:1]):
        (found,) = evaluator.run(["joint_angles"], {"local_rotations": batch.numpy()})
        np.testing.assert_allclose(found, retargeter.predict(batch).numpy(), atol=SAME_RAD)
    told = {entry.key: entry.value for entry in model.metadata_props}
    assert json.loads(told["joint_names"]) == list(retargeter.joint_names)
    assert json.loads(told["upper_rad"]) == pytest.approx(retargeter.directions.upper_N.tolist())
    assert told["input"].startswith("local_rotations") and told["output"].startswith("joint_angles")
    if retargeter.body_map.robot.name == "reachy":
        with pytest.raises(UserError, match="see rotations"):
            write_onnx(retargeter, path, "directions")
        return
    write_onnx(retargeter, path, "directions")
    evaluator = reference.ReferenceEvaluator(onnx.load(path))
    directions = retargeter.body_map.human_directions(poses).numpy()
    (found,) = evaluator.run(None, {"directions": directions})
    np.testing.assert_allclose(found, retargeter.predict(poses).numpy(), atol=SAME_RAD)


def test_onnx_runtime_reads_it(retargeter: Retargeter, poses: torch.Tensor, tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    write_onnx(retargeter, tmp_path / "robot.onnx")
    session = runtime.InferenceSession(tmp_path / "robot.onnx")
    (found,) = session.run(None, {"local_rotations": poses.numpy()})
    np.testing.assert_allclose(found, retargeter.predict(poses).numpy(), atol=1e-5)


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_what_is_no_number_is_no_answer(
    retargeter: Retargeter, poses: torch.Tensor, tmp_path: Path, number: float
) -> None:
    """Whichever joint it stands at, all of the frame's joints say so, and the other frames answer."""
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    write_onnx(retargeter, tmp_path / "robot.onnx")
    given = poses.numpy().copy()
    given[3, 0, 0, 0] = given[5, 17, 1, 2] = number
    (found,) = runtime.InferenceSession(tmp_path / "robot.onnx").run(None, {"local_rotations": given})
    assert np.isnan(found).all(1).tolist() == [frame in (3, 5) for frame in range(len(poses))]
    assert np.isfinite(np.delete(found, (3, 5), 0)).all()


def test_numpy(retargeter: Retargeter, poses: torch.Tensor, tmp_path: Path) -> None:
    assert write_numpy(retargeter, tmp_path / "robot.py") < SAME_RAD
    weights = standalone.load(tmp_path / "robot.npz")
    assert weights.joint_names == list(retargeter.joint_names)
    wanted = retargeter.predict(poses).numpy()
    np.testing.assert_allclose(weights(poses.numpy()), wanted, atol=SAME_RAD)
    np.testing.assert_allclose(weights(poses[0].numpy()), wanted[0], atol=SAME_RAD)
    assert len((tmp_path / "robot.py").read_text().splitlines()) < MOST_LINES
    with pytest.raises(ValueError, match="finite"):
        weights(np.full((1, 21, 3, 3), np.nan))


@pytest.mark.parametrize("retargeter", ["nao"], indirect=True)
def test_the_numpy_file_runs_without_mrhubo(retargeter: Retargeter, poses: torch.Tensor, tmp_path: Path) -> None:
    write_numpy(retargeter, tmp_path / "robot.py")
    np.save(tmp_path / "poses.npy", poses.numpy())
    refuse = "import sys; sys.modules.update(mrhubo=None, torch=None, scipy=None); sys.argv = ['robot.py', 'poses.npy', 'a.npy'];"
    run = "import runpy; runpy.run_path('robot.py', run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", refuse + run], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(np.load(tmp_path / "a.npy"), retargeter.predict(poses).numpy(), atol=SAME_RAD)


@pytest.mark.parametrize("retargeter", ["nao"], indirect=True)
@pytest.mark.parametrize(
    ("poses", "sentence"), [(None, "FileNotFoundError"), (np.zeros((2, 63)), "poses must be finite, of shape")]
)
def test_the_numpy_file_says_what_is_wrong(
    retargeter: Retargeter, poses: np.ndarray | None, sentence: str, tmp_path: Path
) -> None:
    write_numpy(retargeter, tmp_path / "robot.py")
    if poses is not None:
        np.save(tmp_path / "poses.npy", poses)
    command = [sys.executable, "robot.py", "poses.npy", "a.npy"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1 and sentence in done.stderr


@pytest.mark.parametrize("retargeter", ["nao"], indirect=True)
def test_what_is_read_or_another_file_is_not_written_over(
    retargeter: Retargeter, root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savez("nao.npz", poses=np.zeros((3, 63)))
    kept = Path("nao.npz").read_bytes()
    with pytest.raises(UserError, match="nao.npz: is there already and holds no weights of an export"):
        write_numpy(retargeter, Path("nao.py"))
    assert Path("nao.npz").read_bytes() == kept and not Path("nao.py").exists()
    for _ in range(2):
        write_numpy(retargeter, Path("again.py"))
    Path("my.urdf").write_bytes((root / "data/robots/nao/nao.urdf").read_bytes())
    with pytest.raises(UserError, match="--out my.urdf: would be written over what is read"):
        export.main(["--robot", "my.urdf", "--to", "onnx", "--out", "my.urdf"])
    with pytest.raises(UserError, match=r"\.: is a folder; name a file"):
        write_onnx(retargeter, Path("."))


@pytest.mark.parametrize("retargeter", ["nao"], indirect=True)
def test_the_command(retargeter: Retargeter, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    package = str(retargeter.save(tmp_path / "package", {}))
    export.main(["--retargeter", package, "--to", "numpy", "--out", str(tmp_path / "nao.py")])
    assert "robot 'nao'" in capsys.readouterr().out.replace("joints of", "robot")
    assert (tmp_path / "nao.npz").is_file()
    with pytest.raises(UserError, match="Python module"):
        export.main(["--retargeter", package, "--to", "numpy", "--out", str(tmp_path / "nao-1.txt")])


def test_a_wrong_file_is_not_written(retargeter: Retargeter, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(standalone, "_gelu", lambda x: x)
    with pytest.raises(UserError, match="from mrhubo's"):
        write_numpy(retargeter, tmp_path / "robot.py")
    assert not list(tmp_path.iterdir())
