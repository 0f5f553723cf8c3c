"""Joint and link errors of a network on clips: during validation, and for the final table.

Legend: T frames, J = 21 human joints, N robot joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import lightning
import torch
from torch import Tensor

from mrhubo.callbacks.clips import Clip
from mrhubo.reference import joint_error, link_error
from mrhubo.retargeter import RetargetModule, RetargetNetwork
from mrhubo.robot import Robot


@dataclass(frozen=True)
class ClipScore:
    """Errors of one clip, means over its frames."""

    name: str
    frames: int
    joint_rad: float
    """Mean absolute joint difference, modulo 2 pi."""
    link_cm: float
    """Mean Euclidean distance of the key links."""


def mean_score(scores: Sequence[ClipScore]) -> ClipScore:
    """Means over clips, each clip counted once."""
    count = len(scores)
    return ClipScore(
        "mean",
        sum(s.frames for s in scores),
        sum(s.joint_rad for s in scores) / count,
        sum(s.link_cm for s in scores) / count,
    )


@torch.no_grad()
def predict_clips(network: RetargetNetwork, clips: Sequence[Clip]) -> list[Tensor]:
    """Joint angles (T, N) on the CPU for each clip, in one forward pass over all frames."""
    device = network.limited.lower_N.device
    training = network.training
    network.eval()
    frames = torch.cat([clip.motion.pose_TJ6 for clip in clips]).to(device)
    joints = torch.cat([network(part) for part in frames.split(16_384)]).cpu()
    network.train(training)
    return list(joints.split([len(clip.motion.pose_TJ6) for clip in clips]))


def score_clips(
    predictions: Sequence[Tensor], clips: Sequence[Clip], robot: Robot, key_links: Sequence[str]
) -> list[ClipScore]:
    """Errors of predicted joint angles against the reference, clip by clip."""
    scores = []
    for q_TN, clip in zip(predictions, clips, strict=True):
        joints = joint_error(q_TN, clip.reference_TN)
        links = link_error(robot, q_TN, clip.reference_TN, key_links)
        scores.append(ClipScore(clip.name, len(q_TN), float(joints.mean()), float(links.mean())))
    return scores


class ClipMetrics(lightning.Callback):
    """Logs `val/joint_rad` and `val/link_cm`, means over the validation clips, at the end of every epoch."""

    def __init__(self, clips: Sequence[Clip], robot: Robot, key_links: Sequence[str]) -> None:
        self.clips, self.robot, self.key_links = list(clips), robot, list(key_links)

    def on_train_epoch_end(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Scores the network as it is now."""
        assert isinstance(pl_module, RetargetModule)
        scores = score_clips(predict_clips(pl_module.network, self.clips), self.clips, self.robot, self.key_links)
        mean = mean_score(scores)
        pl_module.log_dict({"val/joint_rad": mean.joint_rad, "val/link_cm": mean.link_cm})
