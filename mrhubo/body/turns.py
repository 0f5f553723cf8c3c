"""How some joints of a human are turned, and no others: a fraction of the whole body's kinematics.

A robot asks frame by frame, and this is a good part of what an answer costs: two arms and a head hang on ten of the 21
joints, in four products of matrices instead of eight.

Legend: B batch, J = 21 posed joints, X asked joints, P joints on the way to them.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.skeleton import PARENTS, ancestors


class JointTurns(nn.Module):
    """Rotations of some joints, all relative to the lowest joint that is above them all (or is one of them)."""

    def __init__(self, joints: Sequence[int]) -> None:
        """`joints` are indices in JOINT_NAMES."""
        super().__init__()
        above = [set(ancestors(joint)) for joint in joints]
        top = max(set.intersection(*above), key=lambda joint: len(ancestors(joint)))
        inside = sorted(set.union(*above) - set(ancestors(top)))  # SMPL's order is by depth
        places = {joint: place for place, joint in enumerate((top, *inside))}
        depths = [len(ancestors(joint)) for joint in inside]
        self._keep("_rows", [joint - 1 for joint in inside])
        self._levels: list[tuple[int, int]] = []
        for level, depth in enumerate(sorted(set(depths))):
            members = [place for place, d in enumerate(depths) if d == depth]
            self._levels.append((members[0], members[-1] + 1))
            self._keep(f"_parents_{level}", [places[PARENTS[inside[place]]] for place in members])
        self._keep("_outputs", [places[joint] for joint in joints])

    def _keep(self, name: str, positions: list[int]) -> None:
        """A list of positions, where the module is."""
        self.register_buffer(name, torch.tensor(positions, dtype=torch.long), persistent=False)

    def forward(self, local_BJ33: Tensor) -> Tensor:
        """Rotations (B, X, 3, 3), of local rotations (B, 21, 3, 3) that rounding may have left a little oblique."""
        local_BP33 = rotation.orthonormal(local_BJ33.index_select(1, self.get_buffer("_rows")))
        done = torch.eye(3, dtype=local_BP33.dtype, device=local_BP33.device).expand(len(local_BP33), 1, 3, 3)
        for level, (start, end) in enumerate(self._levels):
            turned = local_BP33[:, start:end]
            if level:  # the first hang on the top
                turned = done.index_select(1, self.get_buffer(f"_parents_{level}")) @ turned
            done = torch.cat((done, turned), dim=1)
        return done.index_select(1, self.get_buffer("_outputs"))
