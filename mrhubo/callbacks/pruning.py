"""Trials of a sweep that do badly end early."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import lightning

if TYPE_CHECKING:
    from optuna import Trial


class Pruning(lightning.Callback):
    """Reports the validation link error of every validation to an Optuna trial, and stops where its pruner says so.

    Stands after `ClipMetrics` in the list of callbacks, which measures it.
    """

    def __init__(self, trial: Trial, seen: Callable[[int, float], None] = lambda step, link_cm: None) -> None:
        """`seen` is called with (optimiser steps, link error [cm])."""
        self.trial, self.seen = trial, seen
        self.pruned = False
        """Whether the trial was stopped."""

    def on_train_epoch_end(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Reports, and perhaps stops."""
        link_cm = float(trainer.callback_metrics["val/link_cm"])
        self.trial.report(link_cm, trainer.current_epoch + 1)
        self.seen(trainer.global_step, link_cm)
        if self.trial.should_prune():
            self.pruned = trainer.should_stop = True
