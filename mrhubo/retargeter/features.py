"""What the networks see of a human pose.

Legend: B batch, I inputs, F features, D directions, P pairs of inputs, V views.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence

import torch
from torch import Tensor, nn
from torch.nn.functional import normalize

from mrhubo import rotation
from mrhubo.body.skeleton import joint_index
from mrhubo.errors import UserError
from mrhubo.robot import BodyMap
from mrhubo.robot.parts import BendPart, LimbPart

_LEAST_SPREAD = 0.05
"""Features that vary by less are not blown up to a spread of 1: what is left of them is noise."""


class PoseFeatures(nn.Module):
    """What a network sees: some numbers of several inputs."""

    names: tuple[str, ...]
    """The I inputs."""
    sources: tuple[frozenset[int], ...]
    """Of each of the F features the inputs that it is made of."""

    @property
    def size(self) -> int:
        """F."""
        return len(self.sources)

    def columns(self, inputs: Iterable[int]) -> list[int]:
        """The features that are made of some inputs alone."""
        seen = frozenset(inputs)
        return [i for i, made_of in enumerate(self.sources) if made_of <= seen]

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """Features (B, F) of poses (B, 21, 6)."""
        raise NotImplementedError

    def condition(self, feature_BF: Tensor) -> Tensor:
        """Learns from a sample of features (B, F) what to make of them, before a training; gives the sample anew."""
        return feature_BF


class DirectionFeatures(PoseFeatures):
    """`BodyMap.human_directions`, of the parts that the robot moves: what the reference retargeter's cost reads.

    Files share the turns of an arm out differently among collar, shoulder, elbow and wrist, and the turns of a back
    among its joints. Where limbs, hands and head point is the same in all of them.

    Beside the directions the networks see what follows from them and is hard to learn: about which axis an elbow bends
    (in full length, where the limbs alone tell it), the cosines of the angles between two directions of one branch, and
    all directions of a branch as seen from each of its limbs, in axes along the limb, along the bend axis, and at right
    angles to both. Joints far down an arm depend on these. Each feature is shifted and scaled to mean 0 and spread 1
    over the pairs.
    """

    center_F: Tensor
    scale_F: Tensor

    def __init__(self, body_map: BodyMap, groups: Sequence[Sequence[int]]) -> None:
        """`groups` are the directions of each branch, positions in those of the body map."""
        super().__init__()
        directions = sorted(i for group in groups for i in group)
        self.names = tuple(body_map.direction_names[i] for i in directions)
        self._shared = copy.deepcopy(body_map.shared)  # which goes where the network goes
        self._keep("columns_I", directions)
        parts = [body_map.directions[i].part for i in directions]
        limbs = {part.name: i for i, part in enumerate(parts) if isinstance(part, LimbPart)}
        own = sorted([directions.index(i) for i in sorted(group)] for group in groups)  # whatever the joints' order
        bends = [
            (i, *(limbs[name] for name in part.limbs))
            for i, part in enumerate(parts)
            if isinstance(part, BendPart) and limbs.keys() >= set(part.limbs)
        ]
        self._keep("bend_X", [bend for bend, _, _ in bends])
        self._keep("upper_X", [upper for _, upper, _ in bends])
        self._keep("lower_X", [lower for _, _, lower in bends])
        pairs = [(i, j) for group in own for i in group for j in group if i < j]
        views = [
            (limb, bend, i, {bend, *carried, i})
            for group in own
            for bend, *carried in bends
            if bend in group
            for limb in carried
            for i in group
        ]
        self._keep("first_P", [i for i, _ in pairs])
        self._keep("second_P", [j for _, j in pairs])
        self._keep("limb_V", [limb for limb, *_ in views])
        self._keep("axis_V", [bend for _, bend, *_ in views])
        self._keep("seen_V", [i for *_, i, _ in views])
        raw = [[{i}] * 3 for i in range(len(directions))]
        raw += [[set(bend)] * 3 for bend in bends]
        raw += [[set(pair)] for pair in pairs]
        raw += [[made_of] * 3 for *_, made_of in views]
        self.sources = tuple(frozenset(made_of) for several in raw for made_of in several)
        self.register_buffer("center_F", torch.zeros(self.size))
        self.register_buffer("scale_F", torch.ones(self.size))

    def _keep(self, name: str, places: Sequence[int]) -> None:
        self.register_buffer(f"_{name}", torch.tensor(list(places), dtype=torch.long), persistent=False)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """As for `PoseFeatures`."""
        return self.of(self._shared.of_human(rotation.stack_columns(pose_BJ6)))

    def of(self, direction_BD3: Tensor) -> Tensor:
        """Features (B, F) of human directions (B, D, 3)."""

        def rows(name: str) -> Tensor:
            return self.get_buffer(f"_{name}")

        vector_BI3 = direction_BD3.index_select(1, rows("columns_I"))
        bend_BX3 = self._bend_axes(vector_BI3)
        unit_BI3 = vector_BI3.index_copy(1, rows("bend_X"), bend_BX3)
        cosine_BP = (unit_BI3.index_select(1, rows("first_P")) * unit_BI3.index_select(1, rows("second_P"))).sum(-1)
        along_BV3, axis_BV3, seen_BV3 = (
            unit_BI3.index_select(1, rows(name)) for name in ("limb_V", "axis_V", "seen_V")
        )
        axis_BV3 = normalize(axis_BV3 - along_BV3 * (along_BV3 * axis_BV3).sum(-1, keepdim=True), dim=-1)
        views = (along_BV3, axis_BV3, torch.linalg.cross(along_BV3, axis_BV3))
        view_BV3 = torch.stack([(seen_BV3 * axis).sum(-1) for axis in views], dim=-1)
        feature_BF = torch.cat((vector_BI3.flatten(1), bend_BX3.flatten(1), cosine_BP, view_BV3.flatten(1)), dim=1)
        return (feature_BF - self.center_F) * self.scale_F

    def _bend_axes(self, vector_BI3: Tensor) -> Tensor:
        """The bend axes (B, X, 3) in full length: where they count less, the plane of the limbs tells them."""
        bend_BX3, upper_BX3, lower_BX3 = (
            vector_BI3.index_select(1, self.get_buffer(f"_{name}")) for name in ("bend_X", "upper_X", "lower_X")
        )
        plane_BX3 = normalize(torch.linalg.cross(upper_BX3, lower_BX3), dim=-1)
        return bend_BX3 + (1 - bend_BX3.norm(dim=-1, keepdim=True)).clamp_min(0.0) * plane_BX3

    def condition(self, feature_BF: Tensor) -> Tensor:
        """Mean 0 and spread 1 for each of the sample's features."""
        raw_BF = feature_BF / self.scale_F + self.center_F
        self.center_F.copy_(raw_BF.mean(dim=0))
        self.scale_F.copy_(1 / raw_BF.std(dim=0).clamp_min(_LEAST_SPREAD))
        return (raw_BF - self.center_F) * self.scale_F


class RotationFeatures(PoseFeatures):
    """Local rotations of some joints, 6D columns, as the paper's networks see them."""

    def __init__(self, joints: Sequence[str]) -> None:
        """`joints` are the human joints that are read.

        Raises:
            UserError: there is none, or one that has no rotation.
        """
        super().__init__()
        self.names = tuple(joints)
        self.sources = tuple(frozenset({i}) for i in range(len(self.names)) for _ in range(6))
        if not self.names:
            raise UserError("model.input_joints: is empty; name at least one human joint")
        indices = [joint_index(name) for name in self.names]
        if 0 in indices:
            raise UserError("model.input_joints: 'pelvis' is the root and has no rotation in a pose")
        self.register_buffer("_rows", torch.tensor(indices) - 1, persistent=False)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """As for `PoseFeatures`."""
        return pose_BJ6.index_select(1, self.get_buffer("_rows")).flatten(1)
