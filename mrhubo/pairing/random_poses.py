"""Human poses drawn joint by joint, not from a body prior: any direction of every limb, hand, foot and head of a robot.

A prior knows how people of one collection move. Others move otherwise, and pose estimators err; a network that has seen
every direction of a limb answers them too.

Legend: B poses, J = 21 joints.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import anatomy
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.robot.parts import BendPart, BodyPart, LimbPart, OrientedPart

_BEND = math.radians(155.0)
"""Hinges bend by up to this: as far as a human elbow goes, and a little beyond."""
_LOOSE = math.radians(10.0)
"""Standard deviation of what a hinge turns by besides: a human's is no pure hinge, and estimators bend it sideways."""
_SPREAD = math.radians(40.0)
"""Standard deviation of an oriented part's turn about each axis."""

_RANGED = ("leg",)
"""Regions whose limbs stay in the ranges of a human's joints: nobody's thigh points up behind."""


def random_poses(parts: Sequence[BodyPart], count: int, generator: torch.Generator) -> Tensor:
    """Local rotations (count, 21, 3, 3) whose joints turn at random where one of the parts hangs on them; all other
    joints are at rest.

    A limb on an oriented part (an upper arm on the chest) points anywhere, turned about itself in any way, a thigh
    anywhere in its hip's ranges; a limb on a limb bends about its hinge; what an oriented part turns by is normal about
    each axis, in equal parts at the joints that share it.
    """
    local_BJ33 = torch.eye(3).repeat(count, len(POSED_JOINT_NAMES), 1, 1)
    hinges = {part.bent: part.rest for part in parts if isinstance(part, BendPart)}

    def normal(spread: float) -> Tensor:
        return rotation.axis_angle_to_matrix(spread * torch.randn(count, 3, generator=generator))

    for part in (part for part in parts if part.seen_from):
        column = POSED_JOINT_NAMES.index(part.joint)
        if isinstance(part, OrientedPart):
            shared = _SPREAD / math.sqrt(len(part.turned_by))
            for joint in part.turned_by:
                local_BJ33[:, POSED_JOINT_NAMES.index(joint)] = normal(shared)
        elif isinstance(part, LimbPart) and part.name in hinges:
            bend_B1 = _BEND * torch.rand(count, 1, generator=generator)
            bent = rotation.axis_angle_to_matrix(bend_B1 * torch.tensor(hinges[part.name]))
            local_BJ33[:, column] = bent @ normal(_LOOSE)
        elif isinstance(part, LimbPart) and part.region in _RANGED:
            local_BJ33[:, column] = anatomy.random_rotations(column, count, generator)
        elif isinstance(part, LimbPart):
            quaternion = torch.randn(count, 4, generator=generator)
            local_BJ33[:, column] = rotation.quaternion_to_matrix(quaternion)
    return local_BJ33
