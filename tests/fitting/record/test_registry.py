"""A registered package retargets through MLflow as it does by itself, and says what it was made from."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import mlflow
import numpy as np
import pytest
import torch

import mrhubo
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.fitting.record import registry
from mrhubo.fitting.record.registry import example_input, register
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.robot import build_body_map
from mrhubo.rotation import axis_angle_to_matrix
from mrhubo.runtime.database import database_uri
from mrhubo.runtime.runs import start_run
from mrhubo.runtime.tracking import open_client
from tests.poses import prior_poses


@pytest.fixture(scope="module")
def pose() -> torch.Tensor:
    return prior_poses(20, 1)


@pytest.fixture(scope="module")
def registered(
    root: Path, pose: torch.Tensor, empty_tracking: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Retargeter, str]:
    """Folder of the tracking database, the retargeter, and the URI of its second version."""
    folder = Path(shutil.copytree(empty_tracking, tmp_path_factory.mktemp("registry") / "mlruns"))
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=24"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    package = made.save(folder / "package", {"run_id": "abc"})
    client = open_client(folder, "mrhubo")
    run = start_run(client, "mrhubo", "a run", {}).info.run_id
    before = mlflow.get_tracking_uri(), mlflow.get_registry_uri()
    for number in ("1", "2"):
        uri = register(client, run, package, made, pose[:4], {"urdf_xxh3": number})
        assert uri == f"models:/mrhubo-nao/{number}"
    assert (mlflow.get_tracking_uri(), mlflow.get_registry_uri()) == before and mlflow.active_run() is None
    for file in package.iterdir():
        file.unlink()
    return folder, made, uri


@pytest.fixture(scope="module")
def served(registered: tuple[Path, Retargeter, str]) -> Any:
    folder, _, uri = registered
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MLFLOW_ALLOW_PICKLE_DESERIALIZATION", "false")
        before = mlflow.get_tracking_uri()
        mlflow.set_tracking_uri(database_uri(folder))
        try:
            return mlflow.pyfunc.load_model(uri)
        finally:
            mlflow.set_tracking_uri(before)


def test_it_answers_as_the_package_does(
    registered: tuple[Path, Retargeter, str], served: Any, pose: torch.Tensor
) -> None:
    made = registered[1]
    pose_T63 = example_input(pose)
    table = served.predict(pose_T63)
    assert list(table.columns) == [*made.joint_names, "confidence"]
    given = axis_angle_to_matrix(torch.from_numpy(pose_T63).reshape(-1, 21, 3))
    torch.testing.assert_close(given, pose, atol=1e-5, rtol=0)
    expected, robot = made.retarget(given), made.body_map.robot
    q_TN = torch.tensor(table[list(made.joint_names)].to_numpy())
    torch.testing.assert_close(q_TN, expected.q)
    assert bool(((q_TN >= robot.lower_N) & (q_TN <= robot.upper_N)).all())
    np.testing.assert_allclose(table["confidence"], expected.confidence, rtol=1e-4)
    assert len(served.predict(pose_T63[:0])) == 0


def test_a_version_is_loaded_by_its_uri(
    registered: tuple[Path, Retargeter, str], pose: torch.Tensor, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, made, uri = registered
    before = mlflow.get_tracking_uri()
    monkeypatch.setattr(registry, "default_tracking", lambda: folder)
    monkeypatch.setattr(mlflow, "is_tracking_uri_set", lambda: False)
    torch.testing.assert_close(mrhubo.load(uri)(pose).q, made(pose).q)
    open_client(folder, "mrhubo").set_registered_model_alias("mrhubo-nao", "best", "1")
    assert mrhubo.load("models:/mrhubo-nao@best").joint_names == made.joint_names
    for wrong, message in {
        "models:/mrhubo-nao/9": "cannot be had from sqlite.*not found",
        "models:/mrhubo-nao@worst": "cannot be had",
        "models:/mrhubo-nao": "expected models:/NAME/VERSION",
    }.items():
        with pytest.raises(mrhubo.UserError, match=message):
            mrhubo.load(wrong)
    monkeypatch.setattr(registry, "default_tracking", lambda: folder / "nowhere")
    with pytest.raises(mrhubo.UserError, match="there is no registry in .*nowhere"):
        mrhubo.load(uri)
    assert mlflow.get_tracking_uri() == before and not (folder / "nowhere").exists()


def test_signature_example_and_source_are_there(registered: tuple[Path, Retargeter, str], served: Any) -> None:
    folder, made, _ = registered
    inputs, outputs = served.metadata.signature.inputs, served.metadata.signature.outputs
    assert inputs.inputs[0].shape == (-1, 63) and inputs.inputs[0].type == np.float32
    assert outputs.input_names() == [*made.joint_names, "confidence"]
    example = served.input_example
    assert np.shape(example) == (4, 63) and len(served.predict(example.astype(np.float32))) == 4
    client = open_client(folder, "mrhubo")
    version = client.get_model_version("mrhubo-nao", "2")
    assert version.tags["urdf_xxh3"] == "2" and version.status == "READY"
    run = client.get_run(version.run_id)
    assert any(output.model_id in version.source for output in run.outputs.model_outputs), "from the run to the model"
    files = {path.suffix for path in Path(version.source.removeprefix("file://")).rglob("*") if path.is_file()}
    assert not files & {".pkl", ".pickle", ".pt", ".pth"}


def test_bad_poses_are_named(served: Any, pose: torch.Tensor) -> None:
    pose_T63 = example_input(pose)
    with pytest.raises(mlflow.MlflowException, match=r"Shape of input \(20, 60\) does not match .*\(-1, 63\)"):
        served.predict(pose_T63[:, :60])
    with pytest.raises(mlflow.MlflowException, match=r"shape \(frames, 63\), axis-angle .* found \(60,\)"):
        served.unwrap_python_model().predict(None, pose_T63[0, :60])
    pose_T63[7, 5] = np.nan
    with pytest.raises(mlflow.MlflowException, match="human pose 7 holds NaN"):
        served.predict(pose_T63)


@pytest.mark.parametrize("point", ["log_model_artifacts", "finalize_logged_model", "log_outputs", "create_model_version",
                                   "set_logged_model_tags"])  # fmt: skip
def test_a_start_that_was_killed_while_it_registered_leaves_one_version_in_the_end(
    registered: tuple[Path, Retargeter, str],
    tmp_path: Path,
    pose: torch.Tensor,
    monkeypatch: pytest.MonkeyPatch,
    point: str,
) -> None:
    """Killed after the step is done; nothing tidies up, as after kill -9."""
    folder, made, _ = registered
    client = open_client(folder, "mrhubo")
    run = start_run(client, "mrhubo", point, {}).info
    package, tags = made.save(tmp_path / "package", {}), {"run_id": run.run_id}

    class Killed(BaseException):
        pass

    with monkeypatch.context() as patch, pytest.raises(Killed):
        whole = getattr(mlflow.MlflowClient, point)

        def killed(*given: Any, **named: Any) -> None:
            whole(*given, **named)
            raise Killed

        patch.setattr(mlflow.MlflowClient, point, killed)
        patch.setattr(registry, "drop_half_models", lambda *_, **__: None)
        register(client, run.run_id, package, made, pose[:4], tags)
    uri = register(client, run.run_id, package, made, pose[:4], tags)
    (version,) = client.search_model_versions(f"run_id = '{run.run_id}'")
    (model,) = client.search_logged_models([run.experiment_id], f"source_run_id = '{run.run_id}'")
    assert uri == f"models:/mrhubo-nao/{version.version}" and model.status == "READY"
    assert model.tags["mlflow.modelVersions"] == f'[{{"name": "mrhubo-nao", "version": {version.version}}}]'
    assert version.source == model.artifact_location


def test_one_that_cannot_be_registered_leaves_no_half_model(
    registered: tuple[Path, Retargeter, str], tmp_path: Path, pose: torch.Tensor, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, made, _ = registered
    client = open_client(folder, "mrhubo")
    run = start_run(client, "mrhubo", "a", {}).info

    def refuse(*_: object, **__: object) -> None:
        raise mlflow.MlflowException("no registry here")

    monkeypatch.setattr(mlflow.MlflowClient, "create_model_version", refuse)
    with pytest.raises(mlflow.MlflowException, match="no registry here"):
        register(client, run.run_id, made.save(tmp_path / "package", {}), made, pose[:4], {})
    assert not client.search_logged_models([run.experiment_id], f"source_run_id = '{run.run_id}'")


def test_versions_are_found_after_a_move(
    registered: tuple[Path, Retargeter, str], tmp_path: Path, pose: torch.Tensor, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, made, uri = registered
    moved = Path(shutil.copytree(folder, tmp_path / "moved %41?"))
    monkeypatch.setattr(registry, "default_tracking", lambda: moved)
    monkeypatch.setattr(mlflow, "is_tracking_uri_set", lambda: False)
    found = mrhubo.load(uri)
    assert str(found.config.robot.urdf).startswith(str(moved))
    torch.testing.assert_close(found(pose).q, made(pose).q)
