"""Nobody waits for a compiler that does not pay, and what has been compiled is known without numba."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrhubo.fast import kept
from mrhubo.motion import Motion
from mrhubo.retargeting import forms
from mrhubo.retargeting.forms import Forms


class Stub:
    """In the place of a retargeter: says which form it is."""

    def __init__(self, description: object, form: str) -> None:
        self.description, self.form = description, form

    def __call__(self, motion: Motion, avoid_collisions: bool) -> str:
        return self.form


def answers(monkeypatch: pytest.MonkeyPatch, numba: bool, is_kept: bool, minutes: list[float]) -> str:
    """Who answers motions of 60 frames a second, one letter each."""
    monkeypatch.setattr(forms, "FastRetargeter", Stub)
    monkeypatch.setattr(forms, "numba_is_there", lambda: numba)
    monkeypatch.setattr(forms, "is_kept", lambda universal: is_kept)
    form = Forms(SimpleNamespace(universal=None))  # pyright: ignore[reportArgumentType]
    still = [Motion.of(name="", local_TJ33=np.zeros((int(3600 * m), 1)), frame_rate=60.0) for m in minutes]
    return "".join(str(form(motion))[0] for motion in still)


def test_the_form_follows_what_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    assert answers(monkeypatch, False, False, [0.1, 100.0]) == "nn"
    assert answers(monkeypatch, True, False, [0.1, 1.0, 5.0, 5.0, 5.0, 5.0, 0.1]) == "nnnnncc"
    assert answers(monkeypatch, True, False, [60.0]) == "c"
    assert answers(monkeypatch, True, True, [0.1, 0.1, 2.0, 0.1]) == "nncc"


def test_what_is_kept_is_noted_and_forgotten_with_its_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert not kept.is_kept()
    file = tmp_path / "kernels.some.nbi"
    file.touch()
    kept.note_kept([str(tmp_path)])
    assert kept.is_kept()
    monkeypatch.setattr(kept, "checksum", lambda: "of another version")
    assert not kept.is_kept()
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file.unlink()
    assert not kept.is_kept()
    monkeypatch.setenv("XDG_CACHE_HOME", str(file / "nowhere"))
    file.touch()
    kept.note_kept([str(tmp_path)])  # nothing can be written, and nothing is said
    assert not kept.is_kept()
    for note in (tmp_path / "cache").rglob("*.json"):
        note.write_text("[1")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
        assert not kept.is_kept()


def test_the_universal_network_is_compiled_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "kernels.some.nbi").touch()
    kept.note_kept([str(tmp_path)])
    assert kept.is_kept() and not kept.is_kept(universal=True)
    kept.note_kept([str(tmp_path)], universal=True)
    assert kept.is_kept(universal=True)
    assert not any(kept.is_kept(True, work) for work in (kept.FRAMES, kept.STANDING))
