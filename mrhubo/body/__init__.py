"""The human: skeleton, body prior, and how the prior is trained."""

from mrhubo.body.prior import BodyPrior, open_prior
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton, mirror_pose

__all__ = ["JOINT_NAMES", "KEYPOINT_NAMES", "POSED_JOINT_NAMES", "BodyPrior", "Skeleton", "mirror_pose", "open_prior"]
