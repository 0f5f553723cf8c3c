"""Measures as tables, for a person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mrhubo.evaluation.measures import Evaluation
from mrhubo.runtime.tables import aligned

_HEADS = {
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
_MOTION_HEADS = {
    "joint_rad": ("joint [rad]", "{:.3f}"),
    "link_cm": ("link [cm]", "{:.2f}"),
    "limb_deg": ("limbs [deg]", "{:.2f}"),
    "excess_deg": ("over optimum", "{:.2f}"),
    "excess_max_deg": ("at worst", "{:.1f}"),
    "jerk_ratio": ("jerk ratio", "{:.2f}"),
    "speed_max": ("speed [rad/s]", "{:.1f}"),
    "speed_p99": ("99%", "{:.1f}"),
    "over_limit": ("over limit", "{:.1%}"),
    "jumps": ("jumps", "{:.1f}"),
}


def table(evaluations: Sequence[Evaluation]) -> str:
    """What `evaluate_clips` gave, a row each; parts that the robot does not have are left out."""
    means = len(evaluations) - 2
    lines = aligned("clip", evaluations, _HEADS)
    lines.insert(1 + means, "-" * len(lines[0]))
    return "\n".join(lines)


def motion_table(ways: Mapping[str, Sequence[Evaluation]]) -> str:
    """The means over clips of what `evaluate_clips` gave for each way of answering, a row each: as motions."""
    rows = [replace(evaluations[-2], name=way) for way, evaluations in ways.items()]
    return "\n".join(aligned("mean over clips", rows, _MOTION_HEADS))
