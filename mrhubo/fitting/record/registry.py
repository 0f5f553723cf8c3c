"""A package as a model version in MLflow's registry, with signature, example and what it was made from; and back."""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import yaml
from torch import Tensor

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config.secrets import redacted
from mrhubo.errors import UserError, first_line
from mrhubo.retargeter import Retargeter
from mrhubo.rotation import matrix_to_axis_angle, orthonormal
from mrhubo.runtime.database import database_uri, follow_if_possible, local_path
from mrhubo.runtime.locations import default_tracking
from mrhubo.runtime.names import model_name
from mrhubo.runtime.provenance import library_versions
from mrhubo.runtime.runs import drop_half_models
from mrhubo.runtime.tracking import set_up_mlflow

if TYPE_CHECKING:
    from mlflow.entities import Run
    from mlflow.entities.model_registry import ModelVersion

    from mrhubo.runtime.client import TrackingClient

_SCRIPT = Path(__file__).with_name("serving.py")
_LINK = "mlflow.modelVersions"


def example_input(local_TJ33: Tensor) -> np.ndarray:
    """Human poses (T, 21, 3, 3) as the model wants them: axis-angle [rad] (T, 63), float32."""
    return matrix_to_axis_angle(orthonormal(local_TJ33)).flatten(1).numpy().astype(np.float32)


def register(
    client: TrackingClient,
    run_id: str,
    package: Path,
    retargeter: Retargeter,
    local_TJ33: Tensor,
    tags: Mapping[str, str],
) -> str:
    """Makes a new version of the robot's model and returns its URI, `models:/mrhubo-nao/3`.

    Only `client` is used, so that MLflow's global tracking URI stays as it is. What an earlier start of the same
    run, which was broken off, has made whole is taken, and what it has left half is removed.

    Args:
        client: of the tracking database or server, whose registry it uses too.
        run_id: the run that made the package.
        package: its folder.
        retargeter: what is in it.
        local_TJ33: human poses (T, 21, 3, 3), the input example.
        tags: of the model version.

    Raises:
        Exception: whatever MLflow raises where a server has no registry, or one that is too old.
    """
    run, name = client.get_run(run_id), model_name(retargeter.body_map.robot.name)
    for version in client.search_model_versions(f"name = '{name}' and run_id = '{run_id}'"):
        model = re.search(r"/(m-[0-9a-f]+)/", version.source or "")
        if version.tags == dict(tags):
            return _linked(client, version, model[1] if model else None)
    drop_half_models(client, run, linked=_LINK)
    try:
        return _new_version(client, run, name, package, retargeter, local_TJ33, tags)
    except BaseException:
        drop_half_models(client, run, linked=_LINK)
        raise


def _new_version(
    client: TrackingClient,
    run: Run,
    name: str,
    package: Path,
    retargeter: Retargeter,
    local_TJ33: Tensor,
    tags: Mapping[str, str],
) -> str:
    from mlflow.entities import LoggedModelOutput
    from mlflow.exceptions import MlflowException

    run_id = run.info.run_id
    model = client.create_logged_model(run.info.experiment_id, name, run_id, tags=dict(tags))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model"
        # A copy: MLflow takes the path for an address, in which some letters of a folder's name say something else.
        copy = Path(shutil.copytree(package, Path(folder) / "package"))
        _save(path, copy, retargeter, example_input(local_TJ33), model.model_id, run_id)
        client.log_model_artifacts(model.model_id, str(path))
    client.finalize_logged_model(model.model_id, "READY")
    client.log_outputs(run_id, [LoggedModelOutput(model.model_id, step=0)])
    if not client.search_registered_models(f"name = '{name}'"):
        about = f"Human poses to joint angles of {retargeter.body_map.robot.name}, made by mrhubo"
        with contextlib.suppress(MlflowException):  # another process was faster; if not, there will be no version
            client.create_registered_model(name, description=about)
    # Not "models:/<id>": the registry would look that up with MLflow's global tracking URI.
    source = model.artifact_location
    version = client.create_model_version(
        name, source, run_id, dict(tags), description=run.info.run_name, model_id=model.model_id
    )
    return _linked(client, version, model.model_id)


def _linked(client: TrackingClient, version: ModelVersion, model_id: str | None) -> str:
    """The version's URI. The dashboard's link from the run to it reads a tag that MLflow's own register_model writes
    too.
    """
    if model_id is not None:
        link = json.dumps([{"name": version.name, "version": version.version}])
        client.set_logged_model_tags(model_id, {_LINK: link})
    return f"models:/{version.name}/{version.version}"


def fetch_package(uri: str) -> Path:
    """Folder of the package in a model version, `models:/mrhubo-nao/3` or `models:/mrhubo-nao@best`.

    It is where MLflow keeps it, or, where that is another machine, a copy in the folder for temporary files. The
    registry is the one that MLflow is set to, else that of the project's tracking folder.

    Raises:
        UserError: the URI is no such URI, the registry or the version does not exist, or it holds no package.
    """
    set_up_mlflow()
    import mlflow
    from mlflow.artifacts import download_artifacts

    match = re.fullmatch(r"models:/([^/@]+)(?:/(\d+)|@([^/]+))", uri)
    if not match:
        raise UserError(f"'{uri}': expected models:/NAME/VERSION or models:/NAME@ALIAS")
    name, number, alias = match.groups()
    folder = default_tracking()
    if mlflow.is_tracking_uri_set():
        registry = mlflow.get_tracking_uri()
    elif (folder / "mlflow.db").is_file():
        registry = database_uri(folder)
        follow_if_possible(folder)
    else:
        raise UserError(
            f"{uri}: there is no registry in {folder}; set MLFLOW_TRACKING_URI to the one that has the model"
        )
    client = mlflow.MlflowClient(tracking_uri=registry)
    try:
        version = client.get_model_version(name, number) if number else client.get_model_version_by_alias(name, alias)
        # MLflow does not find its way in folders whose names hold what means something in an address.
        path = local_path(version.source or "")
        if path is None or not path.is_dir():
            path = Path(download_artifacts(artifact_uri=version.source, tracking_uri=registry))
        model = yaml.safe_load((path / "MLmodel").read_text(encoding="utf-8"))
        return path / model["flavors"]["python_function"]["artifacts"]["package"]["path"]
    except (KeyError, TypeError) as error:
        raise UserError(f"{uri}: is no model of mrhubo") from error
    except Exception as error:  # MLflow's own, the network's, the database's
        raise UserError(redacted(f"{uri}: cannot be had from {registry}: {first_line(error)}", registry)) from error


def _save(
    path: Path, package: Path, retargeter: Retargeter, example_T63: np.ndarray, model_id: str, run_id: str
) -> None:
    """Writes an MLflow model: the script, the package, signature, example and requirements."""
    import mlflow
    from mlflow.models import Model, ModelSignature
    from mlflow.types import ColSpec, Schema, TensorSpec

    columns = [*retargeter.joint_names, "confidence"]
    signature = ModelSignature(
        Schema([TensorSpec(np.dtype(np.float32), (-1, 3 * len(POSED_JOINT_NAMES)))]),
        Schema([ColSpec("float", name) for name in columns]),
    )
    mlflow.pyfunc.save_model(
        path,
        mlflow_model=Model(run_id=run_id, model_uuid=model_id, model_id=model_id),
        python_model=str(_SCRIPT),
        artifacts={"package": str(package)},
        signature=signature,
        input_example=example_T63,
        # Given, as MLflow takes ten seconds to find them. mrhubo itself is on no package index: git_commit names it.
        pip_requirements=[f"{name}=={number.partition('+')[0]}" for name, number in library_versions().items()],
    )
