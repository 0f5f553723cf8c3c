"""Lightning's Trainer, quiet and interruptible."""

from __future__ import annotations

import logging
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lightning

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
