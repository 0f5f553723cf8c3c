"""Folders are tried before any work, and none is left behind where one refuses."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import pytest

from mrhubo.errors import UserError
from mrhubo.runtime import folders
from mrhubo.runtime.folders import make_folders


def test_they_are_made(tmp_path: Path) -> None:
    make_folders({"tracking.dir": [tmp_path / "a" / "b", tmp_path / "a" / "c"]})
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["b", "c"]
    assert not list((tmp_path / "a" / "b").iterdir())


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ("file", "it is a file, and a folder is wanted"),
        ("file/x/y", "file is a file, and a folder is wanted"),
        ("link", "it is a link to nothing"),
        ("link/x", "link is a link to nothing"),
        ("n" * 300, "File name too long"),
        ("a/" * 3000, "File name too long"),
        ("a\0b", "null byte"),
        ("a\udcff", "its name is not UTF-8"),
    ],
)
def test_impossible_ones_are_named_with_their_setting(tmp_path: Path, place: str, reason: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    before = sorted(os.listdir(tmp_path))
    with pytest.raises(UserError) as error:
        make_folders({"pairs.dir": [tmp_path / "new" / "deep"], "tracking.dir": [tmp_path / place]})
    assert str(error.value).startswith("tracking.dir: ") and reason in str(error.value)
    assert len(str(error.value)) < 500 + len(str(tmp_path))
    assert sorted(os.listdir(tmp_path)) == before, "nothing is left"


@pytest.mark.parametrize("code", [errno.EACCES, errno.EROFS, errno.ENOSPC, errno.EDQUOT])
def test_one_that_takes_no_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(folders.tempfile, "TemporaryFile", refuse)
    with pytest.raises(UserError, match=os.strerror(code)):
        make_folders({"tracking.dir": [tmp_path / "a"]})
    assert not list(tmp_path.iterdir())


def test_the_folder_for_temporary_files_is_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "file"))
    with pytest.raises(UserError, match="^TMPDIR: .*file cannot be used: it is a file"):
        make_folders({"tracking.dir": [tmp_path / "a"]})
    assert not (tmp_path / "a").exists()
