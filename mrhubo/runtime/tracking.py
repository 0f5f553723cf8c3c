"""MLflow: where runs are kept, and the settings without which it misbehaves.

SQLite for the tracking database (MLflow 3 dropped the plain file store), artifacts beside it, telemetry off. MLflow is
imported only when a run starts: it costs two seconds.
"""

from __future__ import annotations

import logging
import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mrhubo.config.secrets import HIDDEN, credentials, has_hidden, redacted
from mrhubo.errors import UserError, first_line, shortened, was_interrupted
from mrhubo.runtime.database import NAME, database_uri, open_database, sqlite_file
from mrhubo.runtime.names import writable
from mrhubo.runtime.runs import close_the_dead

if TYPE_CHECKING:
    from mrhubo.runtime.client import TrackingClient

_TALKATIVE = ("alembic", "mlflow.store", "mlflow.tracking", "mlflow.system_metrics", "mlflow.pyfunc")
_SETTINGS = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR": "false",
    "MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT": "true",
    # MLflow's own are 7 retries of 120 s each: minutes of silence about a server that is not there.
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "1",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "30",
}
_WEB = ("http://", "https://")
_CREDENTIALS = ("MLFLOW_TRACKING_USERNAME", "MLFLOW_TRACKING_PASSWORD")


def open_client(folder: Path, experiment: str, uri: str | None = None) -> TrackingClient:
    """A client whose database and experiment exist; artifacts go under `folder`/artifacts.

    Runs whose process has ended without a word are marked as killed.

    Args:
        folder: for the database and the artifacts.
        experiment: its name; it is made if it is not there.
        uri: of a server or another database.

    Raises:
        UserError: the tracking server or database cannot be reached, or the experiment was deleted.
    """
    set_up_mlflow()
    from mrhubo.runtime.client import TrackingClient

    uri = uri or database_uri(folder)
    _check_address(uri)
    if uri.startswith(_WEB):
        uri = _hand_over_credentials(uri)
    folder.mkdir(parents=True, exist_ok=True)
    file, artifacts = sqlite_file(uri), folder.resolve() / "artifacts"
    try:
        if file is not None:
            open_database(file, artifacts)
        client = TrackingClient(uri)
        location = artifacts.as_uri() if file is not None else None
        close_the_dead(client, _open_experiment(client, experiment, location))
    except UserError:
        raise
    except Exception as error:  # MLflow's own, SQLAlchemy's, its drivers'
        if was_interrupted(error):
            raise
        raise UserError(redacted(f"tracking.uri: MLflow cannot open {uri}: {first_line(error)}", uri)) from error
    return client


def open_runs(argv: Sequence[str]) -> None:
    """Makes the tracking database of the current folder's `mlruns` ready for MLflow's own commands; `make dashboard`
    calls it.

    Raises:
        UserError: the database cannot be used.
    """
    set_up_mlflow()
    folder = Path("mlruns")
    open_database(folder / NAME, folder / "artifacts")


def set_up_mlflow() -> None:
    """The settings without which MLflow misbehaves; those of the user stay."""
    for name, value in _SETTINGS.items():
        os.environ.setdefault(name, value)
    import mlflow  # noqa: F401 (some versions set their loggers' levels when they are imported)

    for name in _TALKATIVE:
        logging.getLogger(name).setLevel(logging.CRITICAL)


def _check_address(uri: str) -> None:
    """Says within seconds that a server is not there."""
    known = uri.startswith(_WEB) and all(os.environ.get(name) for name in _CREDENTIALS)
    if has_hidden(uri) and not known:
        raise UserError(
            f"tracking.uri: {uri}: the password was left out where this config was written ({HIDDEN}); give the whole"
            f" address, tracking.uri=..., or for a server set {' and '.join(_CREDENTIALS)}"
        )
    if re.fullmatch(r"(localhost|[\w-]+(\.[\w-]+)*):\d+(/\S*)?", uri):
        raise UserError(f"tracking.uri: {uri} does not say how to speak to the server; write http://{uri}")
    if not uri.startswith("sqlite"):
        from mrhubo.runtime.failures import ANSWER_SECONDS, silence

        fault = silence(uri, ANSWER_SECONDS)
        if fault is not None:
            raise UserError(
                redacted(f"tracking.uri: no server answers at {uri} ({fault}); start it, or leave tracking.uri"
                         " out to keep runs in tracking.dir", uri)
            )  # fmt: skip


def _hand_over_credentials(uri: str) -> str:
    """The address without user and password, which MLflow gets in another way: it prints and quotes addresses."""
    address, user, password = credentials(uri)
    if user and password != HIDDEN:
        os.environ.update(zip(_CREDENTIALS, (user, password), strict=True))
    return address


def _open_experiment(client: TrackingClient, name: str, location: str | None) -> str:
    from mlflow.exceptions import MlflowException

    if writable(name) != name:
        raise UserError(f"tracking.experiment: {name!r} holds what is no letter; databases do not take it")
    found = client.get_experiment_by_name(name)
    if found is None:
        # The tag opens the experiment in the dashboard's view of trainings, not of language models.
        kind = {"mlflow.experimentKind": "custom_model_development"}
        try:
            return client.create_experiment(name, artifact_location=location, tags=kind)
        except MlflowException as error:
            found = client.get_experiment_by_name(name)  # another process may have been faster
            if found is None and error.error_code != "INVALID_PARAMETER_VALUE":
                raise
            if found is None:
                raise UserError(f"tracking.experiment: MLflow does not take '{shortened(name)}': {error}") from error
    if found.lifecycle_stage == "deleted":
        address = shlex.quote(redacted(client.uri))
        raise UserError(
            f"tracking.experiment: '{name}' was deleted in the dashboard; name another one, or restore it:"
            f" MLFLOW_TRACKING_URI={address} mlflow experiments restore --experiment-id {found.experiment_id}"
        )
    return found.experiment_id
