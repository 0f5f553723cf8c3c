"""The training of the networks: teacher-student loss, optimiser.

    L_pre  = d(R, R^)
    L_post = d(q, post(R)) + d(q, post(R^))              teacher (true R) + student (predicted R^)
    L      = L_pre + L_post                              MR.HuBo (IROS 2024), section III-C

d is the mean square in the paper. Ours is the mean absolute difference: where several joint angles fit a pose (the
twist of a straight arm) it learns the usual one, not a mean that fits none.

Legend: B batch, F input features, M robot links, N robot joints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import lightning
import torch
from torch import Tensor
from torch.nn.functional import l1_loss, mse_loss

from mrhubo.config import TrainerConfig
from mrhubo.fitting.muon import Muon
from mrhubo.retargeter.networks import Piece, RetargetNetwork
from mrhubo.runtime.trainer import stop_at, with_schedule

if TYPE_CHECKING:
    from mrhubo.fitting.branch_threads import BranchThreads

LOG_EVERY = 50
"""Steps between two entries of the losses; MLflow takes about 20 ms for each."""


class RetargetModule(lightning.LightningModule):
    """Loss and optimiser around a `RetargetNetwork`."""

    def __init__(self, network: RetargetNetwork, settings: TrainerConfig, detach_student: bool = False) -> None:
        super().__init__()
        self.network, self.settings, self.detach_student = network, settings, detach_student
        self._distance = {"l1": l1_loss, "mse": mse_loss}[settings.loss]
        self.branch_threads: BranchThreads | None = None
        """What trains the branches side by side; None: all in one."""

    def losses(self, features_BF: Tensor, R_BM6: Tensor, q_BN: Tensor, piece: Piece | None = None) -> dict[str, Tensor]:
        """`loss`, and for two stages `loss_pre` (of 6D numbers) and `loss_post` (of rad), squared with `mse`; of the
        whole network, or of a piece and its columns.
        """
        network, distance = piece or self.network, self._distance

        def joint_loss(given: Tensor, wanted: Tensor) -> Tensor:
            return distance(network.limited.unlimited(network.post(given).float()), wanted)

        if network.pre is None:
            return {"loss": joint_loss(features_BF, q_BN)}
        links = R_BM6.flatten(1)
        predicted = network.pre(features_BF).float()
        pre = distance(predicted, links)
        student = predicted.detach() if self.detach_student else predicted
        # Teacher and student in one pass; the mean over both is half of their sum.
        post = 2 * joint_loss(torch.cat((links, student)), torch.cat((q_BN, q_BN)))
        return {"loss": pre + post, "loss_pre": pre, "loss_post": post}

    def training_step(self, batch: tuple[Tensor, Tensor, Tensor], _: int) -> Tensor:
        """One optimiser step on features (B, F), R (B, M, 6), q (B, N)."""
        losses = (self.branch_threads or self).losses(*batch)
        # Only when it is written anyway: each call costs milliseconds.
        if (self.trainer.global_step + 1) % LOG_EVERY == 0:
            self.log_dict({f"train/{name}": value.detach() for name, value in losses.items()})
        return losses["loss"]

    def on_train_start(self) -> None:
        """Leaves the cores to the threads of the branches."""
        if self.branch_threads is not None:
            torch.set_num_threads(1)

    def optimizer_zero_grad(self, *args: Any, **kwargs: Any) -> None:
        """Of the last step; the threads of the branches have done that, and have the new gradients already."""
        if self.branch_threads is None:
            super().optimizer_zero_grad(*args, **kwargs)

    def backward(self, loss: Tensor, *args: Any, **kwargs: Any) -> None:
        """The gradient of what `training_step` gave."""
        if self.branch_threads is None:
            super().backward(loss, *args, **kwargs)

    def on_train_batch_end(self, *_: Any) -> None:
        """Stops at the last step, also within an epoch."""
        stop_at(self.settings.max_steps, self.trainer)

    def configure_optimizers(self) -> Any:
        """Muon or AdamW, with warm-up and cosine decay over `max_steps`."""
        settings, network = self.settings, self.network
        hidden = network.hidden_weights() if settings.optimizer == "muon" else []
        pool = None if self.branch_threads is None else self.branch_threads.pool
        rates = settings.lr, settings.muon_lr, settings.weight_decay
        return with_schedule(Muon(network.parameters(), hidden, *rates, pool), settings.max_steps)
