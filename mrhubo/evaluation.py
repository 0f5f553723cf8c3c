"""What a retargeter is worth on human motion: against the reference, against the human, and in time.

Legend: T frames, D directions, N joints.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from mrhubo.callbacks import Clip
from mrhubo.reference import at_limit_share, direction_error, direction_jerk, joint_error, link_error
from mrhubo.robot import BodyMap
from mrhubo.threads import use_threads

_ENDS = ("left_hand", "right_hand", "head")


@dataclass(frozen=True)
class Evaluation:
    """One clip, or a mean over clips or over frames. NaN: the robot has no such part, or the clip is too short."""

    name: str
    frames: int
    joint_rad: float
    """Mean absolute difference of joint angles to the reference, modulo 2 pi."""
    link_cm: float
    """Mean distance of the key links to the reference's."""
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


def evaluate_clip(clip: Clip, q_TN: Tensor, body_map: BodyMap, key_links: Sequence[str]) -> Evaluation:
    """Measures of predicted joint angles (T, N) [rad]."""
    robot, pose_TJ6 = body_map.robot, clip.motion.pose_TJ6
    error_TD, reference_TD = (direction_error(body_map, q, pose_TJ6) for q in (q_TN, clip.reference_TN))
    names = body_map.direction_names
    part = {name: next((end for end in _ENDS if name.startswith(f"{end}_")), "limb") for name in names}

    def mean(angles_TD: Tensor, *parts: str) -> float:
        columns = [i for i, name in enumerate(names) if part[name] in parts]
        return float(angles_TD[:, columns].mean())  # NaN where there are none

    directions = (body_map.robot_directions(robot.forward(q_TN)), body_map.human_directions(pose_TJ6))
    jerk, human_jerk = (float(direction_jerk(d, clip.motion.frame_rate).mean()) for d in directions)
    return Evaluation(
        clip.name,
        len(q_TN),
        float(joint_error(q_TN, clip.reference_TN).mean()),
        float(link_error(robot, q_TN, clip.reference_TN, key_links).mean()),
        mean(error_TD, "limb"),
        mean(reference_TD, "limb"),
        mean(error_TD, "left_hand", "right_hand"),
        mean(error_TD, "head"),
        jerk / human_jerk if human_jerk else float("nan"),
        float(at_limit_share(robot, q_TN).mean()),
    )


def means(evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """The mean over clips, each counted once, and the mean over frames."""
    frames = torch.tensor([e.frames for e in evaluations], dtype=torch.float64)
    names = [field.name for field in fields(Evaluation)[2:]]
    table = torch.tensor([[getattr(e, name) for name in names] for e in evaluations], dtype=torch.float64)
    total = int(frames.sum())
    return [
        Evaluation("mean over clips", total, *table.mean(0).tolist()),
        Evaluation("mean over frames", total, *((frames / total) @ table).tolist()),
    ]


def table(evaluations: Sequence[Evaluation]) -> str:
    """All measures, a row each; parts that the robot does not have are left out."""
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
    }
    shown = {n: h for n, h in heads.items() if any(getattr(e, n) == getattr(e, n) for e in evaluations)}
    rows = [["clip", *(head for head, _ in shown.values())]]
    rows += [[e.name, *(form.format(getattr(e, name)) for name, (_, form) in shown.items())] for e in evaluations]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows]
    lines.insert(len(lines) - 2, "-" * len(lines[0]))
    return "\n".join(lines)


def latency_us(predict: Callable[[Tensor], Tensor], pose_TJ6: Tensor, batch: int, seconds: float = 1.0) -> float:
    """Median time a frame [us] of `batch` frames at once, one thread, over calls that take `seconds` together."""
    frames = pose_TJ6.repeat(-(-batch // len(pose_TJ6)), 1, 1)[:batch]
    found = []
    with use_threads(1):
        predict(frames)
        end = time.perf_counter() + seconds
        while not found or time.perf_counter() < end:
            start = time.perf_counter()
            predict(frames)
            found.append(time.perf_counter() - start)
    return 1e6 * sorted(found)[len(found) // 2] / batch
