"""S3LE, the baseline: one latent space for human and robot poses, and a look-up among robot poses known to be feasible.

S. Choi, M. J. Song, H. Ahn, J. Kim: "Self-Supervised Motion Retargeting with Safety Guarantee", ICRA 2021
(arXiv:2103.06447), after their "Nonparametric Motion Retargeting for Humanoid Robots on Shared Latent Space", RSS 2020.

As described there: two Wasserstein autoencoders (I. Tolstikhin et al., ICLR 2018; an MMD keeps the codes normal), one
of human skeletons as unit limb directions, one of robot joint angles; pairs of the two, whose codes are drawn together;
self-made pairs from robot poses beyond the limits, projected to feasible ones by nonparametric regression in the latent
space and turned into skeletons by forward kinematics; an encoder that gives a skeleton, its mixtures with its feasible
projection, and the projection itself one code; and at run time a regression among feasible poses, so that no answer
collides or leaves the limits.

Where we had to choose: the skeleton is the directions that robot and human share (`BodyMap`), hands and head included;
the regression is a kernel-weighted mean (a mean of poses inside the limits is inside them), replaced by the nearest
feasible pose where it collides; sizes, weights and the kernel's width come from our own search (docs/results.md).

Legend: B batch, D directions, X = 3 D, N joints, Z latent, F feasible poses.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mrhubo.retargeter.networks import mlp
from mrhubo.robot import SelfCollision

_CHUNK = 1024


class Autoencoder(nn.Module):
    """Encoder and decoder of one domain."""

    def __init__(self, size: int, hidden: int, latent: int) -> None:
        super().__init__()
        self.encode = mlp(size, hidden, 2, latent)
        self.decode = mlp(latent, hidden, 2, size)


class S3LE(nn.Module):
    """Both autoencoders and the feasible robot poses; answers human directions with joint angles."""

    lower_N: Tensor
    upper_N: Tensor
    middle_N: Tensor
    half_N: Tensor
    feasible_FN: Tensor
    codes_FZ: Tensor

    def __init__(self, directions: int, lower_N: Tensor, upper_N: Tensor, hidden: int, latent: int) -> None:
        super().__init__()
        self.human = Autoencoder(3 * directions, hidden, latent)
        self.robot = Autoencoder(len(lower_N), hidden, latent)
        self.register_buffer("lower_N", lower_N.clone())
        self.register_buffer("upper_N", upper_N.clone())
        self.register_buffer("middle_N", (upper_N + lower_N) / 2)
        self.register_buffer("half_N", (upper_N - lower_N) / 2)
        self.register_buffer("feasible_FN", torch.zeros(0, len(lower_N)))
        self.register_buffer("codes_FZ", torch.zeros(0, latent))

    def scaled(self, q_BN: Tensor) -> Tensor:
        """Joint angles (B, N) [rad] as the network sees them: -1 .. 1 inside the limits."""
        return (q_BN - self.middle_N) / self.half_N

    def human_codes(self, directions_BD3: Tensor) -> Tensor:
        """Codes (B, Z) of human directions (B, D, 3)."""
        return self.human.encode(directions_BD3.flatten(1))

    def robot_codes(self, q_BN: Tensor) -> Tensor:
        """Codes (B, Z) of joint angles (B, N) [rad]."""
        return self.robot.encode(self.scaled(q_BN))

    @torch.no_grad()
    def set_feasible(self, feasible_FN: Tensor) -> None:
        """Sets the poses (F, N) [rad] among which answers are sought: free of collision, inside the limits."""
        self.feasible_FN = feasible_FN
        self.codes_FZ = torch.cat([self.robot_codes(part) for part in feasible_FN.split(65_536)])

    @torch.no_grad()
    def answer(self, code_BZ: Tensor, neighbours: int, width: float, collision: SelfCollision) -> Tensor:
        """Feasible joint angles (B, N) [rad] for codes: a mean of the nearest poses, or where it collides the nearest.

        Args:
            code_BZ: codes of human or robot poses.
            neighbours: how many feasible poses the mean is over.
            width: of the Gaussian kernel, in distances of the farthest of them.
            collision: the robot's collision geometry.
        """
        found = []
        for part_BZ in code_BZ.split(_CHUNK):
            distance_BK, index_BK = torch.cdist(part_BZ, self.codes_FZ).topk(neighbours, largest=False, sorted=True)
            scale_B1 = width * distance_BK[:, -1:].clamp_min(1e-9)
            weight_BK = torch.softmax(-0.5 * (distance_BK / scale_B1).square(), dim=1)
            near_BKN = self.feasible_FN[index_BK]
            mean_BN = (weight_BK[..., None] * near_BKN).sum(dim=1)
            mean_BN = torch.clamp(mean_BN, self.lower_N, self.upper_N)  # which rounding may leave
            touches_B1 = collision.collides(mean_BN)[:, None]
            found.append(torch.where(touches_B1, near_BKN[:, 0], mean_BN))
        return torch.cat(found)


def normality_gap(code_BZ: Tensor, normal_BZ: Tensor) -> Tensor:
    """Maximum mean discrepancy () of codes and normal samples, both (B, Z), under inverse multiquadratic kernels
    (Tolstikhin et al. 2018, section 4).
    """
    count, latent = code_BZ.shape
    off = 1 - torch.eye(count, device=code_BZ.device)
    gap = code_BZ.new_zeros(())

    def square(a_BZ: Tensor, b_BZ: Tensor) -> Tensor:  # cdist's gradient takes three times as long
        both = a_BZ.square().sum(1)[:, None] + b_BZ.square().sum(1)
        return (both - 2 * a_BZ @ b_BZ.T).clamp_min(0)

    inside, outside, across = square(code_BZ, code_BZ), square(normal_BZ, normal_BZ), square(code_BZ, normal_BZ)
    for scale in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0):
        c = 2.0 * latent * scale
        same = ((c / (c + inside) + c / (c + outside)) * off).sum() / (count * (count - 1))
        gap = gap + same - 2 * (c / (c + across)).mean()
    return gap
