"""The human: skeleton, body prior, inverse kinematics, how the prior is trained and measured, the official files.

Names are imported when they are first asked for: readers of motion need the skeleton's names and lengths alone
(`mrhubo.body.joints`), and no PyTorch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrhubo.body.joints import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.lazy import lazy_names

if TYPE_CHECKING:
    from mrhubo.body.human import build_skeleton, open_prior
    from mrhubo.body.latent_ik import inverse_kinematics
    from mrhubo.body.official import open_skeleton, save_skeleton
    from mrhubo.body.prior import BodyPrior
    from mrhubo.body.skeleton import Skeleton, mirror_pose, mirror_rotations
    from mrhubo.body.vposer import VPoser

__all__ = [
    "JOINT_NAMES",
    "KEYPOINT_NAMES",
    "POSED_JOINT_NAMES",
    "BodyPrior",
    "Skeleton",
    "VPoser",
    "build_skeleton",
    "inverse_kinematics",
    "mirror_pose",
    "mirror_rotations",
    "open_prior",
    "open_skeleton",
    "save_skeleton",
]
_HOMES = {
    "BodyPrior": ".prior",
    "Skeleton": ".skeleton",
    "VPoser": ".vposer",
    "build_skeleton": ".human",
    "inverse_kinematics": ".latent_ik",
    "mirror_pose": ".skeleton",
    "mirror_rotations": ".skeleton",
    "open_prior": ".human",
    "open_skeleton": ".official",
    "save_skeleton": ".official",
}
"""Module of each name that needs PyTorch."""

__getattr__ = lazy_names(__name__, _HOMES)
