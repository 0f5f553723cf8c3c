"""What random chains are drawn with, in batches from a seed: tilted axes, offsets, limits, roles that are left out.

Legend: B chains, N = 8 joints, S = 5 slots, R roles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from mrhubo.universal.chains import Chains, random_units, rodrigues

JOINTS = 8
"""Most joints of a random chain."""
_STINGY, _GENEROUS = 0.2, 0.15
"""Shares of joints with a range much narrower, or wider, than is usual."""
_NARROWEST = 0.15
"""Half of the narrowest range [rad]."""
Ends = tuple[float | Tensor, float | Tensor]
"""Usual limits of a role [rad], of all chains or of each (B,)."""


class Draw:
    """Seeded draws for a batch."""

    def __init__(self, count: int, generator: torch.Generator) -> None:
        self.count, self.generator = count, generator

    def maybe(self, share: float) -> Tensor:
        """1 in that share of the rows (B,), else 0."""
        return (torch.rand(self.count, generator=self.generator) < share).float()

    def between(self, low: float, high: float) -> Tensor:
        """Numbers (B,) between two."""
        return low + (high - low) * torch.rand(self.count, generator=self.generator)

    def either(self, *choices: Tensor) -> Tensor:
        """One of several (X,) for each row: (B, X)."""
        which = torch.randint(len(choices), (self.count,), generator=self.generator)
        return torch.stack(choices)[which]

    def tilt(self, share: float, most: float) -> Tensor:
        """Rotations (B, 3, 3) about any axis by up to `most` [rad], in a share of the rows."""
        axis_B3 = random_units(self.count, generator=self.generator)
        return rodrigues(axis_B3, self.maybe(share) * self.between(0.0, most))

    def offset(self, share: float, spread: float) -> Tensor:
        """Vectors (B, 3), in a share of the rows not 0."""
        return self.maybe(share)[:, None] * spread * torch.randn(self.count, 3, generator=self.generator)


def limits(draw: Draw, usual: Sequence[Ends]) -> tuple[Tensor, Tensor]:
    """Lower and upper limits (B, R) [rad] about usual ones, which hold for the planned pose."""
    lowers, uppers = [], []
    for low, high in usual:
        middle_B = (low + high) / 2 + 0.35 * torch.randn(draw.count, generator=draw.generator)
        half_B = (high - low) / 2 * draw.between(0.7, 1.3)
        # Either sense of turn is usual, unless it is an elbow, whose axis says where it bends.
        stingy_B, generous_B = draw.maybe(_STINGY), draw.maybe(_GENEROUS)
        half_B = torch.where(
            generous_B > 0, draw.between(1.8, math.pi), half_B * (1 - stingy_B * draw.between(0.3, 0.8))
        )
        middle_B = middle_B + stingy_B * draw.between(-0.6, 0.6)
        half_B = half_B.clamp(_NARROWEST, math.pi)
        lowers.append(middle_B - half_B)
        uppers.append(middle_B + half_B)
    return torch.stack(lowers, dim=1), torch.stack(uppers, dim=1)


def packed(
    axis_BR3: Tensor, point_BR3: Tensor, there_BR: Tensor, lower_BR: Tensor, upper_BR: Tensor, start_BS3: Tensor,
    end_BS3: Tensor, start_role_BS: Tensor, end_role_BS: Tensor, filled_BS: Tensor, weight_S: Tensor,
) -> Chains:  # fmt: skip
    """Chains of the roles that are there, which move up; the axes are those that a file may give, of either sign."""
    count, roles = there_BR.shape
    place_BR = torch.argsort(1 - there_BR, dim=1, stable=True)[:, :JOINTS]
    if roles < JOINTS:
        place_BR = torch.nn.functional.pad(place_BR, (0, JOINTS - roles))
    number_BN = torch.arange(JOINTS).expand(count, -1)
    present_BN = (number_BN < there_BR.sum(1, keepdim=True)).float()
    row_B1 = torch.arange(count)[:, None]
    before_BX = torch.cat((torch.zeros(count, 1), there_BR.cumsum(1)), dim=1)  # joints there before each role
    start_body_BS, end_body_BS = (before_BX.gather(1, role_BS).long() for role_BS in (start_role_BS, end_role_BS))
    absent_BN = present_BN == 0
    return Chains(
        axis_BN3=axis_BR3[row_B1, place_BR] * present_BN[..., None],
        point_BN3=point_BR3[row_B1, place_BR] * present_BN[..., None],
        present_BN=present_BN,
        lower_BN=lower_BR[row_B1, place_BR].masked_fill(absent_BN, -1.0),
        upper_BN=upper_BR[row_B1, place_BR].masked_fill(absent_BN, 1.0),
        start_BS3=start_BS3,
        end_BS3=end_BS3,
        start_body_BS=start_body_BS,
        end_body_BS=end_body_BS,
        filled_BS=filled_BS.clone(),
        weight_BS=filled_BS * weight_S,
    )


def rotate(turn_B33: Tensor, vector_X3: Tensor) -> Tensor:
    """Vectors (B, 3) or (3,), turned."""
    return (turn_B33 @ vector_X3[..., None])[..., 0]


def blend(first_B: Tensor, one_B3: Tensor, other_B3: Tensor) -> Tensor:
    """The one (B, 3) where `first_B` is 1, else the other."""
    return torch.where(first_B[:, None] > 0, one_B3, other_B3)
