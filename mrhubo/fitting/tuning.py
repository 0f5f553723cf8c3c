"""The tuning of the universal network to one robot, on the robot's pairs: `model.start: universal`.

Legend: B batch, F = 3 D features, which are the human's directions, M robot links, N robot joints.
"""

from __future__ import annotations

from typing import Any

import lightning
import torch
from torch import Tensor

from mrhubo.config import TrainerConfig
from mrhubo.fitting.module import LOG_EVERY
from mrhubo.retargeter.universal import UniversalJoints
from mrhubo.runtime.trainer import stop_at, with_schedule
from mrhubo.universal.learning.loss import BETAS, loss


class TuningModule(lightning.LightningModule):
    """The universal network's own loss; a pair's joint angles are the best known answer."""

    def __init__(self, network: UniversalJoints, settings: TrainerConfig) -> None:
        super().__init__()
        self.network, self.settings = network, settings
        network.optimiser.network.requires_grad_(True)

    def losses(self, features_BF: Tensor, R_BM6: Tensor, q_BN: Tensor) -> dict[str, Tensor]:  # noqa: ARG002
        """`loss` of directions (B, F) and the joint angles that go with them (B, N); links tell it nothing more."""
        optimiser = self.network.optimiser
        problem = optimiser.branches.ask(features_BF.unflatten(1, (-1, 3)))
        return {"loss": loss(optimiser.network, problem, optimiser.branches.apart(q_BN))}

    def training_step(self, batch: tuple[Tensor, Tensor, Tensor], _: int) -> Tensor:
        """One optimiser step on features (B, F), R (B, M, 6), q (B, N)."""
        losses = self.losses(*batch)
        if (self.trainer.global_step + 1) % LOG_EVERY == 0:
            self.log_dict({f"train/{name}": value.detach() for name, value in losses.items()})
        return losses["loss"]

    def on_train_batch_end(self, *_: Any) -> None:
        """Stops at the last step, also within an epoch."""
        stop_at(self.settings.max_steps, self.trainer)

    def configure_optimizers(self) -> Any:
        """AdamW with warm-up and cosine decay over `max_steps`."""
        settings = self.settings
        parameters = self.network.optimiser.network.parameters()
        optimizer = torch.optim.AdamW(parameters, settings.lr, betas=BETAS, weight_decay=settings.weight_decay)
        return with_schedule(optimizer, settings.max_steps)
