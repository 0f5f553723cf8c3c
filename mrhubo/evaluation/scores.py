"""What a retargeter is worth on human motion: against the reference, and against the human.

Legend: T frames, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import torch
from torch import Tensor

from mrhubo.evaluation.clips import Clip
from mrhubo.reference import angle_between, at_limit_share, direction_jerk, joint_error, link_error
from mrhubo.retargeter import RetargetNetwork
from mrhubo.robot import BodyMap, LinkPoses, Robot
from mrhubo.robot.parts import Region
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
    frames = torch.cat([matrix_to_sixd(clip.motion.local_TJ33) for clip in clips]).to(device)
    joints = torch.cat([network(part) for part in frames.split(16_384)]).cpu()
    network.train(training)
    return list(joints.split([len(clip.motion) for clip in clips]))


def score_clip(clip: Clip, q_TN: Tensor, robot: Robot, key_links: Sequence[str]) -> ClipScore:
    """Errors of predicted joint angles (T, N) [rad] against the reference."""
    joints = joint_error(q_TN, clip.reference_TN)
    links = link_error(robot, q_TN, clip.reference_TN, key_links)
    return ClipScore(clip.name, len(q_TN), float(joints.mean()), float(links.mean()))


@dataclass(frozen=True)
class Evaluation(ClipScore):
    """One clip, or a mean over clips or over frames. NaN: the robot has no such part, or the clip is too short."""

    limb_deg: float
    """Mean angle between the robot's and the human's upper arms and forearms, seen from the chest."""
    reference_limb_deg: float
    """The same for the reference: what the robot's build allows."""
    hand_deg: float
    """The same for fingers and thumbs."""
    head_deg: float
    """The same for the head's forward and up."""
    jerk_ratio: float
    """Jerk of the robot's directions over that of the human's."""
    at_limit: float
    """Share of joint angles at a limit."""
    collision: float
    """Share of frames in which the robot's collision shapes overlap."""
    reference_collision: float
    """The same for the reference, which is not told to avoid it."""


def evaluate_clip(clip: Clip, q_TN: Tensor, body_map: BodyMap, key_links: Sequence[str]) -> Evaluation:
    """Measures of predicted joint angles (T, N) [rad]."""
    robot, shapes, human_TD3 = body_map.robot, body_map.collision, body_map.human_directions(clip.motion.local_TJ33)
    poses, reference_poses = (robot.forward(q) for q in (q_TN, clip.reference_TN))
    robot_TD3, reference_TD3 = (body_map.robot_directions(p) for p in (poses, reference_poses))
    error_TD, reference_TD = (torch.rad2deg(angle_between(d, human_TD3)) for d in (robot_TD3, reference_TD3))

    def mean(angles_TD: Tensor, region: Region) -> float:
        columns = [i for i, direction in enumerate(body_map.directions) if direction.part.region == region]
        return float(angles_TD[:, columns].mean())  # NaN where there are none

    def collision_share(q_TN: Tensor, poses: LinkPoses) -> float:
        return float(shapes.collides(q_TN, poses).float().mean()) if shapes.pairs else float("nan")

    jerk, human_jerk = (
        float(direction_jerk(d[:, body_map.measured], clip.motion.frame_rate).mean()) for d in (robot_TD3, human_TD3)
    )
    return Evaluation(
        **vars(score_clip(clip, q_TN, robot, key_links)),
        limb_deg=mean(error_TD, "arm"),
        reference_limb_deg=mean(reference_TD, "arm"),
        hand_deg=mean(error_TD, "hand"),
        head_deg=mean(error_TD, "head"),
        jerk_ratio=jerk / human_jerk if human_jerk else float("nan"),
        at_limit=float(at_limit_share(robot, q_TN).mean()),
        collision=collision_share(q_TN, poses),
        reference_collision=collision_share(clip.reference_TN, reference_poses),
    )


def evaluate_clips(
    predictions: Sequence[Tensor], clips: Sequence[Clip], body_map: BodyMap, key_links: Sequence[str]
) -> list[Evaluation]:
    """Measures clip by clip, then their means over clips and over frames."""
    found = [evaluate_clip(c, q_TN, body_map, key_links) for c, q_TN in zip(clips, predictions, strict=True)]
    return [*found, mean_score(found), mean_score(found, over_frames=True)]


def measures(evaluation: Evaluation) -> dict[str, float]:
    """The measures by name; those that the robot does not have are left out."""
    found = {field.name: getattr(evaluation, field.name) for field in fields(Evaluation)[2:]}
    return {name: value for name, value in found.items() if value == value}


def run_metrics(evaluations: Sequence[Evaluation], latency: Mapping[str, float]) -> dict[str, float]:
    """What `evaluate_clips` and `latencies` gave for the test clips, under the names that a run has for it."""
    *clips, _, over_frames = evaluations
    found = mean_metrics(evaluations, latency, "test")
    for name, score in [*((clip.name, clip) for clip in clips), ("over_frames", over_frames)]:
        found |= {f"test/{name}/joint_rad": score.joint_rad, f"test/{name}/link_cm": score.link_cm}
    return found


def mean_metrics(evaluations: Sequence[Evaluation], latency: Mapping[str, float], prefix: str) -> dict[str, float]:
    """The means over clips, and the latency, alone."""
    return {f"{prefix}/{name}": value for name, value in {**measures(evaluations[-2]), **latency}.items()}


def table(evaluations: Sequence[Evaluation], retarget: Sequence[Evaluation] = ()) -> str:
    """What `evaluate_clips` gave, a row each; parts that the robot does not have are left out.

    Args:
        evaluations: of the networks alone.
        retarget: of `Retargeter.retarget`, which makes a step of optimisation after them; the means are shown.
    """
    means = len(evaluations) - 2
    more = [replace(e, name=f"{e.name}, retarget") for e in retarget[-2:]]
    evaluations = [*evaluations, *more]
    heads = {
        "frames": ("frames", "{:,}"),
        "joint_rad": ("joint [rad]", "{:.3f}"),
        "link_cm": ("link [cm]", "{:.2f}"),
        "limb_deg": ("limbs [deg]", "{:.1f}"),
        "reference_limb_deg": ("reference's", "{:.1f}"),
        "hand_deg": ("hands [deg]", "{:.1f}"),
        "head_deg": ("head [deg]", "{:.1f}"),
        "jerk_ratio": ("jerk ratio", "{:.2f}"),
        "at_limit": ("at a limit", "{:.1%}"),
        "collision": ("collision", "{:.1%}"),
        "reference_collision": ("reference's ", "{:.1%}"),
    }
    shown = {n: h for n, h in heads.items() if any(getattr(e, n) == getattr(e, n) for e in evaluations)}
    rows = [["clip", *(head for head, _ in shown.values())]]
    rows += [[e.name, *(form.format(getattr(e, name)) for name, (_, form) in shown.items())] for e in evaluations]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows]
    lines.insert(1 + means, "-" * len(lines[0]))
    return "\n".join(lines)
