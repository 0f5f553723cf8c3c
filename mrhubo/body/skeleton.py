"""The human body in PyTorch: batched forward kinematics, mirroring. Frames and names are those of `joints`.

Legend: B batch, J = 21 posed joints, K keypoints (22 joints and the points fixed to them).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mrhubo.body.joints import (
    JOINT_NAMES,
    KEYPOINT_JOINT,
    KEYPOINT_NAMES,
    LEG_JOINTS,
    LEVELS,
    MIRROR,
    OFFSETS_J3,
    PAIRED_JOINTS,
    PAIRED_KEYPOINTS,
    PARENTS,
    POINT_NAMES,
    POINT_OFFSETS_E3,
    POSED_JOINT_NAMES,
    SIDE_OF,
    SIDES,
    ancestors,
    joint_index,
    keypoint_indices,
    local_rotations,
)
from mrhubo.errors import UserError
from mrhubo.files.storage import checksum_tensors

__all__ = [
    "JOINT_NAMES",
    "KEYPOINT_JOINT",
    "KEYPOINT_NAMES",
    "LEG_JOINTS",
    "PAIRED_JOINTS",
    "PAIRED_KEYPOINTS",
    "PARENTS",
    "POINT_NAMES",
    "POSED_JOINT_NAMES",
    "SIDE_OF",
    "SIDES",
    "ancestors",
    "joint_index",
    "keypoint_indices",
    "local_rotations",
    "Skeleton",
    "mirror_joints",
    "mirror_pose",
    "mirror_rotations",
]

_LONGEST = 2.0
"""No bone is that long [m]; other units than metres are."""
_SHORTEST = 1e-3
"""Nor is one so short [m]."""


def mirror_pose(pose_BJ6: Tensor) -> Tensor:
    """The pose (..., 21, 6) reflected in the body's left-right plane (R -> S R S with S = diag(-1, 1, 1))."""
    sign = pose_BJ6.new_tensor([1.0, -1.0, -1.0, -1.0, 1.0, 1.0])
    return pose_BJ6[..., MIRROR, :] * sign


def mirror_rotations(matrix_BJ33: Tensor) -> Tensor:
    """`mirror_pose` for matrices (..., 21, 3, 3), exact to the bit."""
    sign = matrix_BJ33.new_tensor([-1.0, 1.0, 1.0])
    return matrix_BJ33[..., MIRROR, :, :] * sign[:, None] * sign


def mirror_joints(values_BJ: Tensor) -> Tensor:
    """A value a joint (..., 21) with those of left and right exchanged."""
    return values_BJ[..., MIRROR]


class Skeleton(nn.Module):
    """Rest offsets as buffers, so that they follow the module's device and precision.

    Args:
        offsets_J3: offsets (21, 3) [m] of joints 1..21 from their parents at rest; default: the open skeleton's.
        point_offsets_E3: offsets [m] of POINT_NAMES from the joints that carry them; default: the open skeleton's.

    Raises:
        UserError: an array has another shape, or holds NaN or a length that no human has.
    """

    rest_K3: Tensor
    offsets_J3: Tensor
    point_offsets_E3: Tensor

    def __init__(self, offsets_J3: Tensor | None = None, point_offsets_E3: Tensor | None = None) -> None:
        super().__init__()
        ours, points = torch.from_numpy(OFFSETS_J3), torch.from_numpy(POINT_OFFSETS_E3)
        for name, given, default in (("offsets_J3", offsets_J3, ours), ("point_offsets_E3", point_offsets_E3, points)):
            if given is not None and given.shape != default.shape:
                raise UserError(f"a skeleton's {name} must have the shape {tuple(default.shape)}, found {given.shape}")
            if given is not None and not (given.is_floating_point() and bool((given.abs() < _LONGEST).all())):
                raise UserError(f"a skeleton's {name} must be finite and shorter than {_LONGEST:g} m")
            if given is not None and given is offsets_J3 and bool((given.norm(dim=-1) < _SHORTEST).any()):
                raise UserError(f"a skeleton's {name} must be longer than {1000 * _SHORTEST:g} mm")
            self.register_buffer(name, (default if given is None else given).float().clone(), persistent=False)
        identity = torch.eye(3).expand(1, len(POSED_JOINT_NAMES), 3, 3)
        self.register_buffer("rest_K3", self.keypoints(identity)[0], persistent=False)

    @property
    def checksum(self) -> str:
        """xxh3 of its lengths, 16 hex digits."""
        return checksum_tensors({"offsets": self.offsets_J3, "points": self.point_offsets_E3}, {})

    @property
    def rest_points(self) -> dict[str, Tensor]:
        """`rest_K3`, the keypoints (3,) [m] of a human at rest, by name."""
        return dict(zip(KEYPOINT_NAMES, self.rest_K3, strict=True))

    def global_rotations(self, local_BJ33: Tensor) -> Tensor:
        """Local rotations (B, 21, 3, 3) of joints 1..21 to rotations relative to the pelvis (B, 22, 3, 3)."""
        root = torch.eye(3, dtype=local_BJ33.dtype, device=local_BJ33.device).expand(len(local_BJ33), 1, 3, 3)
        done = root
        for level in LEVELS:
            parents = [PARENTS[j] for j in level]
            done = torch.cat((done, done[:, parents] @ local_BJ33[:, level[0] - 1 : level[-1]]), dim=1)
        return done

    def keypoints(self, local_BJ33: Tensor) -> Tensor:
        """Positions (B, K, 3) [m] of KEYPOINT_NAMES for local rotations (B, 21, 3, 3); the pelvis is the origin."""
        return self.keypoints_and_rotations(local_BJ33)[0]

    def keypoints_and_rotations(self, local_BJ33: Tensor) -> tuple[Tensor, Tensor]:
        """Positions (B, K, 3) [m] and the joints' rotations relative to the pelvis (B, 22, 3, 3)."""
        rotation = self.global_rotations(local_BJ33)
        bones = (rotation[:, PARENTS[1:]] @ self.offsets_J3[..., None])[..., 0]
        positions = [torch.zeros_like(bones[:, :1])]
        for level in LEVELS:
            done = positions[0] if len(positions) == 1 else torch.cat(positions, dim=1)
            parents = [PARENTS[j] for j in level]
            positions.append(done[:, parents] + bones[:, level[0] - 1 : level[-1]])
        joints = torch.cat(positions, dim=1)
        carriers = list(KEYPOINT_JOINT[len(JOINT_NAMES) :])
        points = joints[:, carriers] + (rotation[:, carriers] @ self.point_offsets_E3[..., None])[..., 0]
        return torch.cat((joints, points), dim=1), rotation
