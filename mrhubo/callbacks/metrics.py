"""Joint and link errors of a network on the validation clips, and how near it is to the person, at the end of every
epoch.
"""

from __future__ import annotations

from collections.abc import Sequence

import lightning
import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.evaluation import Clip, mean_score, predict_clips, score_clip
from mrhubo.reference import angle_between
from mrhubo.retargeter import JointNetwork
from mrhubo.robot import BodyMap


class ClipMetrics(lightning.Callback):
    """Logs `val/joint_rad`, `val/link_cm` and `val/angle_deg`, means over the validation clips, at the end of every
    epoch. The last is the mean angle of limbs, hands and head to the person's, and needs no reference: where joints are
    slow, the reference lags behind what a network, which sees one frame, can be asked for.
    """

    def __init__(self, clips: Sequence[Clip], body_map: BodyMap, key_links: Sequence[str]) -> None:
        self.clips, self.body_map, self.key_links = list(clips), body_map, list(key_links)
        self._human = [body_map.human_directions(clip.motion.local_TJ33) for clip in clips]

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
        robot = self.body_map.robot
        mean = mean_score(
            [score_clip(clip, q_TN, robot, self.key_links) for clip, q_TN in zip(self.clips, predictions, strict=True)]
        )
        angles_deg = [self._angle_deg(*found) for found in zip(self._human, predictions, strict=True)]
        angle_deg = sum(angles_deg) / len(angles_deg)
        pl_module.log_dict({"val/joint_rad": mean.joint_rad, "val/link_cm": mean.link_cm, "val/angle_deg": angle_deg})

    def _angle_deg(self, human_TD3: Tensor, q_TN: Tensor) -> float:
        columns = self.body_map.measured
        robot_TD3 = self.body_map.robot_directions(self.body_map.robot.forward(q_TN))
        return float(torch.rad2deg(angle_between(robot_TD3[:, columns], human_TD3[:, columns])).mean())
