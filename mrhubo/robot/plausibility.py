"""Human poses as a robot reads them, and whether a human could stand so.

A robot reads a pose's directions (`BodyMap.human_directions`): those of its arms' limbs, say, and no legs. The pose
that it reads is a person at rest with these directions (`read_pose`), the same for every file that shares the same
directions out among collar, shoulder and elbow in another way. Its reconstruction error phi under the body prior, over
the joints that the robot's parts turn, says whether those directions are a human's; legs, spine, and habits of the file
have no say in it.

Legend: B batch, D directions, J = 21 human joints.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import BodyPrior, anatomy
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.robot.alignment import align_pose
from mrhubo.robot.body_map import BodyMap
from mrhubo.robot.parts import BodyPart, OrientedPart


@dataclass(frozen=True)
class Reading:
    """Human poses as a robot reads them, joint by joint."""

    error_BJ: Tensor
    """Mean squared error of each joint's six numbers (B, 21) between a pose and its reconstruction by the prior."""
    excess_BJ: Tensor
    """By how much each joint leaves its anatomical range (B, 21) [rad], at its worst angle."""

    def phi(self, joints: Iterable[int]) -> Tensor:
        """Reconstruction error (B,) over some joints (positions in POSED_JOINT_NAMES)."""
        return self.error_BJ[:, list(joints)].mean(dim=1)

    def excess(self, joints: Iterable[int]) -> Tensor:
        """By how much the worst of some joints leaves its range (B,) [rad]."""
        return self.excess_BJ[:, list(joints)].amax(dim=1)


def turned_joints(parts: Iterable[BodyPart]) -> list[int]:
    """The human joints (positions in POSED_JOINT_NAMES) that turn the directions of some parts."""
    names = {
        name
        for part in parts
        if part.seen_from
        for name in (part.joint, *(part.turned_by if isinstance(part, OrientedPart) else ()))
    }
    return [i for i, name in enumerate(POSED_JOINT_NAMES) if name in names]


def read_pose(body_map: BodyMap, direction_BD3: Tensor) -> Tensor:
    """Local rotations (B, 21, 3, 3) of a person at rest but for directions (B, D, 3), as of
    `BodyMap.human_directions`.
    """
    rest_BJ33 = torch.eye(3).to(direction_BD3).expand(len(direction_BD3), len(POSED_JOINT_NAMES), 3, 3)
    return align_pose(body_map, rest_BJ33, direction_BD3, hinged=True)


def read(body_map: BodyMap, prior: BodyPrior, direction_BD3: Tensor) -> Reading:
    """What a robot reads of human poses' directions (B, D, 3), and how plausible that is."""
    local_BJ33 = read_pose(body_map, direction_BD3)
    pose_BJ6 = rotation.matrix_to_sixd(local_BJ33)
    error_BJ = (prior.denoise(pose_BJ6) - pose_BJ6).square().mean(dim=-1)
    return Reading(error_BJ, anatomy.excess(local_BJ33).amax(dim=-1))


def read_phi(body_map: BodyMap, prior: BodyPrior, direction_BD3: Tensor) -> Tensor:
    """phi (B,) of what a robot reads: the mean squared error of the six numbers of the joints that its parts turn."""
    return read(body_map, prior, direction_BD3).phi(turned_joints(body_map.keypoints.parts))
