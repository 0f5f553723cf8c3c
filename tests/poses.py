"""Human poses to test with."""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.body import BodyPrior


def prior_poses(count: int, seed: int = 0) -> Tensor:
    """Local rotations (count, 21, 3, 3) of poses that the shipped body prior draws."""
    prior = BodyPrior.open()
    return prior.decode_matrices(torch.randn(count, prior.latent, generator=torch.Generator().manual_seed(seed)))
