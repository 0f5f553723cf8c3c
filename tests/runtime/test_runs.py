"""Runs: begun, found again, closed; also those whose process was killed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from mlflow.exceptions import MlflowException

from mrhubo.errors import Unreachable, UserError
from mrhubo.runtime import client as clients
from mrhubo.runtime.client import TrackingClient
from mrhubo.runtime.processes import this_process
from mrhubo.runtime.runs import ending, find_run, log_all, start_run, take_up_run
from mrhubo.runtime.tracking import open_client
from mrhubo.runtime.workspace import Workspace

DEAD = this_process().rsplit(" ", 1)[0] + " 1.0"
"""A process with our number that was started long ago."""


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients, "_PAUSES", (0.0,))


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    """One with a run's checkpoint in it."""
    workspace = Workspace(tmp_path / "fits", "nao", "abc")
    workspace.checkpoints.mkdir(parents=True)
    return workspace


def checkpoint(workspace: Workspace) -> None:
    workspace.checkpoints.mkdir(exist_ok=True)
    torch.save({"step": 1}, workspace.checkpoints / "last.ckpt")


def take_up(client: TrackingClient, workspace: Workspace) -> tuple[str, bool]:
    run, new = take_up_run(client, "mrhubo", workspace, "a run", {"robot": "nao"})
    return run.info.run_id, new


def runs(client: TrackingClient) -> dict[str, Any]:
    found = client.get_experiment_by_name("mrhubo")
    assert found is not None
    return {run.info.run_id: run for run in client.search_runs([found.experiment_id])}


def test_an_unfinished_run_is_taken_up_again(opened: TrackingClient, workspace: Workspace) -> None:
    run_id, new = take_up(opened, workspace)
    checkpoint(workspace)
    opened.set_tag(run_id, "ended_by", "UserError: full")
    opened.set_terminated(run_id, "FAILED")
    assert new and take_up(opened, workspace) == (run_id, False)
    found = opened.get_run(run_id)
    assert found.info.status == "RUNNING" and "resumed" in found.data.tags and "ended_by" not in found.data.tags
    assert workspace.last_checkpoint() is not None and len(runs(opened)) == 1


def test_one_that_was_deleted_makes_room_for_a_new_one(opened: TrackingClient, workspace: Workspace) -> None:
    run_id, _ = take_up(opened, workspace)
    checkpoint(workspace)
    opened.delete_run(run_id)
    other, new = take_up(opened, workspace)
    assert new and other != run_id and workspace.last_checkpoint() is None


@pytest.mark.parametrize("times", [1, 10**9])
def test_a_failure_that_may_pass_removes_nothing(
    opened: TrackingClient, workspace: Workspace, fail: Callable[..., None], times: int
) -> None:
    run_id, _ = take_up(opened, workspace)
    checkpoint(workspace)
    with pytest.MonkeyPatch.context():
        fail(MlflowException("database is busy"), "get_run", times=times)
        if times == 1:
            assert take_up(opened, workspace) == (run_id, False)
        else:
            with pytest.raises(Unreachable, match="database is busy"):
                take_up(opened, workspace)
    assert workspace.run_id == run_id and workspace.last_checkpoint() is not None and len(runs(opened)) == 1


def test_a_start_that_was_killed_before_it_noted_its_run_finds_it(
    opened: TrackingClient, workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(Workspace, "start", lambda *_: raise_(KeyboardInterrupt()))
        take_up(opened, workspace)
    (left,) = runs(opened)
    assert workspace.run_id is None
    assert take_up(opened, workspace) == (left, False) and workspace.run_id == left


def raise_(error: BaseException) -> None:
    raise error


def test_runs_of_killed_processes_are_closed_at_the_next_start(folder: Path, opened: TrackingClient) -> None:
    dead, alive, old = (start_run(opened, "mrhubo", name, {}).info for name in ("dead", "alive", "old"))
    opened.set_tag(dead.run_id, "process", DEAD)
    opened.delete_tag(old.run_id, "process")  # of a version that noted none: nobody knows
    half = opened.create_logged_model(dead.experiment_id, "mrhubo-nao", dead.run_id)
    assert half.status == "PENDING"
    found = runs(open_client(folder, "mrhubo"))
    assert [found[info.run_id].info.status for info in (dead, alive, old)] == ["KILLED", "RUNNING", "RUNNING"]
    assert found[dead.run_id].data.tags["ended_by"] == "its process ended without a word"
    assert not opened.search_logged_models([dead.experiment_id], f"source_run_id = '{dead.run_id}'")


@pytest.mark.parametrize(
    ("error", "status"), [(None, "FINISHED"), (KeyboardInterrupt(), "KILLED"), (UserError("full"), "FAILED")]
)
def test_a_run_is_closed_as_it_ended(opened: TrackingClient, error: BaseException | None, status: str) -> None:
    run_id = start_run(opened, "mrhubo", "a", {}).info.run_id
    try:
        with ending(opened, run_id):
            log_all(opened, run_id, {"test/a(1)/link_cm": 1.0}, {"storage": "postgresql://a:s3cret@h"})
            if error is not None:
                raise error
    except BaseException as raised:
        assert raised is error
    found = opened.get_run(run_id)
    assert found.info.status == status and ("ended_by" in found.data.tags) == (error is not None)
    assert found.data.metrics == {"test/a_x28_1_x29_/link_cm": 1.0}
    assert found.data.params == {"storage": "postgresql://a:***@h"}


@pytest.mark.parametrize("value", ["plain", "it's", 'say "a"', "a = 'b"])
def test_runs_are_found_by_tags_of_any_text(opened: TrackingClient, value: str) -> None:
    run = start_run(opened, "mrhubo", "a" * 400, {"sweep": value}).info
    found = find_run(opened, "mrhubo", {"sweep": value})
    assert found is not None and found.info.run_id == run.run_id and find_run(opened, "mrhubo", {"sweep": "x"}) is None


def test_a_file_name_that_is_no_text_can_be_written(opened: TrackingClient) -> None:
    run_id = start_run(opened, "mrhubo", "a\udcff", {"motions": "b\udcff"}).info.run_id
    log_all(opened, run_id, {"test/c\udcff/link_cm": 1.0}, {"dir": "/d\udcff"})
    found = opened.get_run(run_id)
    assert found.data.tags["motions"] == "b\\udcff" and found.data.params == {"dir": "/d\\udcff"}
    assert found.info.run_name == "a\\udcff" and list(found.data.metrics) == ["test/c_xDCFF_/link_cm"]
