"""The latent inverse kinematics problem and its derivatives.

    minimise over z   w_data * sum_k |P_k(z) - P_k|^2 + w_prior * |z|^2        (VPoser's IK, weights 100 and 0.01)

Legend: B batch, K used keypoints, Z latent numbers, U human joints that move a used keypoint, E hidden units.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_JOINT, PARENTS, Skeleton, ancestors

if TYPE_CHECKING:
    from mrhubo.body.prior import BodyPrior

_CHUNK = 256
"""Poses whose Jacobians are made at once: larger ones leave the cache, smaller ones leave the cores idle."""


class LatentProblem:
    """Cost, keypoints and Jacobian of latents for one prior, one skeleton and one set of used keypoints."""

    def __init__(
        self,
        prior: BodyPrior,
        skeleton: Skeleton,
        keypoints: Sequence[int],
        w_data: float = 100.0,
        w_prior: float = 0.01,
    ) -> None:
        self.prior, self.skeleton, self.keypoints = prior, skeleton, list(keypoints)
        self.w_data, self.w_prior, self.latent = w_data, w_prior, prior.latent
        carriers = [_movers(k) for k in self.keypoints]
        self._joints = sorted({j for movers in carriers for j in movers})
        device = prior.identity_F.device
        rows = torch.tensor([6 * (j - 1) + i for j in self._joints for i in range(6)], device=device)
        self._first, self._second, self._last = [m for m in prior.decoder if isinstance(m, nn.Linear)]
        self._activation = _ACTIVATIONS[prior.activation]
        self._last_rows = self._last.weight[rows].contiguous()
        self._moves_KU = torch.tensor(
            [[float(j in movers) for j in self._joints] for movers in carriers], device=device
        )

    def keypoints_of(self, z_BZ: Tensor) -> Tensor:
        """Used keypoints (B, K, 3) [m] of the decoded poses; differentiable."""
        return self.skeleton.keypoints(self.prior.decode_matrices(z_BZ))[:, self.keypoints]

    def cost(self, z_BZ: Tensor, target_BK3: Tensor) -> Tensor:
        """Cost (B,) of latents; differentiable."""
        distance = self.keypoints_of(z_BZ) - target_BK3
        return self.w_data * distance.square().sum(dim=(1, 2)) + self.w_prior * z_BZ.square().sum(-1)

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
        batch = len(z_BZ)
        y1_BE, d1_BE = self._activation(self._first(z_BZ))
        y2_BE, d2_BE = self._activation(self._second(y1_BE))
        raw_BJ6 = (self._last(y2_BE) + self.prior.identity_F).unflatten(-1, (-1, 6))
        columns_BZE = d1_BE[:, None, :] * self._first.weight.T
        columns_BZE = (columns_BZE.flatten(0, 1) @ self._second.weight.T).unflatten(0, (batch, self.latent))
        columns_BZE = columns_BZE.mul_(d2_BE[:, None, :])
        columns_BZU6 = (columns_BZE.flatten(0, 1) @ self._last_rows.T).view(batch, self.latent, -1, 6)
        matrices = rotation.sixd_to_matrix(raw_BJ6)
        points, global_B33 = self.skeleton.keypoints_and_rotations(matrices)
        used = [j - 1 for j in self._joints]
        turn_BU36 = global_B33[:, self._joints] @ _gram_schmidt_rate(raw_BJ6[:, used], matrices[:, used])
        omega_BU3Z = turn_BU36 @ columns_BZU6.permute(0, 2, 3, 1)
        pivot_BU3 = points[:, self._joints]
        moment_BU3Z = torch.linalg.cross(omega_BU3Z, pivot_BU3[..., None].expand_as(omega_BU3Z), dim=2)
        sums = torch.cat((omega_BU3Z, moment_BU3Z), dim=2).flatten(2)
        omega_BK3Z, moment_BK3Z = (self._moves_KU @ sums).unflatten(2, (6, self.latent)).split(3, dim=2)
        used_points = points[:, self.keypoints]
        velocity = torch.linalg.cross(omega_BK3Z, used_points[..., None].expand_as(omega_BK3Z), dim=2) - moment_BK3Z
        return used_points, velocity.flatten(1, 2)


def _silu(x: Tensor) -> tuple[Tensor, Tensor]:
    s = torch.sigmoid(x)
    return x * s, s * (1 + x * (1 - s))


def _leaky_relu(x: Tensor) -> tuple[Tensor, Tensor]:
    slope = torch.where(x > 0, 1.0, 0.01)
    return x * slope, slope


def _tanh(x: Tensor) -> tuple[Tensor, Tensor]:
    y = torch.tanh(x)
    return y, 1 - y.square()


_ACTIVATIONS: dict[str, Callable[[Tensor], tuple[Tensor, Tensor]]] = {
    "silu": _silu,
    "leaky_relu": _leaky_relu,
    "tanh": _tanh,
}
"""Value and derivative of the activations a prior may have."""


def _movers(keypoint: int) -> list[int]:
    """Joints (indices in JOINT_NAMES, no pelvis) whose rotation moves a keypoint; a joint does not move its own
    centre.
    """
    joint = KEYPOINT_JOINT[keypoint]
    start = PARENTS[joint] if keypoint < len(JOINT_NAMES) else joint
    return [j for j in ancestors(start) if j > 0]


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
