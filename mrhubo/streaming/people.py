"""What a stream remembers of several people, and tells of them: tensors whose first axis is theirs.

Legend: B people.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, fields
from typing import Self

import torch
from torch import Tensor

from mrhubo.retargeter import RetargetResult


@dataclass(frozen=True)
class OfPeople:
    """Tensors of people, each a field."""

    def where(self, chosen_B: Tensor, other: Self) -> Self:
        """`other` for some people, this one for the rest."""

        def chosen(name: str) -> Tensor:
            mine, others = getattr(self, name), getattr(other, name)
            return torch.where(chosen_B.reshape(-1, *[1] * (mine.ndim - 1)), others, mine)

        return type(self)(**{field.name: chosen(field.name) for field in fields(self)})


def without_confidence(result: RetargetResult, chosen_B: Tensor) -> RetargetResult:
    """No confidence in those who are not seen."""
    return dataclasses.replace(
        result,
        confidence=torch.where(chosen_B, 0.0, result.confidence),
        branch_confidence=torch.where(chosen_B[:, None], 0.0, result.branch_confidence),
    )
