"""What every training shares: the learning rate's schedule, Lightning's Trainer, quiet and interruptible."""

from __future__ import annotations

import logging
import math
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

if TYPE_CHECKING:
    import lightning  # two seconds, which a process that only makes pairs has no use for

_LIGHTNING_LOGGERS = ("lightning.pytorch", "lightning.fabric", "lightning.pytorch.utilities.rank_zero")


@contextmanager
def quiet_lightning() -> Iterator[None]:
    """Lightning's banners and hints about workers say nothing to our users."""
    levels = {name: logging.getLogger(name).level for name in _LIGHTNING_LOGGERS}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"lightning\..*")
        warnings.filterwarnings(
            "ignore", message=r".*(num_workers|Checkpoint directory|lr_scheduler|isinstance\(treespec).*"
        )
        try:
            for name in levels:
                logging.getLogger(name).setLevel(logging.ERROR)
            yield
        finally:
            for name, level in levels.items():
                logging.getLogger(name).setLevel(level)


def run_trainer(
    trainer: lightning.Trainer, module: lightning.LightningModule, resume: Path | None, *data: Any, **more: Any
) -> None:
    """Trains, from a checkpoint if there is one; data as `Trainer.fit` takes it.

    Raises:
        KeyboardInterrupt: the user stopped it. Lightning makes an exit of that, and keeps the signal's handler.
    """
    handler = signal.getsignal(signal.SIGINT)
    try:
        trainer.fit(module, *data, ckpt_path=resume, weights_only=True, **more)
    except SystemExit as stop:
        raise KeyboardInterrupt from stop
    finally:
        signal.signal(signal.SIGINT, handler)


def stop_at(step: int, trainer: lightning.Trainer) -> None:
    """Ends a training at its last step, also within an epoch; asked after each step."""
    if trainer.global_step >= step:
        trainer.should_stop = True


def with_schedule(optimizer: torch.optim.Optimizer, steps: int) -> dict[str, Any]:
    """An optimiser with `cosine_schedule`, as a LightningModule's `configure_optimizers` gives them."""
    schedule = cosine_schedule(optimizer, steps)
    return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}


def cosine_schedule(optimizer: torch.optim.Optimizer, steps: int) -> torch.optim.lr_scheduler.LambdaLR:
    """Learning-rate factor: linear warm-up over 2% of the steps, then cosine decay to 0 at the last."""
    warm_up = max(1, steps // 50)
    return torch.optim.lr_scheduler.LambdaLR(
        optimizer, lambda s: min((s + 1) / warm_up, 0.5 + 0.5 * math.cos(math.pi * min(1.0, s / steps)))
    )
