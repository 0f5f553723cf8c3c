"""A joint of a robot, and which joint's angle drives it in the end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.errors import UserError

ROTARY = ("revolute", "continuous")
_STILL, _PLAY = 1e-3, 0.06
"""Range under which a joint cannot move [m, rad], and under which a rotary one moves nothing: a gear's play, which some
files model as a joint of its own behind each motor's."""


@dataclass(frozen=True)
class Mimic:
    """This joint's angle = multiplier * (angle of `joint`) + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """One joint: from link `parent` to link `child`, placed by `origin_44`, turning about `axis_3` (unit, child
    frame).
    """

    name: str
    kind: str
    parent: str
    child: str
    origin_44: np.ndarray
    axis_3: np.ndarray
    lower: float | None
    upper: float | None
    mimic: Mimic | None
    limited_by: str = "the URDF's limits"
    """What `lower` and `upper` are, for messages."""
    velocity: float | None = None
    """What the URDF gives as the largest speed [rad/s, or m/s], whatever it may mean (`limits.joint_speed`)."""

    @property
    def rotary(self) -> bool:
        """Revolute or continuous."""
        return self.kind in ROTARY


def stuck(joint: Joint, degrees: bool = False) -> bool:
    """Whether limits leave a joint no way to move, or none but a gear's play. `degrees` tells their unit."""
    if joint.lower is None or joint.upper is None:
        return False
    most = _STILL if not joint.rotary else math.degrees(_PLAY) if degrees else _PLAY
    return joint.upper - joint.lower < most


def drive(joints: Mapping[str, Joint], joint: str) -> Mimic:
    """The joint whose angle drives this one in the end, with the multiplier and offset on the way; a joint that mimics
    none drives itself.

    Raises:
        UserError: a joint on the way mimics itself or none that exists.
    """
    multiplier, offset, seen = 1.0, 0.0, [joint]
    while (mimic := joints[joint].mimic) is not None:
        joint = mimic.joint
        if joint in seen or joint not in joints:
            reason = "mimics itself" if joint in seen else f"mimics '{joint}', which does not exist"
            raise UserError(f"joint '{seen[0]}' {reason}")
        offset, multiplier = offset + multiplier * mimic.offset, multiplier * mimic.multiplier
        seen.append(joint)
    return Mimic(joint, multiplier, offset)
