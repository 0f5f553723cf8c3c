"""The human: skeleton, body prior, inverse kinematics, how the prior is trained and measured, the official files."""

from mrhubo.body.human import build_skeleton, open_prior
from mrhubo.body.latent_ik import inverse_kinematics
from mrhubo.body.official import open_skeleton, save_skeleton
from mrhubo.body.prior import BodyPrior
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton, mirror_pose, mirror_rotations
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
