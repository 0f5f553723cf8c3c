"""The decoder of a body prior, a small network from the latent to six numbers per joint, and its derivatives.

Automatic differentiation gives the same derivatives; written out, they are several times faster, and only the outputs
that a problem looks at are computed.

Legend: B batch, Z latent numbers, E hidden units, J = 21 joints, U chosen joints. A shape that ends in B has the batch
last.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from mrhubo.body.skeleton import POSED_JOINT_NAMES

_JOINTS = len(POSED_JOINT_NAMES)


@dataclass(frozen=True)
class Activation:
    """An activation of hidden layers: its layer, and a function that gives value and slope of every number."""

    layer: type[nn.Module]
    value_and_slope: Callable[[Tensor], tuple[Tensor, Tensor]]


def _silu(x: Tensor) -> tuple[Tensor, Tensor]:
    s = torch.sigmoid(x)
    y = x * s
    return y, torch.addcmul(s, y, 1 - s)


def _leaky_relu(x: Tensor) -> tuple[Tensor, Tensor]:
    slope = torch.where(x > 0, 1.0, 0.01)
    return x * slope, slope


def _tanh(x: Tensor) -> tuple[Tensor, Tensor]:
    y = torch.tanh(x)
    return y, 1 - y.square()


ACTIVATIONS: dict[str, Activation] = {
    "silu": Activation(nn.SiLU, _silu),
    "leaky_relu": Activation(nn.LeakyReLU, _leaky_relu),
    "tanh": Activation(nn.Tanh, _tanh),
}
"""The activations that a body prior may have, by name."""


def mlp_layers(inputs: int, hidden: int, outputs: int, activation: str) -> list[nn.Module]:
    """Layers of a multilayer perceptron with two hidden layers; `activation` is one of ACTIVATIONS."""
    layer = ACTIVATIONS[activation].layer
    return [nn.Linear(inputs, hidden), layer(), nn.Linear(hidden, hidden), layer(), nn.Linear(hidden, outputs)]


class Decoder(nn.Sequential):
    """Latents (B, Z) -> six numbers per joint (B, 21, 6), two columns that Gram-Schmidt makes a rotation of.

    The network gives the difference from the identity rotation.
    """

    identity_F: Tensor

    def __init__(self, latent: int, hidden: int, activation: str) -> None:
        super().__init__(*mlp_layers(latent, hidden, 6 * _JOINTS, activation))
        self.latent, self.hidden, self.activation = latent, hidden, activation
        identity = torch.tensor([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).repeat(_JOINTS)
        self.register_buffer("identity_F", identity, persistent=False)

    def forward(self, z_BZ: Tensor) -> Tensor:
        """Six numbers per joint (B, 21, 6), not yet orthonormal, of latents (B, Z); differentiable."""
        return (super().forward(z_BZ) + self.identity_F).unflatten(-1, (_JOINTS, 6))

    @property
    def linear_layers(self) -> list[nn.Linear]:
        """The three matrix products, first to last."""
        return [layer for layer in self if isinstance(layer, nn.Linear)]


@dataclass(frozen=True)
class DecoderSlopes:
    """Slopes of both hidden layers' activations (E, B), which `JointDecoder.pullback` needs of a forward pass."""

    first_EB: Tensor
    second_EB: Tensor


class JointDecoder:
    """A decoder's outputs for some joints alone, with derivatives. It reads the decoder's weights when it is made."""

    def __init__(self, decoder: Decoder, joints: Sequence[int]) -> None:
        """`joints` are indices in JOINT_NAMES, without the pelvis."""
        self._value_and_slope = ACTIVATIONS[decoder.activation].value_and_slope
        self._first, self._second, self._last = decoder.linear_layers
        self._identity_F, self._latent = decoder.identity_F, decoder.latent
        rows = [6 * (joint - 1) + i for i in range(6) for joint in joints]
        self._rows_bias = (self._last.bias[rows] + decoder.identity_F[rows])[:, None].contiguous()
        self._rows = self._last.weight[rows].contiguous()

    def value_and_slopes(self, z_ZB: Tensor) -> tuple[Tensor, DecoderSlopes]:
        """Six numbers per joint (6, U, B) of latents (Z, B), and the slopes for `pullback`."""
        y1_EB, slope1_EB = self._value_and_slope(torch.addmm(self._first.bias[:, None], self._first.weight, z_ZB))
        y2_EB, slope2_EB = self._value_and_slope(torch.addmm(self._second.bias[:, None], self._second.weight, y1_EB))
        value_6UB = torch.addmm(self._rows_bias, self._rows, y2_EB).unflatten(0, (6, -1))
        return value_6UB, DecoderSlopes(slope1_EB, slope2_EB)

    def pullback(self, slopes: DecoderSlopes, gradient_6UB: Tensor, z_ZB: Tensor, z_weight: float) -> Tensor:
        """Gradient (Z, B) by the latents of a cost: `gradient_6UB` is its gradient by the six numbers per joint, and
        `z_weight` times `z_ZB` its gradient by the latents themselves.
        """
        gradient_EB = (self._rows.T @ gradient_6UB.flatten(0, 1)).mul_(slopes.second_EB)
        gradient_EB = (self._second.weight.T @ gradient_EB).mul_(slopes.first_EB)
        return torch.addmm(z_ZB, self._first.weight.T, gradient_EB, beta=z_weight)

    def value_and_jacobian(self, z_BZ: Tensor) -> tuple[Tensor, Tensor]:
        """Six numbers of all joints (B, 21, 6) of latents (B, Z), and the chosen joints' derivatives (B, Z, 6, U)."""
        batch = len(z_BZ)
        y1_BE, slope1_BE = self._value_and_slope(self._first(z_BZ))
        y2_BE, slope2_BE = self._value_and_slope(self._second(y1_BE))
        raw_BJ6 = (self._last(y2_BE) + self._identity_F).unflatten(-1, (-1, 6))
        jacobian_BZE = slope1_BE[:, None, :] * self._first.weight.T
        jacobian_BZE = (jacobian_BZE.flatten(0, 1) @ self._second.weight.T).unflatten(0, (batch, self._latent))
        jacobian_BZE = jacobian_BZE.mul_(slope2_BE[:, None, :])
        return raw_BJ6, (jacobian_BZE.flatten(0, 1) @ self._rows.T).view(batch, self._latent, 6, -1)
