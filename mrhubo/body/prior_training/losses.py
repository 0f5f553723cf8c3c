"""Terms of the body prior's training loss. Legend: B batch, J = 21 joints, Z latent numbers."""

from __future__ import annotations

import math

import torch
from torch import Tensor


def pseudo_huber(x: Tensor, delta: float) -> Tensor:
    """Pseudo-Huber loss, divided by delta, of the Euclidean norm of the last axis: |x|^2 / (2 delta) near 0, |x| far
    off, so that the mean error counts, not the mean square.
    """
    return (x.square().sum(-1) + delta * delta).sqrt() - delta


def sliced_wasserstein(z_BZ: Tensor, slices: int = 64) -> Tensor:
    """Squared sliced Wasserstein-2 distance between the latents (B, Z) and N(0, I), over random directions.

    Source: Kolouri et al., "Sliced Wasserstein Auto-Encoders" (ICLR 2019).
    """
    batch, latent = z_BZ.shape
    direction = torch.nn.functional.normalize(torch.randn(latent, slices, device=z_BZ.device), dim=0)
    level = (torch.arange(batch, device=z_BZ.device) + 0.5) / batch
    expected = math.sqrt(2.0) * torch.erfinv(2 * level - 1)
    return ((z_BZ @ direction).sort(dim=0).values - expected[:, None]).square().mean()


def orthonormality_penalty(raw_BJ6: Tensor) -> Tensor:
    """|A'A - I|^2 (B, 21) of each joint's six raw numbers as a matrix A (3, 2): 0 if its columns are orthonormal.

    Where a raw vector shrinks to nothing or both become parallel, Gram-Schmidt has a singularity, and second-order
    latent inverse kinematics gets stuck beside it.
    """
    first, second = raw_BJ6[..., :3], raw_BJ6[..., 3:]
    a, b, ab = first.square().sum(-1), second.square().sum(-1), (first * second).sum(-1)
    return (a - 1).square() + (b - 1).square() + 2 * ab.square()
