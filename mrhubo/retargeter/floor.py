"""Whole motions of a robot that has feet: they start from what the networks and their steps of optimisation give, and
`mrhubo.reference.standing` makes of that what it makes of the optimiser's motions: planted feet carry the base, and
stay.

Legend: T frames, J = 21 human joints, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from mrhubo.motion import Motion, MotionLike
from mrhubo.reference.standing import Legs, Standing, flatten, read_steps, standing_fields
from mrhubo.retargeter.clip import smoothness_of
from mrhubo.robot import BodyMap

if TYPE_CHECKING:
    from mrhubo.retargeter.package import Retargeter


def standing_of(body_map: BodyMap) -> Standing | None:
    """What stands a robot on the floor; None where it has no feet."""
    if not body_map.keypoints.standing:
        return None
    legs = Legs(body_map)
    return Standing(legs) if legs.has_feet else None


def stand(
    retargeter: Retargeter, motion: MotionLike, as_seen: MotionLike, parts: Sequence[Tensor],
    targets: Sequence[Tensor], polish: int, avoid_collisions: bool,
) -> tuple[Tensor, dict[str, Any]] | None:  # fmt: skip
    """Joint angles (T, N) [rad] of a motion on the floor, and what a result tells of it (`standing_fields`); None where
    the robot has no feet, or the motion tells no root.

    Args:
        retargeter: of the robot.
        motion: a `Motion` may tell root and contacts; an array tells none.
        as_seen: it, before its pelvis was made steady.
        parts: its poses, for the retargeter's skeleton and on its device.
        targets: their directions.
        polish: as for `Retargeter.predict`.
        avoid_collisions: frames in which the robot would touch itself give way.

    Raises:
        UserError: the root holds what it cannot (`read_steps`).
    """
    if not isinstance(motion, Motion) or (standing := retargeter.standing) is None:
        return None
    seen = as_seen if isinstance(as_seen, Motion) else None
    steps = read_steps(motion, torch.cat(list(parts)), standing.legs, seen)
    if steps is None:
        return None
    target_TD3 = flatten(torch.cat(list(targets)), steps, standing.legs)
    q_TN = retargeter.follow(parts, target_TD3.split([len(part) for part in parts]), polish, steps.frame_rate, False)
    smoothness = smoothness_of(standing.problem, target_TD3, steps.frame_rate)
    found = standing(q_TN, target_TD3, steps, smoothness, avoid_collisions)
    planted_TS = standing.legs.planted(steps.contacts.planted_TP)
    return found.q_TN, standing_fields(found.position_T3, found.rotation_T33, planted_TS, standing.legs)
