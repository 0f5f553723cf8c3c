"""Blocks of joints that share no term of a cost: an arm, the other arm, the neck.

Legend: N joints, D directions, C blocks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import torch
from torch import Tensor, nn


def connected(sets: Iterable[Iterable[int]]) -> list[tuple[set[int], set[int]]]:
    """Joints that are coupled: of each block which of the sets it holds, and the union of those.

    Blocks come in the order of their first set; an empty set is in none.
    """
    blocks: list[tuple[set[int], set[int]]] = []
    for number, members in enumerate(sets):
        rows, joints = {number}, set(members)
        for block in [b for b in blocks if b[1] & joints]:
            rows, joints = rows | block[0], joints | block[1]
            blocks.remove(block)
        if joints:
            blocks.append((rows, joints))
    return sorted(blocks, key=lambda block: min(block[0]))


class Blocks(nn.Module):
    """Which joint, and which direction, is in which block."""

    block_N: Tensor
    """The block of each joint (N,)."""
    joints_NC: Tensor
    """1 where a joint is in a block."""
    directions_DC: Tensor
    """1 where a direction turns with the joints of a block."""

    def __init__(self, couplings: Sequence[Iterable[int]], joints: int, directions: int) -> None:
        """The blocks of a cost.

        Args:
            couplings: sets of joints that one summand of the cost depends on; first one for each direction, then any
                others, which together hold every joint.
            joints: N.
            directions: D.
        """
        super().__init__()
        blocks = connected(couplings)
        block_N = torch.tensor([next(c for c, (_, found) in enumerate(blocks) if n in found) for n in range(joints)])
        tensors = {
            "block_N": block_N,
            "joints_NC": torch.stack([block_N == c for c in range(len(blocks))], dim=1).float(),
            "directions_DC": torch.tensor([[float(d in rows) for rows, _ in blocks] for d in range(directions)]),
        }
        for name, tensor in tensors.items():
            self.register_buffer(name, tensor, persistent=False)
