"""The tracking server or database is opened, or it is said why it cannot be."""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import pytest

from mrhubo.errors import Unreachable, UserError
from mrhubo.runtime import client as clients
from mrhubo.runtime import failures
from mrhubo.runtime.client import TrackingClient
from mrhubo.runtime.tracking import open_client, set_up_mlflow


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients, "_PAUSES", (0.0,))


def raise_(error: BaseException) -> None:
    raise error


def test_a_deleted_experiment_is_named_and_how_to_get_it_back(folder: Path, opened: TrackingClient) -> None:
    found = opened.get_experiment_by_name("mrhubo")
    assert found is not None
    opened.delete_experiment(found.experiment_id)
    command = f"mlflow experiments restore --experiment-id {found.experiment_id}"
    with pytest.raises(UserError, match=f"^tracking.experiment: 'mrhubo' was deleted .*name another.*{command}"):
        open_client(folder, "mrhubo")
    open_client(folder, "another")
    opened.restore_experiment(found.experiment_id)
    open_client(folder, "mrhubo")


@pytest.mark.parametrize(
    ("uri", "sentence"),
    [
        ("http://anna:s3cret@127.0.0.1:9", r"no server answers at http://anna:\*\*\*@127.0.0.1:9 \(Connection refused"),
        ("https://127.0.0.1:9", "no server answers"),
        ("postgresql://anna:s3cret@127.0.0.1:9/db", r"no server answers at postgresql://anna:\*\*\*@127.0.0.1:9/db"),
        ("mysql+pymysql://anna:s3cret@127.0.0.1:9/db", "Connection refused"),
        ("localhost:5000", "write http://localhost:5000"),
        ("10.0.0.1:5000/mlflow", "write http://10.0.0.1:5000/mlflow"),
        ("nonsense://anna:s3cret@host", r"MLflow cannot open nonsense://anna:\*\*\*@host"),
        ("http://anna:***@host", "the password was left out where this config was written"),
        ("sqlite:////proc/none/mlflow.db", "proc/none"),
    ],
)  # fmt: skip
def test_addresses_that_do_not_work_are_named_within_seconds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, uri: str, sentence: str
) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_PASSWORD", raising=False)
    start = time.monotonic()
    with pytest.raises(UserError, match=sentence) as error:
        open_client(tmp_path, "mrhubo", uri)
    assert "s3cret" not in str(error.value) and time.monotonic() - start < 30  # not minutes


def test_mlflow_gets_the_password_apart_from_the_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It prints and quotes addresses."""
    for name in ("MLFLOW_TRACKING_USERNAME", "MLFLOW_TRACKING_PASSWORD"):
        monkeypatch.setenv(name, "other")
    monkeypatch.setattr(failures, "silence", lambda uri, seconds: None)
    asked = []
    monkeypatch.setattr(TrackingClient, "get_experiment_by_name", lambda self, name: asked.append(self.uri) or raise_(Unreachable("x")))  # fmt: skip # noqa: E501
    with pytest.raises(Unreachable):
        open_client(tmp_path, "mrhubo", "http://anna:s3%40cret@host:5000/x")
    assert asked == ["http://host:5000/x"]
    assert (os.environ["MLFLOW_TRACKING_USERNAME"], os.environ["MLFLOW_TRACKING_PASSWORD"]) == ("anna", "s3@cret")
    with pytest.raises(Unreachable):
        open_client(tmp_path, "mrhubo", "http://anna:***@host:5000/x")  # as it was written; the variables are set
    assert os.environ["MLFLOW_TRACKING_PASSWORD"] == "s3@cret"


def test_settings_of_the_user_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MLFLOW_HTTP_REQUEST_TIMEOUT", "7")
    monkeypatch.delenv("MLFLOW_HTTP_REQUEST_MAX_RETRIES", raising=False)
    set_up_mlflow()
    assert os.environ["MLFLOW_HTTP_REQUEST_TIMEOUT"] == "7" and int(os.environ["MLFLOW_HTTP_REQUEST_MAX_RETRIES"]) < 3


def test_make_dashboard_opens_what_is_there(
    tmp_path: Path, empty_tracking: Path, monkeypatch: pytest.MonkeyPatch, root: Path
) -> None:
    (command,) = re.findall(r"^OPEN := (.*)$", (root / "Makefile").read_text(), re.M)
    monkeypatch.chdir(tmp_path)
    shutil.copytree(empty_tracking, tmp_path / "mlruns")
    monkeypatch.setattr("mrhubo.config.run_command", lambda main: main([]))
    exec(command, {})
    with closing(sqlite3.connect(tmp_path / "mlruns" / "mlflow.db")) as database:
        places = {place for (place,) in database.execute("SELECT artifact_location FROM experiments")}
    assert (tmp_path / "mlruns" / "artifacts").as_uri() in places


def test_a_byte_that_is_no_letter_is_no_name_of_an_experiment(folder: Path) -> None:
    with pytest.raises(UserError, match="^tracking.experiment: 'a.udcff' holds what is no letter"):
        open_client(folder, "a\udcff")


@pytest.mark.parametrize("name", ["", "n" * 600])
def test_impossible_names_of_experiments_are_named(folder: Path, name: str) -> None:
    with pytest.raises(UserError, match="^tracking.experiment: MLflow does not take '") as error:
        open_client(folder, name)
    assert len(str(error.value)) < 300


@pytest.mark.parametrize("name", ["../../up", "a 'b' \"c\"", "ナオ", "50%"])
def test_other_names_of_experiments_are_taken(folder: Path, name: str) -> None:
    before = sorted(folder.parent.rglob("*"))
    open_client(folder, name)
    found = open_client(folder, name).get_experiment_by_name(name)
    assert found is not None and found.artifact_location == (folder / "artifacts").as_uri()
    assert {path.name for path in set(folder.parent.rglob("*")) - set(before)} <= {"mlflow.lock"}
