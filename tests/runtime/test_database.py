"""MLflow's database: whole or absent, in a folder of any name, and right after a move."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy.engine import create_engine, make_url

from mrhubo.errors import UserError
from mrhubo.runtime import database
from mrhubo.runtime.database import database_uri, open_database, sqlite_file, sqlite_uri
from mrhubo.runtime.runs import start_run
from mrhubo.runtime.tracking import open_client

LETTERS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="/\0"), min_size=1, max_size=20)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("name", ["q?x", "a#b", "50%41", "a b", "ü", "a@b:c", "it's", "q?x=1&y#%3F", "tab\there"])
def test_the_file_is_in_the_folder_of_that_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    engine = create_engine(database_uri(tmp_path / name))
    with engine.connect() as connection:
        connection.exec_driver_sql("CREATE TABLE a (b)")
    engine.dispose()
    assert names(tmp_path / name) == {"mlflow.db"} and names(tmp_path) == {name}
    assert sqlite_file(database_uri(tmp_path / name)) == tmp_path / name / "mlflow.db"


@given(LETTERS)
def test_addresses_come_back(name: str) -> None:
    file = Path("/folder") / name / "mlflow.db"
    assert sqlite_file(sqlite_uri(file)) == file and make_url(sqlite_uri(file)).get_dialect().name == "sqlite"


@pytest.mark.parametrize("uri", ["http://host:5000", "postgresql://host/db", "sqlite://", "sqlite:///:memory:"])
def test_other_addresses_are_no_files(uri: str) -> None:
    assert sqlite_file(uri) is None


def test_mlflow_works_in_a_folder_of_any_name(
    tmp_path: Path, empty_tracking: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = Path(shutil.copytree(empty_tracking, tmp_path / "q?x #5%41"))
    client = open_client(folder, "mrhubo")
    run = start_run(client, "mrhubo", "a", {}).info.run_id
    client.log_text(run, "b", "c/d.txt")
    assert (folder / "artifacts" / run / "artifacts" / "c" / "d.txt").read_text() == "b"
    assert [found.path for found in client.list_artifacts(run, "c")] == ["c/d.txt"]
    assert names(tmp_path) == {folder.name} and names(folder) == {"mlflow.db", "mlflow.lock", "artifacts"}


@pytest.mark.parametrize("interrupt", [KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_a_beginning_that_is_broken_off_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, interrupt: BaseException
) -> None:
    def broken(file: Path, artifacts: Path) -> None:
        with closing(sqlite3.connect(file)) as half:
            half.execute("CREATE TABLE experiments (experiment_id)")
        file.with_name(f"{file.name}-journal").touch()
        raise interrupt

    monkeypatch.setattr(database, "_create", broken)
    with pytest.raises((KeyboardInterrupt, UserError)):
        open_database(tmp_path / "mlflow.db", tmp_path / "artifacts")
    assert names(tmp_path) <= {"mlflow.lock"}


def test_what_a_killed_process_left_is_removed(
    tmp_path: Path, empty_tracking: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os

    dead = f".mlflow.db.{os.uname().nodename}.{2**22 + 1}.tmp"
    (tmp_path / dead).touch()
    (tmp_path / f"{dead}-journal").touch()
    monkeypatch.setattr(
        database, "_create", lambda file, artifacts: shutil.copyfile(empty_tracking / "mlflow.db", file)
    )
    open_database(tmp_path / "mlflow.db", tmp_path / "artifacts")
    assert names(tmp_path) == {"mlflow.db", "mlflow.lock"}


def half(file: Path, run: bool = False) -> None:
    """A database as an interrupted start of an earlier version left it."""
    with closing(sqlite3.connect(file)) as made:
        made.execute("CREATE TABLE experiments (experiment_id INTEGER, name TEXT, artifact_location TEXT)")
        made.execute("CREATE TABLE runs (run_uuid TEXT, artifact_uri TEXT)")
        if run:
            made.execute("INSERT INTO runs VALUES ('a', 'b')")
        made.commit()


@pytest.mark.parametrize("begin", [half, lambda file: file.touch()])
def test_a_half_made_one_without_runs_is_replaced(
    tmp_path: Path, empty_tracking: Path, monkeypatch: pytest.MonkeyPatch, begin
) -> None:
    def create(file: Path, artifacts: Path) -> None:
        if file.exists() and file.stat().st_size:
            raise RuntimeError("table experiments already exists")
        shutil.copyfile(empty_tracking / "mlflow.db", file)

    begin(tmp_path / "mlflow.db")
    monkeypatch.setattr(database, "_create", create)
    open_database(tmp_path / "mlflow.db", tmp_path / "artifacts")
    assert (tmp_path / "mlflow.db").stat().st_size == (empty_tracking / "mlflow.db").stat().st_size


def test_mlflow_does_refuse_such_a_half_made_one(tmp_path: Path) -> None:
    half(tmp_path / "mlflow.db")
    assert not database._is_whole(tmp_path / "mlflow.db", tmp_path / "artifacts")


def test_one_with_runs_is_never_replaced(tmp_path: Path) -> None:
    half(tmp_path / "mlflow.db", run=True)
    before = (tmp_path / "mlflow.db").read_bytes()
    with pytest.raises(UserError, match="^tracking.uri: MLflow cannot open sqlite"):
        open_client(tmp_path, "mrhubo")
    with closing(sqlite3.connect(tmp_path / "mlflow.db")) as kept:
        assert kept.execute("SELECT run_uuid FROM runs").fetchall() == [("a",)]
    assert before[:16] == (tmp_path / "mlflow.db").read_bytes()[:16]


@pytest.mark.parametrize("content", [b"no database at all, but text", b"SQLite format 3\0" + bytes(400)])
def test_what_is_no_database_is_named_and_stays(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "mlflow.db").write_bytes(content)
    with pytest.raises(UserError, match=r"mlflow.db: MLflow's database cannot be used: .*move it away"):
        open_client(tmp_path, "mrhubo")
    assert (tmp_path / "mlflow.db").read_bytes() == content


def test_a_folder_in_its_place_is_named(tmp_path: Path) -> None:
    (tmp_path / "mlflow.db").mkdir()
    with pytest.raises(UserError, match="mlflow.db: MLflow's database cannot be used: unable to open"):
        open_client(tmp_path, "mrhubo")


@pytest.mark.parametrize("copied", [True, False])
def test_after_a_move_or_a_copy_artifacts_are_beside_the_database(folder: Path, tmp_path: Path, copied: bool) -> None:
    client = open_client(folder, "mrhubo")
    run = start_run(client, "mrhubo", "a", {}).info.run_id
    client.log_text(run, "of the first", "a.txt")
    place = tmp_path / "elsewhere" / "runs %41"
    place.parent.mkdir()
    (shutil.copytree if copied else shutil.move)(folder, place)
    moved = open_client(place, "mrhubo")
    assert [found.path for found in moved.list_artifacts(run)] == ["a.txt"]
    new = start_run(moved, "mrhubo", "b", {}).info.run_id
    moved.log_text(new, "of the second", "b.txt")
    moved.log_text(run, "changed", "a.txt")
    assert (place / "artifacts" / new / "artifacts" / "b.txt").is_file()
    assert folder.exists() == copied
    if copied:
        assert not (folder / "artifacts" / new).exists()
        assert (folder / "artifacts" / run / "artifacts" / "a.txt").read_text() == "of the first"


def test_what_was_not_copied_is_found_where_it_was(folder: Path, tmp_path: Path) -> None:
    client = open_client(folder, "mrhubo")
    run = start_run(client, "mrhubo", "a", {}).info.run_id
    client.log_text(run, "kept", "a.txt")
    place = tmp_path / "copy"
    place.mkdir()
    shutil.copy(folder / "mlflow.db", place)
    copy = open_client(place, "mrhubo")
    assert [found.path for found in copy.list_artifacts(run)] == ["a.txt"]
    new = start_run(copy, "mrhubo", "b", {}).info
    assert new.artifact_uri is not None and new.artifact_uri.startswith((place / "artifacts").as_uri())


def test_experiments_of_others_stay_where_they_are(folder: Path, tmp_path: Path) -> None:
    open_client(folder, "mrhubo").create_experiment("mine", artifact_location=(tmp_path / "mine").as_uri())
    place = Path(shutil.copytree(folder, tmp_path / "copy"))
    found = open_client(place, "mrhubo").get_experiment_by_name("mine")
    assert found is not None and found.artifact_location == (tmp_path / "mine").as_uri()
