"""Human poses spoilt in known ways: what a confidence is calibrated and measured on.

Legend: B batch, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.robot.parts import BendPart, BodyPart, LimbPart


def shaken(local_BJ33: Tensor, noise_deg: Tensor | float, generator: torch.Generator) -> Tensor:
    """Every joint turned about a random axis by a normally distributed angle, of standard deviation `noise_deg`, one
    number or (B,) [deg].
    """
    axis_BJ3 = rotation.random_axes(*local_BJ33.shape[:2], generator=generator)
    spread_B11 = torch.deg2rad(torch.as_tensor(noise_deg, dtype=torch.float32)).reshape(-1, 1, 1)
    angle_BJ1 = spread_B11 * torch.randn(*local_BJ33.shape[:2], 1, generator=generator)
    return local_BJ33 @ rotation.axis_angle_to_matrix(angle_BJ1 * axis_BJ3).to(local_BJ33)


def bent_backwards(local_BJ33: Tensor, angle_B: Tensor, parts: Sequence[BodyPart]) -> Tensor:
    """Elbows, and whatever else bends about an axis of the table's, bent the wrong way by angles (B,) [deg]."""
    found = local_BJ33.clone()
    joint_of = {part.name: part.joint for part in parts}
    for part in parts:
        if isinstance(part, BendPart):
            axis_3 = torch.tensor(part.rest)
            turn_B33 = rotation.axis_angle_to_matrix(-torch.deg2rad(angle_B)[:, None] * axis_3)
            found[:, POSED_JOINT_NAMES.index(joint_of[part.bent])] = turn_B33.to(local_BJ33)
    return found


def dislocated(
    local_BJ33: Tensor, parts: Sequence[BodyPart], share: float, most_deg: float, generator: torch.Generator
) -> Tensor:
    """Joints of limbs turned about random axes by a quarter of `most_deg` to all of it: a random share of the joints
    that turn a limb, each on its own.
    """
    found = local_BJ33.clone()
    joints = dict.fromkeys(POSED_JOINT_NAMES.index(part.joint) for part in parts if isinstance(part, LimbPart))
    for joint in joints:
        axis_B3 = rotation.random_axes(len(found), generator=generator)
        angle_B1 = most_deg * (0.25 + 0.75 * torch.rand(len(found), 1, generator=generator))
        angle_B1 = angle_B1 * (torch.rand(len(found), 1, generator=generator) < share)
        found[:, joint] = rotation.axis_angle_to_matrix(torch.deg2rad(angle_B1) * axis_B3).to(found) @ found[:, joint]
    return found
