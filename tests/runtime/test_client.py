"""A client that bears with its server."""

from __future__ import annotations

import json
import sqlite3
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from mlflow.entities import Metric, Param
from mlflow.exceptions import MlflowException
from mlflow.protos.databricks_pb2 import INVALID_PARAMETER_VALUE, TEMPORARILY_UNAVAILABLE

from mrhubo.errors import Unreachable
from mrhubo.runtime import client as clients
from mrhubo.runtime.client import TrackingClient
from mrhubo.runtime.runs import start_run
from mrhubo.runtime.tracking import open_client

GONE = MlflowException(
    "API request to http://host:5000/api/2.0/mlflow/runs/log-batch failed with exception HTTPConnectionPool(host='host',"
    " port=5000): Max retries exceeded (Caused by NewConnectionError('<urllib3.connection.HTTPConnection object at 0x7>:"
    " Failed to establish a new connection: [Errno 111] Connection refused'))"
)
"""What MLflow raises where nobody answers."""
REFUSED = MlflowException("the run must be in the 'active' state", INVALID_PARAMETER_VALUE)
LOCKED = MlflowException("(sqlite3.OperationalError) database is locked", TEMPORARILY_UNAVAILABLE)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients, "_PAUSES", (0.0, 0.0))
    monkeypatch.setattr(clients, "_NEXT_TRY_SECONDS", 0.0)


@pytest.fixture
def run_id(opened: TrackingClient) -> str:
    return start_run(opened, "mrhubo", "a run", {}).info.run_id


def log(client: TrackingClient, run_id: str, *steps: int) -> None:
    for step in steps:
        client.log_batch(run_id, [Metric("train/loss", float(step), 1_000 + step, step)])


def steps(client: TrackingClient, run_id: str) -> list[int]:
    return sorted(metric.step for metric in client.get_metric_history(run_id, "train/loss"))


def test_patient_it_keeps_what_nobody_takes_and_sends_it_in_order(
    opened: TrackingClient, run_id: str, fail: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    opened.patient = True
    fail(GONE, "log_batch", times=2)
    log(opened, run_id, 1)
    assert opened.away
    log(opened, run_id, 2)
    opened.set_tag(run_id, "a", "b")  # waits too: what came before goes first
    opened.log_text(run_id, "text", "folder/name.txt")
    opened.log_made(run_id, "made/name.txt", lambda path: path.write_text("made"))
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and said.startswith("warning: tracking.uri: MLflow at sqlite")
    assert "nobody answers (Connection refused); the work goes on" in said
    log(opened, run_id, 3)
    assert not opened.away and steps(opened, run_id) == [1, 2, 3]
    assert opened.get_run(run_id).data.tags["a"] == "b"
    assert {found.path for found in opened.list_artifacts(run_id)} == {"folder", "made"}
    opened.deliver()


def test_impatient_it_says_so_at_once(opened: TrackingClient, run_id: str, fail: Callable[..., None]) -> None:
    fail(GONE, "log_batch")
    with pytest.raises(Unreachable, match=r"^tracking.uri: MLflow at .* cannot be used: nobody answers \(Connection"):
        log(opened, run_id, 1)
    assert not opened.away


def test_a_server_that_stays_away_costs_the_work_nothing(
    opened: TrackingClient, run_id: str, fail: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is asked now and then alone."""
    monkeypatch.setattr(clients, "_NEXT_TRY_SECONDS", 3600.0)
    asked = []
    monkeypatch.setattr("mlflow.MlflowClient.log_batch", lambda *_, **__: asked.append(1) or raise_(GONE))
    opened.patient = True
    log(opened, run_id, *range(100))
    assert len(asked) == 1
    with pytest.raises(Unreachable, match="nobody answers$"):
        opened.get_run(run_id)


def raise_(error: Exception) -> None:
    raise error


def test_what_is_still_kept_at_the_end_is_said_with_what_is_whole(
    opened: TrackingClient, run_id: str, fail: Callable[..., None]
) -> None:
    opened.patient = True
    fail(GONE, "set_tag", times=3)
    opened.set_tag(run_id, "a", "b")
    with pytest.raises(Unreachable, match="run is not complete; the package is whole: /p; .*the same command again"):
        opened.deliver("the package is whole: /p")
    with pytest.raises(Unreachable):
        opened.deliver()
    opened.deliver()
    assert opened.get_run(run_id).data.tags["a"] == "b"


def test_what_the_server_refuses_holds_nothing_else_up(
    opened: TrackingClient, run_id: str, fail: Callable[..., None]
) -> None:
    opened.patient = True
    fail(REFUSED, "set_tag")
    opened.set_tag(run_id, "a", "b")
    log(opened, run_id, 1, 2)
    with pytest.raises(Unreachable, match="'active' state"):
        opened.deliver()
    assert steps(opened, run_id) == [1, 2]


def test_metrics_outlive_the_process(
    opened: TrackingClient, folder: Path, run_id: str, tmp_path: Path, fail: Callable[..., None]
) -> None:
    file = tmp_path / "unsent.jsonl"
    opened.keep_in(file)
    opened.patient = True
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mlflow.MlflowClient.log_batch", lambda *_, **__: raise_(GONE))
        log(opened, run_id, 1, 2)
    with open(file, "a") as half:
        half.write('["a run", [["train/lo')  # killed while it was written
    again = open_client(folder, "mrhubo")
    again.keep_in(file)
    again.patient = True
    log(again, run_id, 3)
    assert steps(again, run_id) == [1, 2, 3] and not file.exists()


def test_not_a_number_is_kept_too(
    opened: TrackingClient, run_id: str, tmp_path: Path, fail: Callable[..., None]
) -> None:
    opened.keep_in(tmp_path / "unsent.jsonl")
    opened.patient = True
    fail(GONE, "log_batch", times=1)
    opened.log_batch(run_id, [Metric("train/loss", float("nan"), 1, 1)], [Param("a", "b")])
    (line,) = (tmp_path / "unsent.jsonl").read_text().splitlines()
    assert json.loads(line)[0] == run_id
    opened.deliver()
    assert steps(opened, run_id) == [1] and opened.get_run(run_id).data.params == {"a": "b"}


@pytest.mark.parametrize("error", [GONE, LOCKED, RuntimeError("anything"), ConnectionResetError("reset")])
def test_a_question_is_asked_again(
    opened: TrackingClient, run_id: str, fail: Callable[..., None], error: Exception
) -> None:
    fail(error, "get_run", times=2)
    assert opened.get_run(run_id).info.run_id == run_id
    fail(RuntimeError("always"), "get_run")
    with pytest.raises(Unreachable, match="always"):
        opened.get_run(run_id)


def test_an_answer_is_an_answer(opened: TrackingClient) -> None:
    with pytest.raises(MlflowException) as error:
        opened.get_run("0" * 32)
    assert error.value.error_code == "RESOURCE_DOES_NOT_EXIST"


@pytest.mark.parametrize("interrupt", [KeyboardInterrupt, TypeError])
def test_interrupts_and_bugs_are_kept_by_nobody(
    opened: TrackingClient, run_id: str, fail: Callable[..., None], interrupt: type[BaseException]
) -> None:
    opened.patient = True
    fail(interrupt(), "set_tag", "get_run")  # pyright: ignore[reportArgumentType]
    for call in (lambda: opened.set_tag(run_id, "a", "b"), lambda: opened.get_run(run_id)):
        with pytest.raises(interrupt):
            call()
    assert not opened.away


def test_a_locked_database_is_waited_for(
    opened: TrackingClient, folder: Path, run_id: str, fail: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    fail(LOCKED, "create_run", "log_batch", times=1)
    start_run(opened, "mrhubo", "another", {})
    log(opened, run_id, 1)
    assert steps(opened, run_id) == [1]
    assert capsys.readouterr().err.count("is locked by another process; waiting\n") == 2


def test_a_lock_of_another_process_is_waited_for(folder: Path) -> None:
    held = sqlite3.connect(folder / "mlflow.db", check_same_thread=False)
    held.execute("BEGIN EXCLUSIVE")
    threading.Timer(0.7, held.rollback).start()
    start = time.monotonic()
    client = open_client(folder, "mrhubo")
    assert start_run(client, "mrhubo", "a", {}).info.status == "RUNNING" and time.monotonic() - start > 0.5


def test_an_interrupt_in_a_transaction_waits_for_its_end(
    opened: TrackingClient, run_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import signal

    done = []

    def interrupted(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)
        done.append("written")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        monkeypatch.setattr("mlflow.MlflowClient.set_tag", interrupted)
        with pytest.raises(KeyboardInterrupt):
            opened.set_tag(run_id, "a", "b")
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == ["written"]
