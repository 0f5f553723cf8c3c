"""The problem of inverse kinematics in the latent space of a decoder, and its derivatives.

    minimise over z   w_data * sum_k |P_k(z) - P_k|^2 + w_prior * |z|^2        (VPoser's IK, weights 100 and 0.01)

`cost` is differentiated by autograd; `cost_and_gradient` gives the same numbers several times faster, and
`linearise` the Jacobian of the keypoints.

Legend: B batch, K used keypoints, Z latent numbers, U human joints that move a used keypoint. A shape that ends in B
has the batch last: 3x3 products are then a few vector operations over the whole batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.decoder import Decoder, JointDecoder
from mrhubo.body.skeleton import Skeleton
from mrhubo.body.tree import KeypointTree

_CHUNK = 256
"""Poses whose Jacobians are made at once: larger ones leave the cache, smaller ones leave the cores idle."""
_METRIC_DAMPING = 0.05
"""Keeps directions that hardly move a keypoint from dominating the mean of the inverses."""


class LatentProblem:
    """Cost, keypoints and Jacobian of latents for one decoder, one skeleton and one set of used keypoints."""

    def __init__(
        self,
        decoder: Decoder,
        skeleton: Skeleton,
        keypoints: Sequence[int],
        w_data: float = 100.0,
        w_prior: float = 0.01,
    ) -> None:
        """`keypoints` are indices in KEYPOINT_NAMES; the decoder's weights are those of now."""
        self.decoder, self.skeleton, self.keypoints = decoder, skeleton, list(keypoints)
        self.w_data, self.w_prior, self.latent = w_data, w_prior, decoder.latent
        self.tree = KeypointTree(skeleton, keypoints)
        self._joints = JointDecoder(decoder, self.tree.joints)

    @property
    def device(self) -> torch.device:
        """Where the decoder is."""
        return self.decoder.identity_F.device

    def keypoints_of(self, z_BZ: Tensor) -> Tensor:
        """Used keypoints (B, K, 3) [m] of the decoded poses; differentiable."""
        return self.skeleton.keypoints(rotation.sixd_to_matrix(self.decoder(z_BZ)))[:, self.keypoints]

    def cost(self, z_BZ: Tensor, target_BK3: Tensor) -> Tensor:
        """Cost (B,) of latents; differentiable."""
        distance = self.keypoints_of(z_BZ) - target_BK3
        return self.w_data * distance.square().sum(dim=(1, 2)) + self.w_prior * z_BZ.square().sum(-1)

    @torch.no_grad()
    def cost_and_gradient(self, z_ZB: Tensor, target_K3B: Tensor) -> tuple[Tensor, Tensor]:
        """Cost (B,) and its gradient (Z, B), for latents (Z, B) and targets (K, 3, B) [m]."""
        raw_6UB, slopes = self._joints.value_and_slopes(z_ZB)
        state = self.tree.forward(raw_6UB)
        residual_K3B = state.points_K3B - target_K3B
        cost_B = self.w_data * residual_K3B.square().sum((0, 1)) + self.w_prior * z_ZB.square().sum(0)
        gradient_6UB = self.tree.pullback(state, residual_K3B.mul_(2 * self.w_data))
        return cost_B, self._joints.pullback(slopes, gradient_6UB, z_ZB, 2 * self.w_prior)

    @cached_property
    def metric(self) -> Tensor:
        """`metric_of` 256 latents of N(0, I), always the same."""
        z_BZ = torch.randn(256, self.latent, generator=torch.Generator().manual_seed(0))
        return self.metric_of(z_BZ.to(self.decoder.identity_F))

    def metric_of(self, z_BZ: Tensor) -> Tensor:
        """Mean inverse (Z, Z) of the cost's Gauss-Newton matrix over some latents (B, Z): a first guess of the inverse
        Hessian near any of them.

        The matrix of a pose's own start would save a quasi-Newton search a quarter of its steps, and cost as much as
        half of them.
        """
        matrix_BZZ, _ = self.normal_equations(z_BZ, z_BZ.new_zeros(len(z_BZ), len(self.keypoints), 3))
        twice_BZZ = 2 * matrix_BZZ
        twice_BZZ.diagonal(dim1=1, dim2=2).add_(_METRIC_DAMPING)
        return torch.linalg.inv(twice_BZZ).mean(0)

    def normal_equations(self, z_BZ: Tensor, target_BK3: Tensor) -> tuple[Tensor, Tensor]:
        """Gauss-Newton matrix (B, Z, Z) and half the gradient (B, Z) of the cost."""
        matrices, gradients = [], []
        for z, target in zip(z_BZ.split(_CHUNK), target_BK3.split(_CHUNK), strict=True):
            points, jacobian_BKZ = self.linearise(z)
            residual_BK = (points - target).flatten(1)
            transposed = jacobian_BKZ.transpose(1, 2)
            matrices.append(self.w_data * (transposed @ jacobian_BKZ))
            gradients.append(self.w_data * (transposed @ residual_BK[..., None])[..., 0] + self.w_prior * z)
        matrix_BZZ = torch.cat(matrices)
        matrix_BZZ.diagonal(dim1=1, dim2=2).add_(self.w_prior)
        return matrix_BZZ, torch.cat(gradients)

    @torch.no_grad()
    def linearise(self, z_BZ: Tensor) -> tuple[Tensor, Tensor]:
        """Used keypoints (B, K, 3) [m] and their Jacobian (B, 3K, Z), by the chain rule.

        Forward through the decoder as matrix products over all Z columns at once; then each joint's angular velocity
        from the derivative of Gram-Schmidt; then v_k = sum of omega_j x (p_k - p_j) over the joints that move k.
        """
        raw_BJ6, columns_BZ6U = self._joints.value_and_jacobian(z_BZ)
        matrices = rotation.sixd_to_matrix(raw_BJ6)
        points, global_B33 = self.skeleton.keypoints_and_rotations(matrices)
        joints = self.tree.joints
        used = [j - 1 for j in joints]
        turn_BU36 = global_B33[:, joints] @ _gram_schmidt_rate(raw_BJ6[:, used], matrices[:, used])
        omega_BU3Z = turn_BU36 @ columns_BZ6U.permute(0, 3, 2, 1)
        pivot_BU3 = points[:, joints]
        moment_BU3Z = torch.linalg.cross(omega_BU3Z, pivot_BU3[..., None].expand_as(omega_BU3Z), dim=2)
        sums = torch.cat((omega_BU3Z, moment_BU3Z), dim=2).flatten(2)
        omega_BK3Z, moment_BK3Z = (self.tree.moves_KU @ sums).unflatten(2, (6, self.latent)).split(3, dim=2)
        used_points = points[:, self.keypoints]
        velocity = torch.linalg.cross(omega_BK3Z, used_points[..., None].expand_as(omega_BK3Z), dim=2) - moment_BK3Z
        return used_points, velocity.flatten(1, 2)


def _gram_schmidt_rate(raw_BU6: Tensor, matrix_BU33: Tensor) -> Tensor:
    """Body angular velocity (B, U, 3, 6) per unit change of the six raw numbers that Gram-Schmidt made orthonormal.

    With columns x, y, z of R, a1 and a2 the halves and b the part of a2 across x:  omega_z = y.da1/|a1|,
    omega_y = -z.da1/|a1|,  omega_x = (z.da2 - (x.a2) z.da1/|a1|) / |b|.
    """
    first, second = raw_BU6[..., :3], raw_BU6[..., 3:]
    x, y, z = matrix_BU33.unbind(-1)
    length = first.norm(dim=-1, keepdim=True)
    along = (x * second).sum(-1, keepdim=True)
    across = (second - along * x).norm(dim=-1, keepdim=True)
    nothing = torch.zeros_like(z)
    rate_x = torch.cat((-along / (length * across) * z, z / across), dim=-1)
    rate_y = torch.cat((-z / length, nothing), dim=-1)
    rate_z = torch.cat((y / length, nothing), dim=-1)
    return torch.stack((rate_x, rate_y, rate_z), dim=-2)
