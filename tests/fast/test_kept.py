"""What numba kept of other versions goes; what it kept of this one, and what is not ours, stays."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from mrhubo.errors import UserError
from mrhubo.fast import kept
from mrhubo.fast.kept import checksum, drop_others
from mrhubo.files.cache import user_cache
from mrhubo.retargeter import Retargeter
from mrhubo.retargeter.kept_confidence import calibrated


def test_files_of_other_versions_go(tmp_path: Path) -> None:
    ours = [tmp_path / f"kernels.make_kernels.locals.look-1.py311.{ending}" for ending in ("nbi", "1.nbc")]
    other = tmp_path / "robot.place-1.py311.nbi"
    for known in (None, "another version", checksum()):
        for file in (*ours, other):
            file.write_bytes(b"x")
        if known is not None:
            (tmp_path / "mrhubo-compiled.txt").write_text(known)
        drop_others(str(tmp_path))
        assert [file.exists() for file in ours] == [known == checksum()] * 2 and other.exists()
        assert (tmp_path / "mrhubo-compiled.txt").read_text() == checksum()


def test_a_folder_that_is_not_there_or_cannot_be_written_is_left(tmp_path: Path) -> None:
    drop_others(None)
    (tmp_path / "file").write_text("no folder")
    drop_others(str(tmp_path / "file"))
    drop_others(str(tmp_path / "new"))
    assert (tmp_path / "new" / "mrhubo-compiled.txt").read_text() == checksum()


def use(monkeypatch: pytest.MonkeyPatch, takes: bool) -> dict[str, str]:
    """An environment of its own, and a program's folder that takes no files, as that of another user; a home that
    `takes` some.
    """
    environment: dict[str, str] = {}
    monkeypatch.setattr(kept.os, "environ", environment)
    monkeypatch.setattr(kept, "_takes_files", lambda folder: takes and folder.name == "numba")
    return environment


def test_numba_gets_a_folder_where_it_can_keep_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    environment = use(monkeypatch, takes=False)
    ends: list[Callable[[], object]] = []
    monkeypatch.setattr(kept.atexit, "register", ends.append)
    monkeypatch.setattr(kept.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setitem(sys.modules, "numba", SimpleNamespace(config=SimpleNamespace(CACHE_DIR="")))
    environment["XDG_CACHE_HOME"] = str(tmp_path / "cache")
    kept.make_room()
    folder = Path(environment["NUMBA_CACHE_DIR"])
    assert folder.is_dir() and folder.parent == tmp_path and sys.modules["numba"].config.CACHE_DIR == str(folder)
    (folder / "a.nbi").touch()
    ends[0]()
    assert not folder.exists()
    environment["NUMBA_CACHE_DIR"] = "mine"
    kept.make_room()
    assert environment["NUMBA_CACHE_DIR"] == "mine" and len(ends) == 1


def test_numba_keeps_its_folder_where_it_has_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    environment = use(monkeypatch, takes=True)
    environment["XDG_CACHE_HOME"] = str(tmp_path)
    kept.make_room()
    assert "NUMBA_CACHE_DIR" not in environment


def test_a_user_without_a_home_has_nothing_kept_and_is_told_where_it_matters(
    monkeypatch: pytest.MonkeyPatch, make: Callable[[str], Retargeter]
) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", no_home)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    with pytest.raises(UserError, match="no home folder to keep files in: set HOME, or XDG_CACHE_HOME"):
        user_cache()
    assert not kept.is_kept()
    kept.note_kept([])
    assert calibrated(make("nao")) is not None
