"""What the networks see of a human pose.

Legend: B batch, I inputs, F numbers of all of them, D directions.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.skeleton import joint_index
from mrhubo.errors import UserError
from mrhubo.robot import BodyMap


class PoseFeatures(nn.Module):
    """What a network sees: a few numbers of each of several inputs."""

    names: tuple[str, ...]
    """The I inputs."""
    width: int
    """Numbers of each."""

    @property
    def size(self) -> int:
        """F."""
        return self.width * len(self.names)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """Features (B, F) of poses (B, 21, 6)."""
        raise NotImplementedError


class DirectionFeatures(PoseFeatures):
    """`BodyMap.human_directions`, of the parts that the robot moves: what the reference retargeter's cost reads.

    Files share the turns of an arm out differently among collar, shoulder, elbow and wrist, and the turns of a back
    among its joints. Where limbs, hands and head point is the same in all of them.
    """

    width = 3

    def __init__(self, body_map: BodyMap, directions: Sequence[int]) -> None:
        """`directions` are positions in those of the body map."""
        super().__init__()
        self.names = tuple(body_map.direction_names[i] for i in directions)
        self._shared = copy.deepcopy(body_map.shared)  # which goes where the network goes
        self.register_buffer("_columns", torch.tensor(list(directions)), persistent=False)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """As for `PoseFeatures`."""
        return self.of(self._shared.of_human(rotation.stack_columns(pose_BJ6)))

    def of(self, direction_BD3: Tensor) -> Tensor:
        """Features (B, F) of human directions (B, D, 3)."""
        return direction_BD3.index_select(1, self.get_buffer("_columns")).flatten(1)


class RotationFeatures(PoseFeatures):
    """Local rotations of some joints, 6D columns, as the paper's networks see them."""

    width = 6

    def __init__(self, joints: Sequence[str]) -> None:
        """`joints` are the human joints that are read.

        Raises:
            UserError: there is none, or one that has no rotation.
        """
        super().__init__()
        self.names = tuple(joints)
        if not self.names:
            raise UserError("model.input_joints: is empty; name at least one human joint")
        indices = [joint_index(name) for name in self.names]
        if 0 in indices:
            raise UserError("model.input_joints: 'pelvis' is the root and has no rotation in a pose")
        self.register_buffer("_rows", torch.tensor(indices) - 1, persistent=False)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """As for `PoseFeatures`."""
        return pose_BJ6.index_select(1, self.get_buffer("_rows")).flatten(1)
