"""What the networks see of a human pose.

Legend: B batch, J input joints, F = 6 J input features, C joints whose local rotations the features need.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, PARENTS, ancestors, joint_index
from mrhubo.errors import UserError

_CHEST = JOINT_NAMES.index("spine3")


class PoseFeatures(nn.Module):
    """Rotations of the input joints, 6D columns, local or relative to the chest.

    Only the joints on the way from the chest to the input joints are turned: for two arms and a head ten of 21, in four
    products instead of eight. A robot asks frame by frame, and this is the greater part of what an answer costs.
    """

    def __init__(self, input_joints: Sequence[str], frame: str) -> None:
        super().__init__()
        self.input_joints, self.frame = tuple(input_joints), frame
        if not self.input_joints:
            raise UserError("model.input_joints: is empty; name at least one human joint")
        self._joints = [joint_index(name) for name in self.input_joints]
        if 0 in self._joints:
            raise UserError("model.input_joints: 'pelvis' is the root and has no rotation in a pose")
        if frame == "local":
            self._keep("_rows", [joint - 1 for joint in self._joints])
        else:
            self._prepare_chest()

    def _keep(self, name: str, positions: list[int]) -> None:
        """A list of positions, where the network is."""
        self.register_buffer(name, torch.tensor(positions, dtype=torch.long), persistent=False)

    def _prepare_chest(self) -> None:
        """The tree of the joints that matter; its top, the lowest joint above them all and the chest, cancels out."""
        above = [set(ancestors(joint)) for joint in (_CHEST, *self._joints)]
        top = max(set.intersection(*above), key=lambda joint: len(ancestors(joint)))
        joints = sorted(set.union(*above) - set(ancestors(top)))  # SMPL's order is by depth
        self._keep("_rows", [joint - 1 for joint in joints])
        places = {joint: place for place, joint in enumerate((top, *joints))}
        depths = [len(ancestors(joint)) for joint in joints]
        self._levels: list[tuple[int, int]] = []
        for level, depth in enumerate(sorted(set(depths))):
            members = [place for place, d in enumerate(depths) if d == depth]
            self._levels.append((members[0], members[-1] + 1))
            self._keep(f"_parents_{level}", [places[PARENTS[joints[place]]] for place in members])
        self._keep("_outputs", [places[joint] for joint in self._joints])
        self._chest = places[_CHEST]

    @property
    def size(self) -> int:
        """F."""
        return 6 * len(self._joints)

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """Features (B, F) of poses (B, 21, 6)."""
        numbers_BC6 = pose_BJ6.index_select(1, self.get_buffer("_rows"))
        if self.frame == "local":
            return numbers_BC6.flatten(1)
        local_BC33 = rotation.sixd_to_matrix(numbers_BC6)
        done = torch.eye(3, dtype=local_BC33.dtype, device=local_BC33.device).expand(len(local_BC33), 1, 3, 3)
        for level, (start, end) in enumerate(self._levels):
            turned = local_BC33[:, start:end]
            if level:  # the first hang on the top
                turned = done.index_select(1, self.get_buffer(f"_parents_{level}")) @ turned
            done = torch.cat((done, turned), dim=1)
        found = done.index_select(1, self.get_buffer("_outputs"))
        if self._chest:
            found = done[:, self._chest, None].mT @ found
        return rotation.matrix_to_sixd(found).flatten(1)
