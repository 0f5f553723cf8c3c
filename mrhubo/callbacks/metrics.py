"""Joint and link errors of a network on the validation clips, and how near it is to the person, at the end of every
epoch.
"""

from __future__ import annotations

from collections.abc import Sequence

import lightning
import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.evaluation import Clip, ClipScore, mean_score, predict_clips, score_clip
from mrhubo.reference import angle_between
from mrhubo.retargeter import JointNetwork
from mrhubo.robot import BodyMap, LinkPoses


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
        robot, scores, angles_deg = self.body_map.robot, list[ClipScore](), list[float]()
        for clip, human_TD3, q_TN in zip(self.clips, self._human, predict_clips(network, self.clips), strict=True):
            poses = robot.forward(q_TN)
            scores.append(score_clip(clip, q_TN, robot, self.key_links, (poses, robot.forward(clip.reference_TN))))
            angles_deg.append(self._angle_deg(human_TD3, poses))
        mean, angle_deg = mean_score(scores), sum(angles_deg) / len(angles_deg)
        pl_module.log_dict({"val/joint_rad": mean.joint_rad, "val/link_cm": mean.link_cm, "val/angle_deg": angle_deg})

    def _angle_deg(self, human_TD3: Tensor, poses: LinkPoses) -> float:
        columns, robot_TD3 = self.body_map.measured, self.body_map.robot_directions(poses)
        return float(torch.rad2deg(angle_between(robot_TD3[:, columns], human_TD3[:, columns])).mean())
