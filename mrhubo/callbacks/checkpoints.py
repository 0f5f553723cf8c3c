"""Checkpoints of a training: the last and the best, at every validation, each whole, with a checksum beside it.

Lightning's `ModelCheckpoint` writes its last one only where it writes a best one, and none of them at once: a training
that was killed long after its best validation would go back to that.
"""

from __future__ import annotations

import copy
import io
import math
from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import Checkpoint
from lightning.pytorch.plugins.io import TorchCheckpointIO

from mrhubo.errors import UserError
from mrhubo.files.regular import check_regular
from mrhubo.files.storage import checked_path, matches_checksum

LAST, BEST = "last.ckpt", "best.ckpt"
"""Names of the files."""


class CheckedFiles(TorchCheckpointIO):
    """How Lightning writes checkpoints: aside, then renamed, with a checksum."""

    def save_checkpoint(self, checkpoint: dict[str, Any], path: Any, storage_options: Any = None) -> None:
        """Writes one.

        Raises:
            UserError: the disk refuses it.
        """
        content = io.BytesIO()
        torch.save(checkpoint, content)
        with checked_path(Path(path)) as temporary:
            temporary.write_bytes(content.getbuffer())

    def load_checkpoint(self, path: Any, map_location: Any = None, weights_only: bool | None = None) -> dict[str, Any]:
        """Reads one, whatever its folder is called; nothing in it is executed."""
        return torch.load(Path(path), map_location=map_location, weights_only=True)


class Checkpoints(Checkpoint):
    """Writes `last.ckpt` at the end of every epoch, and `best.ckpt` where a metric is the least so far.

    The trainer needs the plugin `CheckedFiles`.
    """

    def __init__(self, folder: Path, monitor: str, beside: str | None = None) -> None:
        """`monitor` is the name of the metric, `beside` that of another to be told of the best checkpoint."""
        self.folder, self.monitor, self.beside = folder, monitor, beside or monitor
        self.best_score: float | None = None
        """The least value of the metric, NaN counting as infinite."""
        self.best_beside: float | None = None
        """The other metric's value there."""

    def on_train_epoch_end(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Writes them; the best first, so that the last one knows no best that is not there."""
        # The first process's, for all of several that train together.
        score = float(trainer.strategy.broadcast(float(trainer.callback_metrics[self.monitor])))
        score = math.inf if math.isnan(score) else score
        if self.best_score is None or score < self.best_score:
            self.best_score, self.best_beside = score, float(trainer.callback_metrics[self.beside])
            trainer.save_checkpoint(self.folder / BEST)
        trainer.save_checkpoint(self.folder / LAST)

    def state_dict(self) -> dict[str, Any]:
        """What a checkpoint keeps of it."""
        return {"best_score": self.best_score, "best_beside": self.best_beside}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Goes on from that."""
        self.best_score, self.best_beside = state_dict["best_score"], state_dict["best_beside"]


def resumable(folder: Path, module: lightning.LightningModule) -> tuple[Path | None, list[str]]:
    """The checkpoint that a training can go on from: the last, or, where that does not do, the best.

    Args:
        folder: where they are.
        module: what is to be trained; stays as it is.

    Returns:
        its path, None if there is none; and of each that is there and does not do a sentence that says why.
    """
    faults = {name: _fault(folder / name, module) for name in (BEST, LAST)}
    said = [f"{folder / name} is passed over: {faults[name]}" for name in (LAST, BEST) if faults[name]]
    if faults[BEST] is None and (folder / BEST).exists():
        found = LAST if faults[LAST] is None and (folder / LAST).exists() else BEST
        return folder / found, said
    if faults[LAST] is None and (folder / LAST).exists():
        said.append(f"{folder / LAST} is passed over: the best one so far, {BEST}, is not whole")
    return None, said


def _fault(path: Path, module: lightning.LightningModule) -> str | None:
    """Why a training cannot go on from a checkpoint; None if it can, or if there is no file."""
    if not path.is_symlink() and not path.exists():
        return None
    try:
        check_regular(path)
        if matches_checksum(path) is False:
            return "it is damaged, as its checksum is another"
        content = torch.load(path, map_location="cpu", weights_only=True)
    except UserError as error:
        return str(error).removeprefix(f"{path}: ")
    except Exception:  # whatever torch makes of a stranger's bytes
        return "it cannot be read"
    try:
        return _misfit(content, module)
    except Exception:  # keys that are missing, values of other types or shapes
        return "it is of another version, or of a network of another layout"


def _misfit(content: dict[str, Any], module: lightning.LightningModule) -> str | None:
    """Tries everything on a copy that a resume will do."""
    version, own = (str(text).split(".")[:2] for text in (content["pytorch-lightning_version"], lightning.__version__))
    if version != own:
        return f"it was written by Lightning {'.'.join(version)}, and {'.'.join(own)} is installed"
    twin = copy.deepcopy(module)
    twin.load_state_dict(content["state_dict"])
    configured: Any = twin.configure_optimizers()
    optimizer, scheduler = configured["optimizer"], configured["lr_scheduler"]["scheduler"]
    optimizer.load_state_dict(content["optimizer_states"][0])
    for weights, state in optimizer.state.items():
        if any(torch.is_tensor(value) and value.ndim and value.shape != weights.shape for value in state.values()):
            raise ValueError("an optimiser's state of another shape")
    scheduler.load_state_dict(content["lr_schedulers"][0])
    counts = content["epoch"], content["global_step"], content["loops"]["fit_loop"]["epoch_progress"]["total"]["ready"]
    saver = content["callbacks"][Checkpoints.__qualname__]
    scored = isinstance(saver["best_score"], float) and isinstance(saver["best_beside"], float)
    if not all(isinstance(count, int) and count >= 0 for count in counts) or not scored:
        raise ValueError("no counts of steps")
    return None
