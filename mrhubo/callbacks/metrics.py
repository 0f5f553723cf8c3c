"""Joint and link errors of a network on the validation clips, at the end of every epoch."""

from __future__ import annotations

from collections.abc import Sequence

import lightning
import torch

from mrhubo.errors import UserError
from mrhubo.evaluation import Clip, mean_score, predict_clips, score_clip
from mrhubo.retargeter import JointNetwork
from mrhubo.robot import Robot


class ClipMetrics(lightning.Callback):
    """Logs `val/joint_rad` and `val/link_cm`, means over the validation clips, at the end of every epoch."""

    def __init__(self, clips: Sequence[Clip], robot: Robot, key_links: Sequence[str]) -> None:
        self.clips, self.robot, self.key_links = list(clips), robot, list(key_links)

    def on_train_epoch_end(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Scores the network as it is now.

        Raises:
            UserError: its weights are no numbers (its answers always are); the checkpoints are those of before.
        """
        network = pl_module.network
        assert isinstance(network, JointNetwork)
        if not all(bool(torch.isfinite(weights).all()) for weights in network.parameters()):
            raise UserError(f"the training came to NaN by step {trainer.global_step:,}; a lower trainer.lr helps")
        predictions = predict_clips(network, self.clips)
        mean = mean_score(
            [score_clip(c, q, self.robot, self.key_links) for c, q in zip(self.clips, predictions, strict=True)]
        )
        pl_module.log_dict({"val/joint_rad": mean.joint_rad, "val/link_cm": mean.link_cm})
