"""How far a retargeter is from the reference on human motion: what a training looks at.

Legend: T frames, N joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeVar

import torch
from torch import Tensor

from mrhubo.evaluation.clips import Clip
from mrhubo.reference import joint_error, link_error
from mrhubo.retargeter import JointNetwork
from mrhubo.robot import LinkPoses, Robot
from mrhubo.rotation import matrix_to_sixd


@dataclass(frozen=True)
class ClipScore:
    """Errors of one clip, means over its frames."""

    name: str
    frames: int
    joint_rad: float
    """Mean absolute joint difference, modulo 2 pi."""
    link_cm: float
    """Mean Euclidean distance of the key links."""


BY_JOINT = "by joint"
"""In the metadata of a field that holds (joint, value) pairs in place of a number."""


def number_fields(kind: type[ClipScore]) -> list[str]:
    """Names of the measures that are one number."""
    return [field.name for field in fields(kind)[2:] if BY_JOINT not in field.metadata]


Score = TypeVar("Score", bound=ClipScore)


def mean_score(scores: Sequence[Score], over_frames: bool = False) -> Score:
    """Means of every measure over clips, each counted once, or over all their frames."""
    names = number_fields(type(scores[0]))
    frames = [score.frames for score in scores]
    share = torch.tensor(frames if over_frames else [1] * len(scores), dtype=torch.float64)
    table = torch.tensor([[getattr(score, name) for name in names] for score in scores], dtype=torch.float64)
    name = "mean over frames" if over_frames else "mean over clips"
    means = dict(zip(names, ((share / share.sum()) @ table).tolist(), strict=True))
    for column in (field.name for field in fields(scores[0]) if BY_JOINT in field.metadata):
        rows = [dict(getattr(score, column)) for score in scores]
        by_joint = torch.tensor([list(row.values()) for row in rows], dtype=torch.float64)
        means[column] = tuple(zip(rows[0], ((share / share.sum()) @ by_joint).tolist(), strict=True))
    return type(scores[0])(name, sum(frames), **means)


@torch.no_grad()
def predict_clips(network: JointNetwork, clips: Sequence[Clip]) -> list[Tensor]:
    """Joint angles (T, N) on the CPU for each clip, in one forward pass over all frames."""
    device = network.limited.lower_N.device
    training = network.training
    network.eval()
    frames = torch.cat([matrix_to_sixd(clip.motion.local_TJ33) for clip in clips]).to(device)
    joints = torch.cat([network(part) for part in frames.split(16_384)]).cpu()
    network.train(training)
    return list(joints.split([len(clip.motion) for clip in clips]))


def score_clip(
    clip: Clip, q_TN: Tensor, robot: Robot, key_links: Sequence[str], poses: Sequence[LinkPoses] = ()
) -> ClipScore:
    """Errors of predicted joint angles (T, N) [rad] against the reference; `poses` as for `link_error`."""
    joints = joint_error(q_TN, clip.reference_TN)
    links = link_error(robot, q_TN, clip.reference_TN, key_links, poses)
    return ClipScore(clip.name, len(q_TN), float(joints.mean()), float(links.mean()))
