"""The training's progress line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import lightning
from torch import Tensor

from mrhubo.runtime.progress import SILENT, Progress, Reporter

_EVERY = 10


class TrainingProgress(lightning.Callback):
    """Steps, rate, time left and the last metrics on one line."""

    def __init__(self, steps: int, shown: Mapping[str, str], report: Reporter = SILENT) -> None:
        """`steps` is the length of the whole training, `shown` the metrics on the line and what they are called."""
        self.steps, self.shown, self.report = steps, shown, report
        self._progress: Progress | None = None

    def on_train_start(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Opens the line."""
        self._progress = self.report.step("training", self.steps, "steps")
        self._progress.update(trainer.global_step)

    def on_train_batch_end(
        self,
        trainer: lightning.Trainer,
        pl_module: lightning.LightningModule,
        outputs: Tensor | Mapping[str, Any] | None,
        batch: Any,
        batch_idx: int,
    ) -> None:
        """Redraws it every few steps."""
        if trainer.global_step % _EVERY == 0:
            self._update(trainer)

    def on_train_end(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Closes it."""
        self._close(trainer)

    def on_exception(
        self, trainer: lightning.Trainer, pl_module: lightning.LightningModule, exception: BaseException
    ) -> None:
        """Closes it where the training broke off."""
        self._close(trainer)

    def _close(self, trainer: lightning.Trainer) -> None:
        if self._progress is not None:
            self._update(trainer)
            self._progress.__exit__(None, None, None)
            self._progress = None

    def _update(self, trainer: lightning.Trainer) -> None:
        metrics = trainer.callback_metrics
        known = [f"{name} {float(metrics[key]):.3f}" for key, name in self.shown.items() if key in metrics]
        if self._progress is not None:
            self._progress.update(trainer.global_step, ", ".join(known))
