"""The decoder's derivatives against automatic differentiation, and the names under which its weights are kept."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from mrhubo.body import BodyPrior, VPoser
from mrhubo.body.decoder import ACTIVATIONS, Decoder, JointDecoder
from mrhubo.config import SHIPPED_PRIOR
from mrhubo.files.storage import read_tensors

JOINTS = [3, 9, 16, 18, 20]


def make(activation: str) -> tuple[Decoder, Tensor]:
    torch.manual_seed(0)
    decoder = Decoder(latent=8, hidden=24, activation=activation).double()
    return decoder.requires_grad_(False), torch.randn(5, 8, dtype=torch.double)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_chosen_joints_get_what_the_whole_decoder_gives_them(activation: str) -> None:
    decoder, z = make(activation)
    whole = decoder(z)
    assert whole.shape == (5, 21, 6)
    value_6UB, _ = JointDecoder(decoder, JOINTS).value_and_slopes(z.T)
    torch.testing.assert_close(value_6UB.permute(2, 1, 0), whole[:, [j - 1 for j in JOINTS]])


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_jacobian_agrees_with_autograd(activation: str) -> None:
    decoder, z = make(activation)
    raw_BJ6, jacobian_BZ6U = JointDecoder(decoder, JOINTS).value_and_jacobian(z)
    torch.testing.assert_close(raw_BJ6, decoder(z))
    chosen = [j - 1 for j in JOINTS]
    for i in range(len(z)):
        expected = torch.autograd.functional.jacobian(lambda v: decoder(v[None])[0, chosen], z[i])
        torch.testing.assert_close(jacobian_BZ6U[i].permute(2, 1, 0), expected)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_pullback_agrees_with_autograd(activation: str) -> None:
    decoder, z = make(activation)
    joints = JointDecoder(decoder, JOINTS)
    value_6UB, slopes = joints.value_and_slopes(z.T)
    gradient_6UB = torch.randn(value_6UB.shape, dtype=torch.double)
    z.requires_grad_()
    cost = (decoder(z)[:, [j - 1 for j in JOINTS]].permute(2, 1, 0) * gradient_6UB).sum() + 0.3 * z.square().sum()
    (expected,) = torch.autograd.grad(cost, z)
    found = joints.pullback(slopes, gradient_6UB, z.detach().T, 0.6)
    torch.testing.assert_close(found.T, expected)


def test_all_zero_weights_decode_to_the_identity() -> None:
    decoder, z = make("silu")
    for parameter in decoder.parameters():
        parameter.zero_()
    assert torch.equal(decoder(z), torch.tensor([1.0, 0, 0, 0, 1, 0], dtype=torch.double).expand(5, 21, 6))


def test_weights_are_kept_under_the_names_of_the_shipped_file() -> None:
    names = {f"decoder.{layer}.{part}" for layer in (0, 2, 4) for part in ("weight", "bias")}
    tensors, _ = read_tensors(SHIPPED_PRIOR)
    for kept in (tensors, BodyPrior().state_dict(), VPoser().state_dict()):
        assert {name for name in kept if name.startswith("decoder")} == names
    assert BodyPrior.open().checksum == "cf086068f9a2d4d8"
