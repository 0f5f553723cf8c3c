"""What a retargeter is worth on human motion: against the reference, against the human, and as a motion of a robot.

Legend: T frames, X steps between them, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import Any

import torch
from torch import Tensor

from mrhubo.evaluation.clips import Clip
from mrhubo.evaluation.scores import BY_JOINT, ClipScore, mean_score, number_fields, score_clip
from mrhubo.reference import DirectionProblem, angle_between, at_limit_share, count_jumps, direction_jerk, limit_shares
from mrhubo.robot import BodyMap, LinkPoses
from mrhubo.robot.parts import Region


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
    """Share of frames in which the robot's collision shapes overlap. NaN: shapes of what moves are missing."""
    reference_collision: float
    """The same for the reference, which is not told to avoid it."""
    geometric_limb_deg: float = nan
    """`limb_deg` of limbs between the centres of the robot's joints, as its axes tell them (`BodyMap.geometric`): an
    entry beside a joint shows in it. NaN: the axes tell none."""
    excess_deg: float = nan
    """Mean of the limbs' angle to the human less that of the frame's own optimum: what is the answer's fault. NaN: the
    optimum is not known."""
    excess_max_deg: float = nan
    """The same in the worst frame."""
    speed_max: float = nan
    """The highest speed of a joint [rad/s]."""
    speed_p99: float = nan
    """Speed [rad/s] that the fastest joint stays below in 99% of the steps from one frame to the next."""
    over_limit: float = nan
    """Share of steps in which a joint turns faster than it can (`Robot.velocity_N`)."""
    jumps: float = nan
    """Steps of more than 0.5 rad in 1/24 s that the human did not make (`mrhubo.reference.count_jumps`), in a clip."""
    leg_deg: float = nan
    """Mean angle between the robot's and the human's thighs and shins, seen from the pelvis."""
    reference_leg_deg: float = nan
    """The same for the reference."""
    foot_deg: float = nan
    """The same for the forward and up of feet."""
    reference_foot_deg: float = nan
    """The same for the reference: of where a foot points a leg of six joints gives way."""
    chest_deg: float = nan
    """The same for the chest's forward and up, seen from the pelvis: how the waist bends."""
    reference_chest_deg: float = nan
    """The same for the reference."""
    leg_excess_deg: float = nan
    """As `excess_deg`, of thighs and shins."""
    leg_excess_max_deg: float = nan
    """The same in the worst frame."""
    joints_at_limit: tuple[tuple[str, float], ...] = field(default=(), metadata={BY_JOINT: True})
    """Share of the frames in which each joint is at a limit, by its name."""

    @property
    def most_at_limit(self) -> float:
        """That of the joint which is there most."""
        return max((share for _, share in self.joints_at_limit), default=nan)


def evaluate_clip(clip: Clip, q_TN: Tensor, body_map: BodyMap, key_links: Sequence[str]) -> Evaluation:
    """Measures of predicted joint angles (T, N) [rad]."""
    robot, shapes, human_TD3 = body_map.robot, body_map.collision, body_map.human_directions(clip.motion.local_TJ33)
    poses, reference_poses = (robot.forward(q) for q in (q_TN, clip.reference_TN))
    robot_TD3, reference_TD3 = (body_map.robot_directions(p) for p in (poses, reference_poses))
    error_TD, reference_TD = (torch.rad2deg(angle_between(d, human_TD3)) for d in (robot_TD3, reference_TD3))

    def mean(angles_TD: Tensor, region: Region) -> float:
        return float(angles_TD[:, _columns(body_map, region)].mean())  # NaN where there are none

    def collision_share(q_TN: Tensor, poses: LinkPoses) -> float:
        touches_T = shapes.touches(q_TN, poses)
        return nan if touches_T is None else float(touches_T.float().mean())

    jerk, human_jerk = (
        float(direction_jerk(d[:, body_map.measured], clip.motion.frame_rate).mean()) for d in (robot_TD3, human_TD3)
    )
    return Evaluation(
        **vars(score_clip(clip, q_TN, robot, key_links, (poses, reference_poses))),
        limb_deg=mean(error_TD, "arm"),
        reference_limb_deg=mean(reference_TD, "arm"),
        hand_deg=mean(error_TD, "hand"),
        head_deg=mean(error_TD, "head"),
        jerk_ratio=jerk / human_jerk if human_jerk else float("nan"),
        at_limit=float(at_limit_share(robot, q_TN).mean()),
        collision=collision_share(q_TN, poses),
        reference_collision=collision_share(clip.reference_TN, reference_poses),
        geometric_limb_deg=_geometric(clip, q_TN, body_map),
        leg_deg=mean(error_TD, "leg"),
        reference_leg_deg=mean(reference_TD, "leg"),
        foot_deg=mean(error_TD, "foot"),
        reference_foot_deg=mean(reference_TD, "foot"),
        chest_deg=mean(error_TD, "trunk"),
        reference_chest_deg=mean(reference_TD, "trunk"),
        joints_at_limit=tuple(zip(robot.joint_names, limit_shares(robot, q_TN).tolist(), strict=True)),
        **_excess(clip, error_TD, human_TD3, body_map),
        **_speeds(clip, q_TN, human_TD3, body_map),
    )


_EXCESS: Mapping[str, Region] = {"excess": "arm", "leg_excess": "leg"}
"""Measures of what is the answer's fault, by what they are of."""


def _columns(body_map: BodyMap, region: Region) -> list[int]:
    return [i for i, direction in enumerate(body_map.directions) if direction.part.region == region]


def _geometric(clip: Clip, q_TN: Tensor, body_map: BodyMap) -> float:
    geometric = body_map.geometric
    if geometric is None:
        return nan
    robot_TD3 = geometric.robot_directions(geometric.robot.forward(q_TN))
    error_TD = torch.rad2deg(angle_between(robot_TD3, geometric.human_directions(clip.motion.local_TJ33)))
    return float(error_TD[:, _columns(geometric, "arm")].mean())


def _excess(clip: Clip, error_TD: Tensor, human_TD3: Tensor, body_map: BodyMap) -> dict[str, Any]:
    if clip.optimum_TN is None:
        return {}
    optimum_TD3 = body_map.robot_directions(body_map.robot.forward(clip.optimum_TN))
    excess_TD, found = error_TD - torch.rad2deg(angle_between(optimum_TD3, human_TD3)), {}
    for name, region in _EXCESS.items():
        if columns := _columns(body_map, region):
            excess_T = excess_TD[:, columns].mean(dim=1)
            found |= {f"{name}_deg": float(excess_T.mean()), f"{name}_max_deg": float(excess_T.max())}
    return found


def _speeds(clip: Clip, q_TN: Tensor, human_TD3: Tensor, body_map: BodyMap) -> dict[str, Any]:
    rate = clip.motion.frame_rate
    speed_XN = q_TN.diff(dim=0).abs() * rate
    if not len(speed_XN):
        return {}
    fastest_X = speed_XN.amax(dim=1)
    return {
        "speed_max": float(fastest_X.max()),
        "speed_p99": float(fastest_X.quantile(0.99)),
        "over_limit": float((speed_XN > body_map.robot.velocity_N).any(dim=1).float().mean()),
        "jumps": float(count_jumps(DirectionProblem(body_map), q_TN, human_TD3, rate)),
    }


def evaluate_clips(
    predictions: Sequence[Tensor], clips: Sequence[Clip], body_map: BodyMap, key_links: Sequence[str]
) -> list[Evaluation]:
    """Measures clip by clip, then their means over clips and over frames."""
    found = [evaluate_clip(c, q_TN, body_map, key_links) for c, q_TN in zip(clips, predictions, strict=True)]
    return [*found, mean_score(found), mean_score(found, over_frames=True)]


def measures(evaluation: Evaluation) -> dict[str, float]:
    """The measures by name; those that the robot does not have are left out."""
    found = {name: getattr(evaluation, name) for name in number_fields(Evaluation)}
    found |= {f"at_limit/{joint}": share for joint, share in evaluation.joints_at_limit}
    return {name: value for name, value in found.items() if value == value}


def run_metrics(evaluations: Sequence[Evaluation], latency: Mapping[str, float]) -> dict[str, float]:
    """What `evaluate_clips` and `latencies` gave for the test clips, under the names that a run has for it."""
    *clips, _, over_frames = evaluations
    found = mean_metrics(evaluations, latency, "test")
    for name, score in [*((clip.name, clip) for clip in clips), ("over_frames", over_frames)]:
        found |= {f"test/{name}/joint_rad": score.joint_rad, f"test/{name}/link_cm": score.link_cm}
    return found


def mean_metrics(evaluations: Sequence[Evaluation], latency: Mapping[str, float], prefix: str) -> dict[str, float]:
    """The means over clips, and the latency, alone; `prefix` goes before their names."""
    return {f"{prefix}/{name}": value for name, value in {**measures(evaluations[-2]), **latency}.items()}
