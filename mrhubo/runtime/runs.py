"""Runs in MLflow: begun, found again, written to, and closed as they ended."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrhubo.config.secrets import redacted
from mrhubo.errors import Unreachable, UserError, was_interrupted
from mrhubo.runtime.names import key, writable
from mrhubo.runtime.processes import is_gone, this_process
from mrhubo.runtime.workspace import Workspace

if TYPE_CHECKING:
    from mlflow.entities import Run

    from mrhubo.runtime.client import TrackingClient

_ATTEMPT, _PROCESS, _ENDED_BY = "attempt", "process", "ended_by"
_RUN_NAME = 250
"""Letters of a run's name that databases keep."""


def start_run(client: TrackingClient, experiment: str, name: str, tags: Mapping[str, str]) -> Run:
    """A new run in an experiment that `open_client` has opened.

    Raises:
        Unreachable: the server or the database does not make one.
    """
    from mlflow.exceptions import MlflowException

    found = client.get_experiment_by_name(experiment)
    assert found is not None
    tags = {name: writable(value) for name, value in {**tags, _PROCESS: this_process()}.items()}
    try:
        return client.create_run(found.experiment_id, tags=tags, run_name=writable(name)[:_RUN_NAME])
    except MlflowException as error:
        raise Unreachable(redacted(f"tracking.uri: {client.uri} makes no run: {error}", client.uri)) from error


def take_up_run(
    client: TrackingClient, experiment: str, workspace: Workspace, name: str, tags: Mapping[str, str]
) -> tuple[Run, bool]:
    """The unfinished run of a workspace, or a new one; and whether it is new.

    A start that was killed before it could note its run finds it again by a mark that was noted before.

    Raises:
        Unreachable: the server does not say whether the run is still there; nothing is removed then.
    """
    run = _active_run(client, workspace.run_id)
    if run is None and workspace.attempt is not None:
        run = find_run(client, experiment, {_ATTEMPT: workspace.attempt})
    if run is None:
        run = start_run(client, experiment, name, {**tags, _ATTEMPT: workspace.new_attempt()})
        workspace.start(run.info.run_id)
        return run, True
    workspace.start(run.info.run_id)
    reopen(client, run)
    return run, False


def reopen(client: TrackingClient, run: Run) -> None:
    """Marks a run as running again, in this process."""
    run_id = run.info.run_id
    client.update_run(run_id, status="RUNNING")
    client.set_tag(run_id, _PROCESS, this_process())
    client.set_tag(run_id, "resumed", time.strftime("%Y-%m-%d %H:%M:%S"))
    if _ENDED_BY in run.data.tags:
        client.delete_tag(run_id, _ENDED_BY)
    drop_half_models(client, run)


def _active_run(client: TrackingClient, run_id: str | None) -> Run | None:
    """The run of that id if it is still there: a user may have deleted it."""
    from mlflow.exceptions import MlflowException

    if run_id is None:
        return None
    try:
        run = client.get_run(run_id)
    except MlflowException as error:
        if error.error_code != "RESOURCE_DOES_NOT_EXIST":
            raise UserError(redacted(f"tracking.uri: {client.uri}: run {run_id}: {error}", client.uri)) from error
        return None
    return run if run.info.lifecycle_stage == "active" else None


def find_run(client: TrackingClient, experiment: str, tags: Mapping[str, str], finished: bool = False) -> Run | None:
    """The newest run of an experiment that has these tags (and is finished), if there is one."""
    found = client.get_experiment_by_name(experiment)
    if found is None:
        return None
    wanted = [f"tags.`{name}` = {_quoted(value)}" for name, value in tags.items()]
    if finished:
        wanted.append("attributes.status = 'FINISHED'")
    return next(iter(client.search_runs([found.experiment_id], " and ".join(wanted), max_results=1)), None)


def _quoted(value: str) -> str:
    return f'"{value}"' if "'" in value else f"'{value}'"


def log_all(
    client: TrackingClient,
    run_id: str,
    metrics: Mapping[str, float],
    params: Mapping[str, Any] | None = None,
    step: int = 0,
) -> None:
    """Metrics and parameters in one go: one at a time, each costs about 20 ms on SQLite."""
    from mlflow.entities import Metric, Param

    now = int(1000 * time.time())
    written = [Param(key(name), writable(redacted(str(value)))) for name, value in (params or {}).items()]
    client.log_batch(run_id, [Metric(key(name), float(value), now, step) for name, value in metrics.items()], written)


def log_file(client: TrackingClient, run_id: str, name: str, write: Callable[[Path], object]) -> None:
    """The artifact `name` (folder and file) of a run, made by `write`, which is given the path to write to."""
    client.log_made(run_id, key(name), write)


def run_status(error: BaseException | None) -> str:
    """How a run ended that raised `error`: finished, killed by the user, or failed."""
    return "FINISHED" if error is None else "KILLED" if was_interrupted(error) else "FAILED"


def close_run(client: TrackingClient, run_id: str, error: BaseException | None, whole: str = "") -> None:
    """Ends a run as finished, killed or failed, and sends what was kept.

    Raises:
        Unreachable: nothing went wrong but that the server does not answer; `whole` says what is done all the same.
    """
    if error is not None:
        reason = redacted(f"{type(error).__name__}: {error}", client.uri)
        client.set_tag(run_id, _ENDED_BY, writable(reason)[:500])
    client.set_terminated(run_id, run_status(error))
    if error is None:
        client.deliver(whole)
        client.patient = False


@contextmanager
def ending(client: TrackingClient, run_id: str) -> Iterator[None]:
    """Closes a run as finished, killed or failed; while it is open, a server that goes away is no reason to stop."""
    client.patient = True
    try:
        yield
    except BaseException as error:
        close_run(client, run_id, error)
        raise
    close_run(client, run_id, None)


def close_the_dead(client: TrackingClient, experiment_id: str) -> None:
    """Runs that still count as running, though their process on this machine has ended (kill -9, no memory left)."""
    for run in client.search_runs([experiment_id], "attributes.status = 'RUNNING'"):
        process = run.data.tags.get(_PROCESS)
        if process is not None and is_gone(process):
            drop_half_models(client, run)
            client.set_tag(run.info.run_id, _ENDED_BY, "its process ended without a word")
            client.set_terminated(run.info.run_id, "KILLED")


def drop_half_models(client: TrackingClient, run: Run, linked: str | None = None) -> None:
    """Removes the models of a run that were never finished, and with `linked` those that lack this tag."""
    query = f"source_run_id = '{run.info.run_id}'"
    with contextlib.suppress(Exception):  # an old server knows no such models
        for model in client.search_logged_models([run.info.experiment_id], query):
            if model.status == "PENDING" or (linked is not None and linked not in model.tags):
                client.delete_logged_model(model.model_id)
