"""What a whole body's motion is worth: nearness to the person, feet on the floor, the way it goes, and speed.

Of any retargeter: joint angles and the base's place and rotation are all that is asked for. Contacts are those of the
person's feet (`mrhubo.motion.contacts`), the same for all who are compared; the floor is at z = 0.

Legend: T frames, P points of soles, S soles, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import nan
from statistics import fmean

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, PAIRED_KEYPOINTS
from mrhubo.errors import UserError
from mrhubo.frames import human_axes, human_to_world
from mrhubo.motion import Motion
from mrhubo.reference import angle_between
from mrhubo.reference.standing import HumanSteps, Legs, LowBody, read_steps
from mrhubo.robot import BodyMap, LinkPoses
from mrhubo.robot.parts import CHEST

SUNK_M, FLOATING_M = 0.01, 0.02
"""From where on a sole is under the floor, and, while it is planted, above it."""
SLIDING = 0.01
"""Speed [m/s] from which on a planted point slides."""
_JUMP_RAD, _JUMP_S = 0.5, 1 / 24
_SHORT_M = 1.0
"""A path is taken for no shorter than this: somebody who sways on the spot has walked no metre."""


@dataclass(frozen=True)
class WholeBodyScore:
    """Of one motion. NaN: the robot has no such part, or nothing is planted."""

    parts_deg: dict[str, float]
    """Mean angle to the person: of limbs by the point where they end (knee: thighs; ankle: shins; elbow: upper arms),
    of oriented parts by their region (trunk, foot, hand, head); of both sides together."""
    chest_deg: float
    """Mean angle by which the robot's chest is turned otherwise in the world than the person's; NaN: it has none."""
    slide_cm_s: float
    """Mean horizontal speed of points of soles while the person's are planted."""
    human_slide_cm_s: float
    """The same of the person's own points."""
    sliding: float
    """Share of these points and frames that are faster than 1 cm/s."""
    sunk: float
    """Share of frames with a sole more than 1 cm under the floor."""
    sunk_max_cm: float
    body_sunk: float
    """Share of frames with anything but a sole more than 1 cm under the floor: hands, knees, the back, as far as
    collision shapes tell.
    """
    body_sunk_max_cm: float
    floating: float
    """Share of frames with a planted sole more than 2 cm above the floor."""
    floating_max_cm: float
    height_cm: float
    """Mean height of planted soles above the floor, each at its lowest point."""
    path_cm_m: float
    """Mean horizontal distance of the root to the person's path, scaled by the legs' length, for each metre of it."""
    heading_deg: float
    """Mean angle between where the robot's pelvis looks and what it follows (`robot.root_follows`), seen from above."""
    speed_max: float
    """The highest speed of a joint by its limit."""
    over_limit: float
    """Share of steps in which a joint is faster than its limit."""
    jumps: float
    """Steps in which a joint turns by more than 0.5 rad in 1/24 s."""
    outside: float
    """The most by which a joint is outside its range [rad]; 0: none is."""


def score_whole_body(
    body_map: BodyMap, motion: Motion, q_TN: Tensor, base_T3: Tensor, base_T33: Tensor
) -> WholeBodyScore:
    """Measures of one motion.

    Args:
        body_map: of a robot with feet.
        motion: the person's, with a root.
        q_TN: joint angles [rad].
        base_T3: place of the base [m], x forward, y left, z up, the floor at z = 0.
        base_T33: its rotation.

    Raises:
        UserError: the robot has no feet, or the motion no root.
    """
    legs, robot = Legs(body_map), body_map.robot
    local_TJ33 = motion.for_skeleton(body_map.skeleton).local_TJ33
    steps = read_steps(motion, local_TJ33, legs)
    if steps is None:
        raise UserError(
            f"{motion.name}: a whole body is measured by its root and feet; the robot or the motion has none"
        )
    poses, rate = robot.forward(q_TN), motion.frame_rate
    soles = legs.on_floor(poses, base_T3, base_T33)
    planted_TP = steps.contacts.planted_TP
    sliding_TP = horizontal_speed(soles.point_BP3.double().numpy(), rate)
    human_TP = horizontal_speed(human_to_world(steps.place_TP3), rate)
    low_TP = legs.lowest(soles.ball_BK3[..., 2].double().numpy())
    low_TS = low_TP.reshape(len(low_TP), -1, 2).min(axis=-1)
    planted_TS = planted_TP.reshape(len(low_TP), -1, 2).any(axis=-1)
    body_T = lowest_of_body(legs, poses, base_T3, base_T33)
    up_TS = np.where(planted_TS, low_TS, -np.inf)
    angle_TD = torch.rad2deg(angle_between(body_map.robot_directions(poses), body_map.human_directions(local_TJ33)))
    share_TN = q_TN.diff(dim=0).abs() * rate / robot.velocity_N
    outside_TN = torch.maximum(robot.lower_N - q_TN, q_TN - robot.upper_N)
    return WholeBodyScore(
        parts_deg=_by_part(body_map, angle_TD),
        chest_deg=chest_error(body_map, motion, local_TJ33, poses, base_T33),
        slide_cm_s=100 * _mean(sliding_TP[planted_TP]),
        human_slide_cm_s=100 * _mean(human_TP[planted_TP]),
        sliding=_mean(sliding_TP[planted_TP] > SLIDING),
        sunk=_mean((low_TS < -SUNK_M).any(axis=1)),
        sunk_max_cm=100 * max(0.0, float(-low_TS.min())),
        body_sunk=_mean(body_T < -SUNK_M),
        body_sunk_max_cm=100 * max(0.0, float(-body_T.min())),
        floating=_mean((up_TS > FLOATING_M).any(axis=1)),
        floating_max_cm=100 * max(0.0, float(up_TS.max())),
        height_cm=100 * _mean(np.maximum(low_TS[planted_TS], 0.0)),
        path_cm_m=path_error(legs.root(poses, base_T3, base_T33), human_to_world(steps.path_T3)),
        heading_deg=heading_error(legs.heading(poses, base_T33), steps),
        speed_max=float(share_TN.max()) if len(share_TN) else 0.0,
        over_limit=_mean((share_TN > 1).any(dim=1).numpy()),
        jumps=float((q_TN.diff(dim=0).abs() * rate * _JUMP_S > _JUMP_RAD).any(dim=1).sum()),
        outside=max(0.0, float(outside_TN.max())),
    )


def mean_whole_body(scores: Sequence[WholeBodyScore]) -> dict[str, float]:
    """Each measure over motions, by name: the mean, of what is called max the largest, and the sum of jumps; angles of
    parts as `PART_deg`.
    """
    found = {
        f"{part}_deg": fmean(score.parts_deg[part] for score in scores if part in score.parts_deg)
        for part in dict.fromkeys(part for score in scores for part in score.parts_deg)
    }
    for name in (field.name for field in fields(WholeBodyScore) if field.name != "parts_deg"):
        values = [value for score in scores if (value := getattr(score, name)) == value]
        most = name == "outside" or "_max" in name
        found[name] = nan if not values else max(values) if most else sum(values) if name == "jumps" else fmean(values)
    return found


def horizontal_speed(place_TP3: np.ndarray, frame_rate: float) -> np.ndarray:
    """Horizontal speeds (T, P) [m/s] of places (T, P, 3) [m], z up; 0 where there is one frame alone."""
    if len(place_TP3) < 2:
        return np.zeros(place_TP3.shape[:-1])
    return np.linalg.norm(np.gradient(place_TP3[..., :2], 1 / frame_rate, axis=0), axis=-1)


def lowest_of_body(legs: Legs, poses: LinkPoses, base_T3: Tensor, base_T33: Tensor) -> np.ndarray:
    """Height (T,) [m] of the lowest of a robot but its soles over z = 0; infinite where nothing else is near the floor.

    Args:
        legs: the robot's.
        poses: of the robot.
        base_T3: place of the base [m], z up.
        base_T33: its rotation.
    """
    low, up_T3 = LowBody(legs), legs.heading(poses, base_T33)[:, 2]
    height_T = legs.root(poses, base_T3, base_T33)[:, 2]
    if not low.near(poses, up_T3, height_T):
        return np.full(len(height_T), np.inf)
    return low.lowest_of_any(poses, up_T3, height_T).double().numpy()


def path_error(root_T3: Tensor, path_T3: Tensor) -> float:
    """Mean horizontal distance of the root (T, 3) to a path (T, 3), z up [m], for each metre of the path [cm/m]."""
    off = (root_T3 - path_T3)[:, :2].norm(dim=-1).mean()
    return 100 * float(off) / max(float(path_T3[:, :2].diff(dim=0).norm(dim=-1).sum()), _SHORT_M)


def heading_error(axes_T33: Tensor, steps: HumanSteps) -> float:
    """Mean angle [deg] between where a robot looks, human axes (T, 3, 3) of its pelvis in the world, and the person."""
    robot_T2, human_T2 = axes_T33[:, :2, 2], human_to_world(steps.turn_T33[..., 2])[:, :2].to(axes_T33)
    cross_T = robot_T2[:, 0] * human_T2[:, 1] - robot_T2[:, 1] * human_T2[:, 0]
    return float(torch.rad2deg(torch.atan2(cross_T, (robot_T2 * human_T2).sum(-1)).abs()).mean())


def chest_error(body_map: BodyMap, motion: Motion, local_TJ33: Tensor, poses: LinkPoses, base_T33: Tensor) -> float:
    """Mean angle [deg] between how the robot's chest and the person's are turned in the world; NaN: it has no chest."""
    end = body_map.keypoints.ends.get(CHEST.name)
    if end is None or motion.root_rotation_T33 is None:
        return nan
    row = body_map.robot.link_index(end.link)
    robot_T33 = base_T33 @ poses.rotation_BL33[:, row] @ human_axes(end.axes_23).to(base_T33)
    turn_T33 = body_map.skeleton.global_rotations(local_TJ33)[:, JOINT_NAMES.index(CHEST.joint)]
    human_T33 = human_to_world((motion.root_rotation_T33.to(turn_T33) @ turn_T33).mT).mT
    return float(torch.rad2deg(rotation.geodesic_distance(robot_T33, human_T33)).mean())


def _by_part(body_map: BodyMap, angle_TD: Tensor) -> dict[str, float]:
    columns: dict[str, list[int]] = {}
    for column in body_map.measured:
        direction = body_map.directions[column]
        both = (name for name, sides in PAIRED_KEYPOINTS.items() if direction.name in sides)
        columns.setdefault(next(both, direction.part.region), []).append(column)
    return {name: float(angle_TD[:, found].mean()) for name, found in columns.items()}


def _mean(values: ArrayLike) -> float:
    found = np.asarray(values, float)
    return float(found.mean()) if found.size else nan
