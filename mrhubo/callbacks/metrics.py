"""Joint and link errors of a network on clips: during validation, and for the final table.

Legend: T frames, J = 21 human joints, N robot joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeVar

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


Score = TypeVar("Score", bound=ClipScore)


def mean_score(scores: Sequence[Score], over_frames: bool = False) -> Score:
    """Means of every measure over clips, each counted once, or over all their frames."""
    names = [field.name for field in fields(scores[0])[2:]]
    frames = [score.frames for score in scores]
    share = torch.tensor(frames if over_frames else [1] * len(scores), dtype=torch.float64)
    table = torch.tensor([[getattr(score, name) for name in names] for score in scores], dtype=torch.float64)
    name = "mean over frames" if over_frames else "mean over clips"
    return type(scores[0])(name, sum(frames), *((share / share.sum()) @ table).tolist())


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


def score_clip(clip: Clip, q_TN: Tensor, robot: Robot, key_links: Sequence[str]) -> ClipScore:
    """Errors of predicted joint angles (T, N) [rad] against the reference."""
    joints = joint_error(q_TN, clip.reference_TN)
    links = link_error(robot, q_TN, clip.reference_TN, key_links)
    return ClipScore(clip.name, len(q_TN), float(joints.mean()), float(links.mean()))


class ClipMetrics(lightning.Callback):
    """Logs `val/joint_rad` and `val/link_cm`, means over the validation clips, at the end of every epoch."""

    def __init__(self, clips: Sequence[Clip], robot: Robot, key_links: Sequence[str]) -> None:
        self.clips, self.robot, self.key_links = list(clips), robot, list(key_links)

    def on_train_epoch_end(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Scores the network as it is now."""
        assert isinstance(pl_module, RetargetModule)
        predictions = predict_clips(pl_module.network, self.clips)
        mean = mean_score(
            [score_clip(c, q, self.robot, self.key_links) for c, q in zip(self.clips, predictions, strict=True)]
        )
        pl_module.log_dict({"val/joint_rad": mean.joint_rad, "val/link_cm": mean.link_cm})
