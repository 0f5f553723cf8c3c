"""As `mrhubo.fast.plain.contact_steps`, where the reasons stand.

Legend: B frames, N joints, X pairs that are within reach in some frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.fast.plain.contact_steps import LEVEL, LITTLE, NEAR, SEARCHES, TINY, TURNS
from mrhubo.fast.plain.steps import FLOOR
from mrhubo.reference.terms import Quadratic


@dataclass(frozen=True)
class Contacts:
    """Pairs that are within reach, one entry each."""

    row_X: Tensor
    """Which frame,"""
    short_X: Tensor
    """the root of what it costs, negative where that is nothing: what it lacks of its clearance, weighted;"""
    rows_XN: Tensor
    """and how that changes with the joints [1/rad]."""

    def rows(self, keep_B: Tensor) -> Contacts:
        """Of some frames alone."""
        x = torch.nonzero(keep_B[self.row_X])[:, 0]
        return Contacts((keep_B.cumsum(0) - 1)[self.row_X[x]], self.short_X[x], self.rows_XN[x])

    def along(self, turn_BN: Tensor) -> Tensor:
        """How `short_X` changes with the joints' turn [rad], in the model."""
        return (self.rows_XN * turn_BN[self.row_X]).sum(dim=1)

    def sums(self, value_X: Tensor, frames: int) -> Tensor:
        """Of each frame (B,)."""
        return value_X.new_zeros(frames).index_add(0, self.row_X, value_X)

    def costs(self, short_X: Tensor, frames: int) -> Tensor:
        """What they cost each frame (B,), where they lack so much."""
        return self.sums(short_X.clamp(min=0).square(), frames)


def _within(bounds: tuple[Tensor, Tensor], at_BN: Tensor, turn_BN: Tensor, slope_BN: Tensor) -> Tensor:
    most_BN = torch.where(turn_BN > 0, bounds[1], bounds[0]) - at_BN
    over_BN = turn_BN.abs() > most_BN.abs()
    cut_BN = torch.where(over_BN, most_BN, turn_BN)
    free_BN = torch.where(over_BN & (most_BN == 0), 0.0, turn_BN)
    share_B = torch.where(over_BN & (most_BN != 0), most_BN / torch.where(over_BN, turn_BN, 1.0), 1.0).amin(dim=1)
    short_BN = free_BN * share_B[:, None]
    steeper_B = (slope_BN * (cut_BN - short_BN)).sum(dim=1) < 0
    return torch.where(steeper_B[:, None], cut_BN, short_BN)


def _share(begin_B: Tensor, bend_B: Tensor, level_B: Tensor, near: Contacts, lack_X: Tensor, along_X: Tensor) -> Tensor:
    low_B, high_B, share_B = torch.zeros_like(begin_B), torch.ones_like(begin_B), torch.ones_like(begin_B)
    for _ in range(SEARCHES):
        there_X = lack_X + along_X * share_B[near.row_X]
        pushed_X, square_X = along_X * there_X.clamp(min=0), along_X * along_X * (there_X > 0)
        slope_B = begin_B + bend_B * share_B + near.sums(pushed_X, len(begin_B))
        far_B = slope_B.abs() > level_B
        if not bool(far_B.any()):
            break
        low_B, high_B = torch.where(slope_B > 0, low_B, share_B), torch.where(slope_B > 0, share_B, high_B)
        guess_B = share_B - slope_B / (bend_B + near.sums(square_X, len(begin_B))).clamp(min=TINY)
        middle_B = torch.where(low_B < 1, (low_B + high_B) / 2, 1.0)
        guess_B = torch.where((guess_B > low_B) & (guess_B < high_B), guess_B, middle_B)
        share_B = torch.where(far_B, guess_B, share_B)
    return share_B


def foreseeing_step(
    bounds: tuple[Tensor, Tensor], q_BN: Tensor, model: Quadratic, damping_B: Tensor, near: Contacts
) -> tuple[Tensor, Tensor]:
    """Joint angles (B, N) [rad] after a step from `q_BN`, within the limits; and how much less the model costs there
    (B,), damping included. `model`: of what has no bend, all joints in one block. Each frame's numbers are the same in
    any batch, so nothing here is a product of batched matrices.
    """
    (lower_N, upper_N), frames, row_X = bounds, len(q_BN), near.row_X
    damped_BNN = model.hessian_BNN.clone()
    diagonal_BN = damped_BNN.diagonal(dim1=1, dim2=2)
    diagonal_BN.add_(damping_B[:, None] * (diagonal_BN + FLOOR))
    at_BN, lack_X, slope_BN = q_BN, near.short_X, model.gradient_BN
    going_B = torch.ones_like(damping_B, dtype=torch.bool)
    for _ in range(TURNS):
        whole_BN = slope_BN.index_add(0, row_X, lack_X.clamp(min=0)[:, None] * near.rows_XN)
        held_BN = ((at_BN <= lower_N) & (whole_BN > 0)) | ((at_BN >= upper_N) & (whole_BN < 0))
        free_BN, x = (~held_BN).to(q_BN), torch.nonzero(lack_X > 0)[:, 0]
        squares_XNN = near.rows_XN[x, :, None] * near.rows_XN[x, None, :]
        system_BNN = damped_BNN.index_add(0, row_X[x], squares_XNN) * (free_BN[:, :, None] * free_BN[:, None, :])
        system_BNN.diagonal(dim1=1, dim2=2).add_(held_BN)
        factor_BNN = torch.linalg.cholesky_ex(system_BNN).L
        turn_BN = -torch.cholesky_solve((whole_BN * free_BN)[..., None], factor_BNN)[..., 0]
        full_BN, turn_BN = turn_BN, _within(bounds, at_BN, turn_BN, whole_BN)
        bent_BN, along_X = (damped_BNN * turn_BN[:, None]).sum(dim=2), near.along(turn_BN)
        down_B = -(whole_BN * turn_BN).sum(dim=1)
        going_B = going_B & (down_B > LITTLE)
        begin_B, bend_B = (slope_BN * turn_BN).sum(dim=1), (bent_BN * turn_BN).sum(dim=1)
        share_B = torch.where(going_B, _share(begin_B, bend_B, LEVEL * down_B, near, lack_X, along_X), 0.0)
        next_X = lack_X + share_B[row_X] * along_X
        at_BN = at_BN + share_B[:, None] * turn_BN
        at_BN = torch.where(at_BN < lower_N + NEAR, lower_N, at_BN)
        at_BN = torch.where(at_BN > upper_N - NEAR, upper_N, at_BN)
        slope_BN = slope_BN + share_B[:, None] * bent_BN
        changed_B = near.sums(((next_X > 0) != (lack_X > 0)).to(q_BN), frames) > 0
        going_B = going_B & ((share_B < 1) | changed_B | ((turn_BN != full_BN) | held_BN).any(dim=1))
        lack_X = next_X
        if not bool(going_B.any()):
            break
    won_B = near.costs(near.short_X, frames) - near.costs(lack_X, frames)
    return at_BN, won_B - ((slope_BN + model.gradient_BN) * (at_BN - q_BN)).sum(dim=1)
