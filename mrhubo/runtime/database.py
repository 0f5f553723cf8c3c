"""MLflow's database in a file: whole or absent, in a folder of any name, and still right when the folder has moved."""

from __future__ import annotations

import contextlib
import filecmp
import re
import shutil
import sqlite3
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.storage import locked, remove_leftovers

NAME = "mlflow.db"
_WAIT = 60.0
"""Seconds that we wait for a database which somebody else has locked."""
_PLACES = {
    "runs": ("artifact_uri",),
    "logged_models": ("artifact_location",),
    "model_versions": ("source", "storage_location"),
}
"""Columns that hold places of artifacts, beside that of the experiments."""
_OURS = ("mlflow.experimentKind", "custom_model_development")
"""The tag of experiments that mrhubo has made."""


def database_uri(folder: Path) -> str:
    """SQLite tracking URI of `mlflow.db` in a folder."""
    return sqlite_uri(folder.resolve() / NAME)


def sqlite_uri(file: Path) -> str:
    """SQLAlchemy's address of a SQLite file; the file's path may hold any letter."""
    if not re.search(r"[%?#\x00-\x1f]", str(file)):
        return f"sqlite:///{file}"
    from sqlalchemy.engine import make_url

    # MLflow makes the folders of sqlite:///..., taking what is encoded for a name; sqlite+pysqlite it leaves alone.
    uri = f"sqlite+pysqlite:///{quote(str(file))}"
    if make_url(uri).database == str(file):
        return uri
    return f"sqlite+pysqlite:///file:{quote(str(file))}?uri=true"  # SQLAlchemy before 2.1 decodes no file name


def sqlite_file(uri: str) -> Path | None:
    """The file of a SQLite address; None of any other, and of a database in memory."""
    if not uri.startswith("sqlite"):
        return None
    from sqlalchemy.engine import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        database = make_url(uri).database
    except ArgumentError:
        return None
    if not database or database == ":memory:":
        return None
    return Path(unquote(database.removeprefix("file:")) if database.startswith("file:") else database)


def open_database(file: Path, artifacts: Path) -> None:
    """Makes MLflow's database unless it is there, and lets it find its artifacts where they are now.

    It is made aside and takes its name when it is whole: MLflow's own beginning, broken off, leaves one that no later
    start can use. Such a one, made by an earlier version, is replaced if it holds nothing.

    Args:
        file: of the database.
        artifacts: the folder of its artifacts.

    Raises:
        UserError: the file is no database, or is damaged; the folder refuses it.
    """
    with locked(file.with_name("mlflow.lock"), wait=True):
        if not _holds_anything(file):
            _make(file, artifacts)
        follow(file, artifacts)


def follow_if_possible(folder: Path) -> None:
    """`follow` for whoever only reads: a folder that takes no changes stays as it is."""
    with contextlib.suppress(UserError), locked(folder / "mlflow.lock", wait=True):
        follow(folder / NAME, folder / "artifacts")


def follow(file: Path, artifacts: Path) -> None:
    """Turns places of artifacts that were beside the database in another folder into those beside it now.

    A database remembers them as absolute paths. Where a folder was copied, both copies have their own artifacts; what
    was left behind and not copied is still found where it is.
    """
    with _connected(file) as database:
        if "experiments" not in _tables(database):
            return
        new = artifacts.resolve().as_uri()
        query = "SELECT DISTINCT artifact_location FROM experiments WHERE artifact_location LIKE 'file:%'"
        for (old,) in database.execute(query).fetchall():
            if old != new and old.endswith(f"/{artifacts.name}") and _is_ours(database, old, new):
                _rewrite(database, old, new)


def _is_ours(database: sqlite3.Connection, old: str, new: str) -> bool:
    """Whether artifacts of this database were in a folder: mrhubo began an experiment there, or its runs are here."""
    query = "SELECT 1 FROM experiments JOIN experiment_tags USING (experiment_id)"
    if database.execute(f"{query} WHERE artifact_location = ? AND key = ? AND value = ?", (old, *_OURS)).fetchone():
        return True
    places = database.execute("SELECT artifact_uri FROM runs WHERE substr(artifact_uri, 1, ?) = ?", (len(old), old))
    return any(_is_there(new + place[len(old) :]) for (place,) in places)


def _rewrite(database: sqlite3.Connection, old: str, new: str) -> None:
    def moved(place: str | None) -> str | None:
        """The new place of an artifact's folder, unless it is found at the old one alone."""
        if place is None or not place.startswith(f"{old}/"):
            return place
        found = new + place[len(old) :]
        return place if _is_there(place) and not _is_there(found) else found

    def begun(place: str | None) -> str | None:
        """The new place of what is still to be written."""
        whole = place is not None and (place == old or place.startswith(f"{old}/"))
        return new + place[len(old) :] if whole and place is not None else place

    rules: list[tuple[str, str, Callable[[str | None], str | None]]] = [("experiments", "artifact_location", begun)]
    rules += [(table, column, moved) for table, columns in _PLACES.items() for column in columns]
    there = set(_tables(database))
    for number, (table, column, rule) in enumerate(rules):
        if table in there:
            database.create_function(f"rule{number}", 1, rule)
            database.execute(f"UPDATE {table} SET {column} = rule{number}({column}) WHERE {column} LIKE 'file:%'")
    database.commit()
    _forget_places()


def _forget_places() -> None:
    """MLflow remembers the places of runs that this process has written to."""
    remembered = getattr(sys.modules.get("mlflow.tracking._tracking_service.client"), "utils", None)
    getattr(remembered, "_artifact_repos_cache", {}).clear()


def local_path(uri: str) -> Path | None:
    """The place that a file's address names; None of any other address."""
    return Path(unquote(urlsplit(uri).path)) if uri.startswith("file:") else None


def _is_there(uri: str) -> bool:
    path = local_path(uri)
    return path is not None and path.exists()


def _make(file: Path, artifacts: Path) -> None:
    remove_leftovers(file.parent)
    for journal in file.parent.glob(f".{file.name}.*.tmp-journal"):
        if not journal.with_name(journal.name.removesuffix("-journal")).exists():
            journal.unlink(missing_ok=True)
    if file.is_file() and _is_whole(file, artifacts):
        return  # it holds nothing, but somebody may be reading it
    with atomic_path(file) as temporary:
        journal = temporary.with_name(f"{temporary.name}-journal")
        try:
            _create(temporary, artifacts)
        finally:
            journal.unlink(missing_ok=True)
    _forget_connections(file)


def _forget_connections(file: Path) -> None:
    """This process may still be connected to a database that was there before and was deleted."""
    store = sys.modules.get("mlflow.store.tracking.sqlalchemy_store")
    known = getattr(getattr(store, "SqlAlchemyStore", None), "_engine_map", {}).get(sqlite_uri(file))
    if known is not None:
        known.dispose()


def _create(file: Path, artifacts: Path) -> None:
    """MLflow's own beginning, or its check of what is there."""
    from mlflow.store.tracking.sqlalchemy_store import SqlAlchemyStore

    SqlAlchemyStore(sqlite_uri(file), artifacts.resolve().as_uri()).engine.dispose()


def _is_whole(file: Path, artifacts: Path) -> bool:
    """Whether MLflow can open a database as it is; tried on a copy, since it makes what is missing."""
    with tempfile.TemporaryDirectory() as folder:
        copy = shutil.copyfile(file, Path(folder) / file.name)
        try:
            _create(copy, artifacts)
        except Exception:  # MLflow's, SQLAlchemy's, Alembic's
            return False
        return filecmp.cmp(file, copy, shallow=False)


def _holds_anything(file: Path) -> bool:
    """Whether there are runs, models or experiments in a database; what has none may be replaced."""
    if not file.exists():
        return False
    queries = {
        "runs": "SELECT 1 FROM runs LIMIT 1",
        "registered_models": "SELECT 1 FROM registered_models LIMIT 1",
        "experiments": "SELECT 1 FROM experiments WHERE experiment_id != 0 LIMIT 1",
    }
    with _connected(file) as database:
        there = set(_tables(database))
        return any(database.execute(query).fetchone() for table, query in queries.items() if table in there)


def _tables(database: sqlite3.Connection) -> list[str]:
    return [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]


@contextlib.contextmanager
def _connected(file: Path) -> Iterator[sqlite3.Connection]:
    try:
        address = f"{file.resolve().as_uri()}?mode=rw"
        with contextlib.closing(sqlite3.connect(address, timeout=_WAIT, uri=True)) as database:
            yield database
    except sqlite3.Error as error:
        raise UserError(f"{file}: MLflow's database cannot be used: {error}; put it right, or move it away") from error
