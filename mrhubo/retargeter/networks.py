"""The two networks: human pose -> link orientations (pre), link orientations -> joint angles (post).

Legend: B batch, I inputs, F numbers of all of them, M robot links, N robot joints.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import gelu

from mrhubo.fast.short_weights import rounded
from mrhubo.retargeter.features import DirectionFeatures, PoseFeatures

_BLOCK_SCALE = 0.5
"""Of a residual block's first weights, so that the sums of many start as small as those of few."""


def mlp(size_in: int, hidden: int, layers: int, size_out: int) -> nn.Sequential:
    """Linear layers with GELU between them; `layers` hidden ones of width `hidden`."""
    sizes = [size_in, *[hidden] * layers]
    body = [m for a, b in zip(sizes[:-1], sizes[1:], strict=True) for m in (nn.Linear(a, b), nn.GELU())]
    return nn.Sequential(*body, nn.Linear(sizes[-1], size_out))


class ResidualMLP(nn.Module):
    """The layers of `mlp`, each hidden one after the first added to what came in: x + linear(GELU(x)).

    He et al., "Identity Mappings in Deep Residual Networks" (ECCV 2016): activation first, nothing between the sums.
    With one hidden layer it is `mlp`.
    """

    def __init__(self, size_in: int, hidden: int, layers: int, size_out: int) -> None:
        super().__init__()
        self.first = nn.Linear(size_in, hidden)
        blocks = [nn.Linear(hidden, hidden) for _ in range(layers - 1)]
        with torch.no_grad():
            for block in blocks:
                block.weight *= _BLOCK_SCALE
        self.blocks = nn.ModuleList(blocks)
        self.last = nn.Linear(hidden, size_out)

    def forward(self, x_BI: Tensor) -> Tensor:
        """Outputs (B, size_out) of inputs (B, size_in)."""
        x = self.first(x_BI)
        for block in self.blocks:
            x = x + block(gelu(x))
        return self.last(gelu(x))


@dataclass(frozen=True)
class Branch:
    """A part of the robot that turns apart from the others, such as an arm."""

    inputs: tuple[int, ...]
    """Positions of what it sees among the inputs."""
    joints: tuple[int, ...]
    """Its robot joints, as columns of q."""
    hidden: int
    """Width of the hidden layers of its networks."""


class Branched(nn.Module):
    """A network for each branch, which sees and gives the columns of that branch alone."""

    def __init__(
        self,
        columns_in: Sequence[Sequence[int]],
        columns_out: Sequence[Sequence[int]],
        made: Sequence[nn.Module],
    ) -> None:
        super().__init__()
        self.columns_in, self.columns_out = columns_in, columns_out
        self.parts = nn.ModuleList(made)
        self._names = [f"_columns_{i}" for i in range(len(self.parts))]
        for name, columns in zip(self._names, columns_in, strict=True):
            self.register_buffer(name, torch.tensor(columns), persistent=False)
        order = torch.tensor([column for columns in columns_out for column in columns]).argsort()
        self.register_buffer("_order", order, persistent=False)

    def forward(self, x_BI: Tensor) -> Tensor:
        """Outputs (B, O) of inputs (B, I); O: the columns out of all branches together."""
        found = [
            part(x_BI.index_select(1, self.get_buffer(name)))
            for part, name in zip(self.parts, self._names, strict=True)
        ]
        return torch.cat(found, dim=1).index_select(1, self.get_buffer("_order"))


class LimitedOutput(nn.Module):
    """Keeps joint angles inside the limits, whatever comes in.

    `tanh` squashes the numbers that come in; `clamp` cuts off, and lets the training see the angles before the cut, so
    that an answer beyond the limit still feels a gradient.
    """

    lower_N: Tensor
    upper_N: Tensor

    def __init__(self, lower_N: Tensor, upper_N: Tensor, kind: str) -> None:
        super().__init__()
        self.kind = kind
        self.register_buffer("lower_N", lower_N.clone())
        self.register_buffer("upper_N", upper_N.clone())

    def unlimited(self, raw_BN: Tensor) -> Tensor:
        """Angles [rad] that the loss sees."""
        middle, half = (self.upper_N + self.lower_N) / 2, (self.upper_N - self.lower_N) / 2
        return middle + half * (torch.tanh(raw_BN) if self.kind == "tanh" else raw_BN)

    def forward(self, raw_BN: Tensor) -> Tensor:
        """Angles [rad] inside [lower, upper], also for NaN and infinite input."""
        return self.inside(self.unlimited(raw_BN.float()))

    def inside(self, angle_BN: Tensor) -> Tensor:
        """The nearest angles inside [lower, upper]; 0 for NaN, if that is inside."""
        return torch.minimum(torch.maximum(torch.nan_to_num(angle_BN, nan=0.0), self.lower_N), self.upper_N)


class JointNetwork(nn.Module):
    """Joint angles of what is seen of a human pose."""

    features: PoseFeatures
    limited: LimitedOutput

    @property
    def directed(self) -> bool:
        """Whether it sees directions alone, so that `of_directions` answers."""
        return isinstance(self.features, DirectionFeatures)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """Joint angles (B, N) [rad], inside the limits, of human poses (B, 21, 6)."""
        return self.joints(self.features(pose_BJ6))

    def of_directions(self, target_BD3: Tensor) -> Tensor:
        """The same of a human's directions (B, D, 3)."""
        assert isinstance(self.features, DirectionFeatures)
        return self.joints(self.features.of(target_BD3))

    def joints(self, features_BF: Tensor) -> Tensor:
        """Joint angles (B, N) [rad], inside the limits, of features (B, F)."""
        raise NotImplementedError


@dataclass(frozen=True)
class Piece:
    """What a branch has of the networks; it shares their weights."""

    inputs: Sequence[int]
    """Its columns of the features."""
    joints: Sequence[int]
    """Its joints, and so its links."""
    share: float
    """Of all joints."""
    pre: nn.Module | None
    post: nn.Module
    limited: LimitedOutput

    def weights(self) -> Iterator[nn.Parameter]:
        """Those of its networks."""
        for network in (self.pre, self.post):
            yield from () if network is None else network.parameters()


class RetargetNetwork(JointNetwork):
    """Pre- and post-network (two stages), or one network from pose to joints (one stage)."""

    def __init__(
        self,
        features: PoseFeatures,
        lower_N: Tensor,
        upper_N: Tensor,
        branches: Sequence[Branch],
        stages: int = 2,
        layers: int = 2,
        bound_output: str = "tanh",
        residual: bool = True,
    ) -> None:
        """Untrained networks.

        Args:
            features: what they see of a human pose.
            lower_N: lower joint limits [rad].
            upper_N: upper joint limits [rad].
            branches: a network for each of them; together they have every joint.
            stages: 2 = human -> links -> joints, 1 = human -> joints.
            layers: hidden layers.
            bound_output: `LimitedOutput`'s kind.
            residual: `ResidualMLP` in place of `mlp`.
        """
        super().__init__()
        self.features, self.stages = features, stages
        net = ResidualMLP if residual else mlp

        def branched(columns_in: list[list[int]], columns_out: list[list[int]]) -> Branched:
            sizes = zip(columns_in, branches, columns_out, strict=True)
            return Branched(columns_in, columns_out, [net(len(a), b.hidden, layers, len(c)) for a, b, c in sizes])

        inputs = [features.columns(b.inputs) for b in branches]
        links = [[6 * joint + i for joint in b.joints for i in range(6)] for b in branches]
        angles = [list(b.joints) for b in branches]
        self.pre = branched(inputs, links) if stages == 2 else None
        self.post = branched(links if stages == 2 else inputs, angles)
        self.limited = LimitedOutput(lower_N, upper_N, bound_output)

    def links(self, features_BF: Tensor) -> Tensor:
        """R^: predicted link orientations (B, 6 M), 6D columns, of a two-stage network."""
        if self.pre is None:
            raise RuntimeError("a one-stage network predicts no links")
        return self.pre(features_BF)

    def round_weights(self) -> None:
        """Rounds the weights of all layers to such that take 16 bits (`mrhubo.fast.short_weights`)."""
        with torch.no_grad():
            for layer in self.modules():
                if isinstance(layer, nn.Linear):
                    layer.weight.copy_(torch.from_numpy(rounded(layer.weight.cpu().numpy())))

    def hidden_weights(self) -> list[nn.Parameter]:
        """The matrices from one hidden layer to the next (H, H)."""
        found = []
        for network in self.modules():
            if isinstance(network, ResidualMLP):
                found += [block.weight for block in network.blocks if isinstance(block, nn.Linear)]
            elif isinstance(network, nn.Sequential):  # of `mlp`
                found += [layer.weight for layer in network if isinstance(layer, nn.Linear)][1:-1]
        return found

    def pieces(self) -> list[Piece]:
        """Its branches, each with networks of its own."""
        first, limited = self.pre or self.post, self.limited
        return [
            Piece(
                first.columns_in[i],
                joints,
                len(joints) / len(limited.lower_N),
                None if self.pre is None else self.pre.parts[i],
                self.post.parts[i],
                LimitedOutput(limited.lower_N[list(joints)], limited.upper_N[list(joints)], limited.kind),
            )
            for i, joints in enumerate(self.post.columns_out)
        ]

    def joints(self, features_BF: Tensor) -> Tensor:
        """Joint angles (B, N) [rad], inside the limits, of features (B, F)."""
        return self.limited(self.post(self.links(features_BF) if self.pre is not None else features_BF))
