"""Keypoints of one skeleton and their gradient, for those joints alone that move a used keypoint, batch last.

With the batch as the last axis a product of 3x3 matrices is a few vector operations over the whole batch, several times
faster than batches of small matrix products; the gradient is written out instead of recorded.

Legend: B batch, K used keypoints, U joints that move one of them (`joints`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_JOINT, PARENTS, Skeleton, ancestors

_TINY = 1e-12
"""As in `rotation.sixd_to_matrix`."""


@dataclass(frozen=True)
class TreeState:
    """What `KeypointTree.pullback` needs of a forward pass."""

    points_K3B: Tensor
    joint_U3B: Tensor
    rotation_U33B: Tensor
    y_3UB: Tensor
    z_3UB: Tensor
    along_UB: Tensor
    inverse_first_UB: Tensor
    inverse_second_UB: Tensor


class KeypointTree:
    """Six numbers per joint -> keypoints [m], pelvis's frame (x left, y up, z forward), and the way back."""

    def __init__(self, skeleton: Skeleton, keypoints: Sequence[int]) -> None:
        """`keypoints` are indices in KEYPOINT_NAMES."""
        movers = [_movers(k) for k in keypoints]
        self.joints = sorted({j for joints in movers for j in joints})
        """Indices in JOINT_NAMES, parents before children."""
        place = {joint: i for i, joint in enumerate(self.joints)}
        offsets_J3 = skeleton.offsets_J3
        self.moves_KU = offsets_J3.new_tensor([[float(j in joints) for j in self.joints] for joints in movers])
        # A parent outside the tree (the pelvis, or a joint that moves nothing used) is row U: the identity at the
        # origin. Every joint between a used one and the pelvis is in the tree, so only the pelvis is outside.
        root = len(self.joints)
        depth = [len(ancestors(j)) for j in self.joints]
        self._levels = []
        for level in sorted(set(depth)):
            first, last = depth.index(level), root - depth[::-1].index(level)
            parents = [place.get(PARENTS[j], root) for j in self.joints[first:last]]
            self._levels.append((slice(first, last), parents))
        self._bones = _column(offsets_J3[[j - 1 for j in self.joints]])
        self._carriers = [
            place.get(PARENTS[k], root) if k < len(JOINT_NAMES) else place[KEYPOINT_JOINT[k]] for k in keypoints
        ]
        points = torch.cat((offsets_J3.new_zeros(1, 3), offsets_J3, skeleton.point_offsets_E3))
        self._offsets = _column(points[list(keypoints)])

    def forward(self, raw_6UB: Tensor) -> TreeState:
        """Points and what the gradient needs, of six raw numbers per joint (two columns, before Gram-Schmidt)."""
        first, second = raw_6UB[:3], raw_6UB[3:]
        inverse_first = torch.rsqrt(first.square().sum(0).add_(_TINY))
        x = first * inverse_first
        along = (x * second).sum(0)
        across = second - along * x
        inverse_second = torch.rsqrt(across.square().sum(0).add_(_TINY))
        y = across * inverse_second
        z = torch.linalg.cross(x, y, dim=0)
        local_U33B = torch.stack((x, y, z)).permute(2, 1, 0, 3)
        joints, batch = len(self.joints), raw_6UB.shape[-1]
        turned = raw_6UB.new_empty(joints + 1, 3, 3, batch)
        placed = raw_6UB.new_empty(joints + 1, 3, batch)
        turned[joints] = torch.eye(3, dtype=raw_6UB.dtype, device=raw_6UB.device)[..., None]
        placed[joints] = 0.0
        for rows, parents in self._levels:
            parent = turned[parents]
            torch.sum(parent[:, :, :, None] * local_U33B[rows, None], 2, out=turned[rows])
            torch.add(placed[parents], (parent * self._bones[rows]).sum(2), out=placed[rows])
        points = placed[self._carriers] + (turned[self._carriers] * self._offsets).sum(2)
        return TreeState(points, placed[:-1], turned[:-1], y, z, along, inverse_first, inverse_second)

    def pullback(self, state: TreeState, force_K3B: Tensor) -> Tensor:
        """Gradient (6, U, B) by the raw numbers, of a cost whose gradient by the points is `force_K3B`.

        The sum of the forces' moments about a joint is the gradient by its rotation; Gram-Schmidt's derivative (see
        `mrhubo.body.latent`) takes it to the six numbers.
        """
        moment = torch.linalg.cross(state.points_K3B, force_K3B, dim=1)
        both = torch.cat((force_K3B, moment), 1)
        sums = (self.moves_KU.T @ both.flatten(1)).unflatten(1, both.shape[1:])
        torque_U3B = sums[:, 3:] - torch.linalg.cross(state.joint_U3B, sums[:, :3], dim=1)
        about_x, about_y, about_z = (state.rotation_U33B * torque_U3B[:, :, None]).sum(1).unbind(1)
        across = about_x * state.inverse_second_UB
        gradient = torch.empty(2, *state.y_3UB.shape, dtype=force_K3B.dtype, device=force_K3B.device)
        torch.mul(state.z_3UB, across, out=gradient[1])
        torch.mul(state.z_3UB, -(state.along_UB * across + about_y) * state.inverse_first_UB, out=gradient[0])
        gradient[0].addcmul_(state.y_3UB, about_z * state.inverse_first_UB)
        return gradient.flatten(0, 1)


def _movers(keypoint: int) -> list[int]:
    """Joints (indices in JOINT_NAMES, no pelvis) whose rotation moves a keypoint; a joint does not move its own
    centre.
    """
    joint = KEYPOINT_JOINT[keypoint]
    start = PARENTS[joint] if keypoint < len(JOINT_NAMES) else joint
    return [j for j in ancestors(start) if j > 0]


def _column(offsets_X3: Tensor) -> Tensor:
    return offsets_X3[:, None, :, None].contiguous()
