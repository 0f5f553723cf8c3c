"""Terms of the prior's loss, at points where their value is known."""

from __future__ import annotations

import pytest
import torch

from mrhubo import rotation
from mrhubo.body.prior_training.losses import orthonormality_penalty, pseudo_huber, sliced_wasserstein


def test_pseudo_huber_is_quadratic_near_zero_and_straight_far_off() -> None:
    x = torch.tensor([[3.0, 4.0], [0.0, 0.0], [0.001, 0.0]], requires_grad=True)
    found = pseudo_huber(x, 0.02)
    assert found.detach().tolist() == pytest.approx([5 - 0.02, 0.0, 0.001**2 / 0.04], rel=1e-2, abs=1e-9)
    (gradient,) = torch.autograd.grad(found.sum(), x)
    assert bool(gradient.isfinite().all()) and float(gradient[1].abs().max()) == 0


def test_sliced_wasserstein_is_small_for_a_normal_sample_alone() -> None:
    torch.manual_seed(0)
    normal = torch.randn(4_000, 8)
    distances = [float(sliced_wasserstein(z, 200)) for z in (normal, 2 * normal, normal + 1, 0 * normal)]
    assert distances[0] < 0.01
    assert distances[1] == pytest.approx(1.0, rel=0.1), "(2 - 1)^2"
    assert distances[2] == pytest.approx(1.0, rel=0.15), "mean square of a unit shift, along a random direction"
    assert distances[3] == pytest.approx(1.0, rel=0.05), "E[x^2]"


def test_orthonormality_penalty_vanishes_for_rotations_and_grows_near_singularities() -> None:
    quaternion = torch.randn(10, 21, 4, generator=torch.Generator().manual_seed(0))
    sixd = rotation.matrix_to_sixd(rotation.quaternion_to_matrix(quaternion))
    assert float(orthonormality_penalty(sixd).max()) < 1e-10
    short = sixd.clone()
    short[..., :3] *= 0.1
    parallel = torch.cat((sixd[..., :3], sixd[..., :3]), dim=-1)
    assert float(orthonormality_penalty(short).min()) > 0.9 and float(orthonormality_penalty(parallel).min()) > 1.9
