"""Faults of the machine are told from bugs."""

from __future__ import annotations

import errno
import os
import sqlite3

import pytest

from mrhubo.config import faults
from mrhubo.config.faults import machine_fault


def of(code: int, name: str | None = None) -> OSError:
    return OSError(code, os.strerror(code), name) if name else OSError(code, os.strerror(code))


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (of(errno.EACCES, "/a/b"), "/a/b: Permission denied"),
        (of(errno.ENAMETOOLONG, "/a/b"), "/a/b: File name too long"),
        (of(errno.EROFS, "/a/b"), "/a/b: Read-only file system"),
        (sqlite3.OperationalError("database or disk is full"), "database or disk is full"),
        (RuntimeError("[enforce fail] PytorchStreamWriter failed writing file"), "PytorchStreamWriter failed"),
        (of(errno.ENOENT, "/a/b"), None),
        (ConnectionResetError(errno.ECONNRESET, "reset"), None),
        (KeyError("a"), None),
    ],
)
def test_one_sentence_or_none(error: Exception, sentence: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faults, "_full_folders", lambda: [])
    assert machine_fault(error) == sentence
    try:
        raise ValueError("what a library makes of it") from error
    except ValueError as outer:
        assert machine_fault(outer) == sentence


def test_a_full_disk_is_named_where_the_error_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    class Usage:
        free = 0

    monkeypatch.setattr(faults.shutil, "disk_usage", lambda folder: Usage)
    found = machine_fault(of(errno.ENOSPC))
    assert (
        found is not None and "the folder for temporary files (" in found and found.endswith("No space left on device")
    )


def test_what_was_handled_is_not_blamed() -> None:
    try:
        try:
            raise of(errno.EACCES, "/a")
        except OSError:
            raise KeyError("a bug") from None
    except KeyError as error:
        assert machine_fault(error) is None


def test_a_system_that_cannot_write_a_name_is_told_from_a_bug(monkeypatch: pytest.MonkeyPatch) -> None:
    def error(encoding: str) -> UnicodeEncodeError:
        with pytest.raises(UnicodeEncodeError) as caught:
            "runs/J\ud800ürgen".encode(encoding)
        return caught.value

    assert machine_fault(error("ascii")) is machine_fault(error("utf-8")) is None
    monkeypatch.setattr(faults.sys, "getfilesystemencoding", lambda: "ANSI_X3.4-1968")
    found = machine_fault(error("ascii"))
    assert found is not None and "in ANSI_X3.4-1968, have no letter" in found and "LC_ALL=C.UTF-8" in found
    assert machine_fault(error("latin-1")) is machine_fault(error("utf-8")) is None
