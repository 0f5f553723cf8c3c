"""The two networks: human pose -> link orientations (pre), link orientations -> joint angles (post).

Legend: B batch, J input joints, F = 6 J input features, M robot links, N robot joints.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn.functional import gelu

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, Skeleton, joint_index
from mrhubo.errors import UserError

_BLOCK_SCALE = 0.5
"""Of a residual block's first weights, so that the sums of many start as small as those of few."""


class PoseFeatures(nn.Module):
    """What the network sees of a human pose: rotations of the input joints, 6D columns, local or relative to the
    chest.
    """

    def __init__(self, input_joints: Sequence[str], frame: str) -> None:
        super().__init__()
        self.input_joints, self.frame = tuple(input_joints), frame
        if not self.input_joints:
            raise UserError("model.input_joints: is empty; name at least one human joint")
        self._joints = [joint_index(name) for name in self.input_joints]
        if 0 in self._joints:
            raise UserError("model.input_joints: 'pelvis' is the root and has no rotation in a pose")
        self._chest = JOINT_NAMES.index("spine3")
        self.skeleton = Skeleton()

    @property
    def size(self) -> int:
        """F."""
        return 6 * len(self._joints)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """Features (B, F) of poses (B, 21, 6)."""
        if self.frame == "local":
            return pose_BJ6[:, [j - 1 for j in self._joints]].flatten(1)
        rotations = self.skeleton.global_rotations(rotation.sixd_to_matrix(pose_BJ6))
        chest = rotations[:, self._chest, None].transpose(-1, -2)
        return rotation.matrix_to_sixd(chest @ rotations[:, self._joints]).flatten(1)


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
        angles = torch.nan_to_num(self.unlimited(raw_BN.float()), nan=0.0)
        return torch.minimum(torch.maximum(angles, self.lower_N), self.upper_N)


class RetargetNetwork(nn.Module):
    """Pre- and post-network (two stages), or one network from pose to joints (one stage)."""

    def __init__(
        self,
        features: PoseFeatures,
        lower_N: Tensor,
        upper_N: Tensor,
        stages: int = 2,
        hidden: int = 512,
        layers: int = 2,
        bound_output: str = "tanh",
        residual: bool = True,
    ) -> None:
        super().__init__()
        self.features, self.stages, joints = features, stages, len(lower_N)
        links = 6 * joints
        net = ResidualMLP if residual else mlp
        self.pre = net(features.size, hidden, layers, links) if stages == 2 else None
        self.post = net(links if stages == 2 else features.size, hidden, layers, joints)
        self.limited = LimitedOutput(lower_N, upper_N, bound_output)

    def links(self, features_BF: Tensor) -> Tensor:
        """R^: predicted link orientations (B, 6 M), 6D columns, of a two-stage network."""
        if self.pre is None:
            raise RuntimeError("a one-stage network predicts no links")
        return self.pre(features_BF)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """Joint angles (B, N) [rad], inside the limits, of human poses (B, 21, 6)."""
        features = self.features(pose_BJ6)
        return self.limited(self.post(self.links(features) if self.pre is not None else features))
