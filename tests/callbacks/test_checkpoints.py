"""Checkpoints are whole, a stopped training goes on from its last, and one that does not fit is passed over."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import lightning
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from torch import Tensor

from mrhubo.callbacks import BEST, LAST, CheckedFiles, Checkpoints, resumable
from mrhubo.errors import UserError
from mrhubo.runtime.trainer import cosine_schedule, quiet_lightning


class Line(lightning.LightningModule):
    """One weight, and a metric that is the least after the first epoch."""

    def __init__(self, width: int = 1) -> None:
        super().__init__()
        self.line = torch.nn.Linear(1, width)

    def training_step(self, batch: Tensor, _: int) -> Tensor:
        return self.line(batch).square().mean()

    def on_train_epoch_end(self) -> None:
        self.log_dict({"val/error": 1.0 + self.current_epoch, "val/other": 7.0 - self.current_epoch})

    def configure_optimizers(self) -> Any:
        optimizer = torch.optim.AdamW(self.parameters())
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": cosine_schedule(optimizer, 12)}}


def trained(folder: Path, epochs: int, start: Path | None = None) -> tuple[lightning.Trainer, Checkpoints, Line]:
    """Three steps an epoch."""
    torch.manual_seed(0)
    module, saver = Line(), Checkpoints(folder, "val/error", beside="val/other")
    with quiet_lightning():
        trainer = lightning.Trainer(
            max_epochs=epochs, accelerator="cpu", logger=False, enable_progress_bar=False, enable_model_summary=False,
            callbacks=[saver], plugins=[CheckedFiles()],
        )  # fmt: skip
        trainer.fit(module, torch.utils.data.DataLoader(torch.ones(3, 1)), ckpt_path=start, weights_only=True)
    return trainer, saver, module


@pytest.fixture(scope="module")
def past_its_best(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Checkpoints of a training that was stopped in its third epoch, two epochs after its best."""
    folder = tmp_path_factory.mktemp("checkpoints")
    trained(folder, 3)
    return folder


@pytest.fixture
def folder(past_its_best: Path, tmp_path: Path) -> Path:
    for file in past_its_best.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def step(path: Path) -> int:
    return torch.load(path, weights_only=True)["global_step"]


def test_past_its_best_it_goes_on_from_its_last(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    assert (step(folder / BEST), step(folder / LAST)) == (3, 9)
    found, said = resumable(folder, Line())
    assert found == folder / LAST and said == []
    trainer, saver, module = trained(folder, 4, found)
    assert trainer.global_step == 12 and (saver.best_score, saver.best_beside) == (1.0, 7.0)
    assert (step(folder / BEST), step(folder / LAST)) == (3, 12)
    _, _, whole = trained(tmp_path_factory.mktemp("whole"), 4)
    assert torch.equal(module.line.weight, whole.line.weight)


def test_nothing_is_left_over_but_the_checkpoints(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == {BEST, LAST, f"{BEST}.xxh3", f"{LAST}.xxh3"}
    empty = folder / "none"
    assert resumable(empty, Line()) == (None, [])


def rewrite(path: Path, change: Any) -> None:
    content = torch.load(path, weights_only=True)
    change(content)
    torch.save(content, path)
    path.with_name(f"{path.name}.xxh3").unlink(missing_ok=True)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda c: c["state_dict"].update({"line.weight": torch.zeros(5, 1)}), "network of another layout"),
        (lambda c: c["state_dict"].pop("line.bias"), "network of another layout"),
        (lambda c: c["optimizer_states"][0]["state"][0].update(exp_avg=torch.zeros(5, 1)), "another layout"),
        (lambda c: c["optimizer_states"].clear(), "of another version"),
        (lambda c: c.pop("lr_schedulers"), "of another version"),
        (lambda c: c.pop("loops"), "of another version"),
        (lambda c: c.update(callbacks={"ModelCheckpoint": {}}), "of another version"),
        (lambda c: c.update(global_step="many"), "of another version"),
        (lambda c: c["callbacks"]["Checkpoints"].pop("best_beside"), "of another version"),
        (lambda c: c.update({"pytorch-lightning_version": "1.9.5"}), "was written by Lightning 1.9, and 2"),
    ],
)
def test_one_that_does_not_fit_is_passed_over(folder: Path, change: Any, why: str) -> None:
    rewrite(folder / LAST, change)
    found, said = resumable(folder, Line())
    assert found == folder / BEST
    assert len(said) == 1 and said[0].startswith(f"{folder / LAST} is passed over: ") and why in said[0]
    rewrite(folder / BEST, change)
    assert resumable(folder, Line())[0] is None


def test_a_last_one_without_its_best_is_of_no_use(folder: Path) -> None:
    (folder / BEST).write_bytes(b"junk")
    found, said = resumable(folder, Line())
    assert found is None and "is damaged" in said[0] and "best.ckpt, is not whole" in said[1]


@settings(max_examples=15, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_is_noticed(folder: Path, past_its_best: Path, data: st.DataObject) -> None:
    content = bytearray((past_its_best / LAST).read_bytes())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        content[data.draw(st.integers(0, len(content) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    (folder / LAST).write_bytes(content)
    found, said = resumable(folder, Line())
    assert found == folder / BEST and "is damaged" in said[0]


def test_no_pipe_and_no_folder_is_waited_for(folder: Path) -> None:
    (folder / LAST).unlink()
    os.mkfifo(folder / LAST)
    assert "is a pipe" in resumable(folder, Line())[1][0]
    (folder / LAST).unlink()
    (folder / LAST).mkdir()
    assert "is a folder" in resumable(folder, Line())[1][0]


def test_a_process_that_ends_between_the_two_files_leaves_a_good_pair(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, replace = (folder / LAST).read_bytes(), os.replace

    def stops(source: Path, target: Path) -> None:
        if Path(target).name == LAST:
            raise KeyboardInterrupt
        replace(source, target)

    monkeypatch.setattr(os, "replace", stops)
    with pytest.raises(KeyboardInterrupt):
        CheckedFiles().save_checkpoint({"new": 1}, folder / LAST)
    monkeypatch.undo()
    assert (folder / LAST).read_bytes() == before
    assert resumable(folder, Line()) == (folder / LAST, [])


def test_a_full_disk_is_one_sentence(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(UserError, match=r"last.ckpt: cannot be written: No space left"):
        CheckedFiles().save_checkpoint({}, folder / LAST)
