"""What a fit remembers between calls."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.errors import UserError
from mrhubo.runtime.workspace import Workspace


def test_it_remembers_the_run_until_it_is_finished(tmp_path: Path) -> None:
    with Workspace(tmp_path, "nao", "abc") as workspace:
        assert workspace.run_id is None
        workspace.start("run1")
        workspace.checkpoints.mkdir()
        torch.save({"step": 3}, workspace.checkpoints / "last.ckpt")
    with Workspace(tmp_path, "nao", "abc") as workspace:
        assert workspace.run_id == "run1" and workspace.last_checkpoint() is not None
        workspace.finish()
    with Workspace(tmp_path, "nao", "abc") as workspace:
        assert workspace.run_id is None and workspace.last_checkpoint() is None


def test_another_run_does_not_inherit_checkpoints(tmp_path: Path) -> None:
    with Workspace(tmp_path, "nao", "abc") as workspace:
        workspace.start("run1")
        workspace.checkpoints.mkdir()
        torch.save({}, workspace.checkpoints / "last.ckpt")
        workspace.start("run2")
        assert workspace.last_checkpoint() is None


@pytest.mark.parametrize("content", [b"", b"junk", b"PK\x03\x04 half a zip"])
def test_a_broken_checkpoint_is_passed_over(tmp_path: Path, content: bytes) -> None:
    with Workspace(tmp_path, "nao", "abc") as workspace:
        workspace.checkpoints.mkdir()
        (workspace.checkpoints / "last.ckpt").write_bytes(content)
        assert workspace.last_checkpoint() is None


def test_a_checkpoint_never_executes_code(tmp_path: Path) -> None:
    class Evil:
        def __reduce__(self) -> tuple:
            return (Path.touch, (tmp_path / "executed",))

    with Workspace(tmp_path, "nao", "abc") as workspace:
        workspace.checkpoints.mkdir()
        torch.save({"x": Evil()}, workspace.checkpoints / "last.ckpt")
        assert workspace.last_checkpoint() is None
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("content", ["", "[1]", "{", '{"run_id": 5}'])
def test_a_broken_state_is_no_state(tmp_path: Path, content: str) -> None:
    with Workspace(tmp_path, "nao", "abc") as workspace:
        (workspace.folder / "state.json").write_text(content)
        assert workspace.run_id is None


def test_two_processes_cannot_share_it(tmp_path: Path) -> None:
    with Workspace(tmp_path, "nao", "abc"):
        with pytest.raises(UserError, match="another process"), Workspace(tmp_path, "nao", "abc"):
            pass
        with Workspace(tmp_path, "nao", "def"):
            pass


def test_a_mark_is_noted_before_the_run_and_gives_way_to_it(tmp_path: Path) -> None:
    with Workspace(tmp_path, "nao", "abc") as workspace:
        assert workspace.attempt is None
        mark = workspace.new_attempt()
    with Workspace(tmp_path, "nao", "abc") as workspace:  # killed in between
        assert workspace.attempt == mark and workspace.run_id is None
        workspace.start("run1")
        assert workspace.attempt is None and workspace.run_id == "run1"


def test_a_mark_alone_removes_no_checkpoint(tmp_path: Path) -> None:
    """The new run may not come about."""
    with Workspace(tmp_path, "nao", "abc") as workspace:
        workspace.start("run1")
        workspace.checkpoints.mkdir()
        torch.save({}, workspace.checkpoints / "last.ckpt")
        workspace.new_attempt()
        assert workspace.last_checkpoint() is not None
