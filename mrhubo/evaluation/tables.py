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
    "geometric_limb_deg": ("geometric", "{:.1f}"),
    "hand_deg": ("hands [deg]", "{:.1f}"),
    "head_deg": ("head [deg]", "{:.1f}"),
    "leg_deg": ("legs [deg]", "{:.1f}"),
    "reference_leg_deg": (" reference's", "{:.1f}"),
    "foot_deg": ("feet [deg]", "{:.1f}"),
    "reference_foot_deg": (" reference's ", "{:.1f}"),
    "chest_deg": ("chest [deg]", "{:.1f}"),
    "reference_chest_deg": ("  reference's", "{:.1f}"),
    "jerk_ratio": ("jerk ratio", "{:.2f}"),
    "most_at_limit": ("most at limit", "{:.1%}"),
    "collision": ("collision", "{:.1%}"),
    "reference_collision": ("reference's ", "{:.1%}"),
}
_OFTEN = 1e-3
_MOTION_HEADS = {
    "joint_rad": ("joint [rad]", "{:.3f}"),
    "link_cm": ("link [cm]", "{:.2f}"),
    "limb_deg": ("limbs [deg]", "{:.2f}"),
    "geometric_limb_deg": ("geometric", "{:.2f}"),
    "excess_deg": ("over optimum", "{:.2f}"),
    "excess_max_deg": ("at worst", "{:.1f}"),
    "leg_deg": ("legs [deg]", "{:.2f}"),
    "leg_excess_deg": ("legs over", "{:.2f}"),
    "leg_excess_max_deg": ("worst leg", "{:.1f}"),
    "foot_deg": ("feet [deg]", "{:.2f}"),
    "chest_deg": ("chest [deg]", "{:.2f}"),
    "jerk_ratio": ("jerk ratio", "{:.2f}"),
    "speed_max": ("speed [rad/s]", "{:.1f}"),
    "speed_p99": ("99%", "{:.1f}"),
    "over_limit": ("over limit", "{:.1%}"),
    "jumps": ("jumps", "{:.1f}"),
}


def table(evaluations: Sequence[Evaluation]) -> str:
    """What `evaluate_clips` gave, a row each, and how often each joint is at a limit; parts that the robot lacks are
    left out.
    """
    means = len(evaluations) - 2
    lines = aligned("clip", evaluations, _HEADS)
    lines.insert(1 + means, "-" * len(lines[0]))
    return "\n".join([*lines, *limit_lines(evaluations[-1])])


def limit_lines(evaluation: Evaluation) -> list[str]:
    """``at a limit, share of the frames: LWrj2 61.2%, RElbj 3.0%``: the joints that are there in a frame of a thousand,
    most often first; nothing where none is known.
    """
    shares = sorted(evaluation.joints_at_limit, key=lambda row: -row[1])
    often = [f"{joint} {share:.1%}" for joint, share in shares if share >= _OFTEN]
    return [f"at a limit, share of the frames: {', '.join(often) or 'no joint'}"] if shares else []


def motion_table(ways: Mapping[str, Sequence[Evaluation]]) -> str:
    """The means over clips of what `evaluate_clips` gave for each way of answering, a row each: as motions."""
    rows = [replace(evaluations[-2], name=way) for way, evaluations in ways.items()]
    return "\n".join(aligned("mean over clips", rows, _MOTION_HEADS))
