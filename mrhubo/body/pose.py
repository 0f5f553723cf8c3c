"""Human poses and what follows from them, worked out once for all who ask.

Legend: B batch, J = 21 posed joints, K keypoints.
"""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from mrhubo.body.skeleton import Skeleton
from mrhubo.rotation import orthonormal


@dataclass(frozen=True)
class HumanPose:
    """Poses of one skeleton; the pelvis is the origin, frame: x to the body's left, y up, z forward, metres."""

    local_BJ33: Tensor
    """Rotations (B, 21, 3, 3) of joints 1..21, each relative to its parent."""
    rotation_BJ33: Tensor
    """Rotations (B, 22, 3, 3) of all joints relative to the pelvis, which is the first."""
    keypoint_BK3: Tensor
    """Positions (B, K, 3) [m] of `KEYPOINT_NAMES`."""

    @classmethod
    def of(cls, local_BJ33: Tensor, skeleton: Skeleton) -> HumanPose:
        """From local rotations (B, 21, 3, 3), which rounding may have left a little oblique."""
        local_BJ33 = orthonormal(local_BJ33)
        keypoint_BK3, rotation_BJ33 = skeleton.keypoints_and_rotations(local_BJ33)
        return cls(local_BJ33, rotation_BJ33, keypoint_BK3)
