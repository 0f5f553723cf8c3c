"""MLflow: where runs are kept, and the settings without which it misbehaves.

SQLite for the tracking database (MLflow 3 dropped the plain file store), artifacts beside it, telemetry off. MLflow is
imported only when a run starts: it costs two seconds.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrhubo.config.shipped import shipped_root
from mrhubo.errors import UserError, was_interrupted
from mrhubo.files.storage import locked

if TYPE_CHECKING:
    from lightning.pytorch.loggers import MLFlowLogger
    from mlflow import MlflowClient
    from mlflow.entities import Run

_LIBRARIES = ("torch", "lightning", "mlflow", "numpy", "pytorch-kinematics", "yourdfpy", "roma", "safetensors", "scipy")

_TALKATIVE = ("alembic", "mlflow.store", "mlflow.tracking", "mlflow.system_metrics", "mlflow.pyfunc")


def database_uri(folder: Path) -> str:
    """SQLite tracking URI of `mlflow.db` in a folder."""
    return f"sqlite:///{folder.resolve() / 'mlflow.db'}"


def open_client(folder: Path, experiment: str, uri: str | None = None) -> MlflowClient:
    """A client whose database and experiment exist; artifacts go under `folder`/artifacts.

    Raises:
        UserError: the tracking server or database cannot be reached.
    """
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    os.environ.setdefault("MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR", "false")
    import mlflow

    for name in _TALKATIVE:
        logging.getLogger(name).setLevel(logging.ERROR)
    folder.mkdir(parents=True, exist_ok=True)
    uri = uri or database_uri(folder)
    try:
        with locked(folder / "mlflow.lock", wait=True):  # two processes cannot make a database at once
            client = mlflow.MlflowClient(tracking_uri=uri)
            if client.get_experiment_by_name(experiment) is None:
                location = (folder.resolve() / "artifacts").as_uri() if uri.startswith("sqlite") else None
                # The tag opens the experiment in the dashboard's view of trainings, not of language models.
                kind = {"mlflow.experimentKind": "custom_model_development"}
                client.create_experiment(experiment, artifact_location=location, tags=kind)
    except Exception as error:
        raise _unreachable(uri, error) from error
    return client


def log_file(client: MlflowClient, run_id: str, name: str, write: Callable[[Path], object]) -> None:
    """The artifact `name` (folder and file) of a run, made by `write`, which is given the path to write to."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / Path(name).name
        write(path)
        client.log_artifact(run_id, str(path), str(Path(name).parent))


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Holds Ctrl-C back until the block has ended.

    A transaction of SQLite that is broken off keeps its lock as long as the traceback lives, and whoever then wants to
    mark the run as killed waits for minutes.
    """
    if threading.current_thread() is not threading.main_thread():  # only the main thread is interrupted
        yield
        return
    held: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
        if held:
            signal.raise_signal(signal.SIGINT)


def open_logger(
    folder: Path,
    experiment: str,
    run_name: str,
    tags: dict[str, str],
    uri: str | None = None,
    run_id: str | None = None,
) -> MLFlowLogger:
    """A Lightning logger of a new run, or of the run `run_id`, in what `open_client` opens.

    Raises:
        UserError: the tracking server or database cannot be reached.
    """
    open_client(folder, experiment, uri)
    from lightning.pytorch.loggers import MLFlowLogger

    class Logger(MLFlowLogger):
        def log_metrics(self, metrics: Mapping[str, float], step: int | None = None) -> None:
            with uninterrupted():
                super().log_metrics(metrics, step)

        def finalize(self, status: str = "success") -> None:
            with uninterrupted():
                super().finalize(status)

    uri = uri or database_uri(folder)
    try:
        logger = Logger(
            experiment_name=experiment, run_name=run_name, tracking_uri=uri, tags=tags, run_id=run_id, log_model=False
        )
        _ = logger.run_id
    except Exception as error:
        raise _unreachable(uri, error) from error
    return logger


def start_run(client: MlflowClient, experiment: str, name: str, tags: dict[str, str]) -> Run:
    """A new run in an experiment that `open_client` has opened."""
    found = client.get_experiment_by_name(experiment)
    assert found is not None
    with uninterrupted():
        return client.create_run(found.experiment_id, tags=tags, run_name=name)


def log_all(client: MlflowClient, run_id: str, metrics: dict[str, float], params: dict[str, Any] | None = None) -> None:
    """Metrics and parameters in one go: one at a time, each costs about 20 ms on SQLite."""
    from mlflow.entities import Metric, Param

    now = int(1000 * time.time())
    written = [Param(name, str(value)) for name, value in (params or {}).items()]
    with uninterrupted():
        client.log_batch(run_id, [Metric(name, value, now, 0) for name, value in metrics.items()], written)


def run_status(error: BaseException | None) -> str:
    """How a run ended that raised `error`: finished, killed by the user, or failed."""
    return "FINISHED" if error is None else "KILLED" if was_interrupted(error) else "FAILED"


@contextmanager
def ending(client: MlflowClient, run_id: str) -> Iterator[None]:
    """Closes a run as finished, killed or failed."""
    try:
        yield
    except BaseException as error:
        client.set_terminated(run_id, run_status(error))
        raise
    client.set_terminated(run_id, run_status(None))


def _unreachable(uri: str, error: Exception) -> UserError:
    return UserError(f"tracking.uri: MLflow cannot open {uri}: {str(error).splitlines()[0]}")


def find_run(client: MlflowClient, experiment: str, tags: dict[str, str], finished: bool = False) -> Run | None:
    """The newest run of an experiment that has these tags (and is finished), if there is one."""
    found = client.get_experiment_by_name(experiment)
    if found is None:
        return None
    wanted = [f"tags.`{name}` = '{value}'" for name, value in tags.items()]
    if finished:
        wanted.append("attributes.status = 'FINISHED'")
    return next(iter(client.search_runs([found.experiment_id], " and ".join(wanted), max_results=1)), None)


def resumable_run(folder: Path, uri: str | None, run_id: str | None) -> str | None:
    """The id itself if that run is still in the tracking database (a user may have deleted it), else None."""
    if run_id is None:
        return None
    import mlflow

    try:
        run = mlflow.MlflowClient(tracking_uri=uri or database_uri(folder)).get_run(run_id)
    except Exception:
        return None
    return run_id if run.info.lifecycle_stage == "active" else None


def git_commit(folder: Path) -> str:
    """Commit of the checkout that holds `folder`, with "+changes" if files differ from it; "unknown" outside git.

    Where mrhubo is installed without its checkout: its version. A commit found there would be that of another project.
    """
    if not (shipped_root() / "pyproject.toml").is_file():
        return f"mrhubo {version('mrhubo')}"
    try:
        commit = subprocess.run(
            ["git", "-C", str(folder), "rev-parse", "HEAD"], capture_output=True, text=True, check=True, timeout=10
        ).stdout.strip()
        dirty = subprocess.run(
            ["git", "-C", str(folder), "status", "--porcelain", "--untracked-files=no"],
            capture_output=True,
            text=True,
            check=True,
            timeout=10,
        ).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return commit + ("+changes" if dirty else "")


def library_versions() -> dict[str, str]:
    """Versions of the libraries that decide the result."""
    versions = {}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "absent"
    return versions
