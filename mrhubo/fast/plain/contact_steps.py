"""Steps of frames whose collision shapes are near each other.

What a pair costs begins where it is nearer than its clearance, so the cost has a bend there, and a Gauss-Newton step
that knows only of the pairs beyond the bend runs into others, or further away from those than it need: such steps went
to and fro, and few ended within ten. A step here foresees all pairs within reach: it is the minimum of

    |J x + e|^2  +  x' D x  +  sum_k max(0, short_k + rows_k x)^2,      lower <= q + x <= upper

(J, e: directions and all else that has no bend; D: damping), which is convex. Newton's method finds it, whose Hessian
has the pairs that are beyond the bend at x; each of its turns goes as far as the sum falls. That a turn which is cut at
the limits still leads downhill where joints at a limit stay there: D. Bertsekas, Projected Newton Methods for
Optimization Problems with Simple Constraints (1982), SIAM J. Control and Optimization 20(2).

Legend: B frames, N joints, X pairs that are within reach in some frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.plain.steps import FLOOR, Model, diagonal
from mrhubo.fast.sections import Cost

REACH = 0.005
"""Pairs that are so much further apart than their clearance [m] are foreseen. Hardly any step goes further."""
TURNS, SEARCHES = 12, 10
"""Turns of Newton's method at most, and steps at most to where along one the sum is least."""
LITTLE, LEVEL, TINY = 1e-9, 1e-6, 1e-12
"""What a turn wins at least; and the share of its slope that is taken for none, or rounding would choose."""
NEAR = 1e-6
"""A joint that is so near to its limit [rad] is there, or rounding would choose."""


@dataclass(frozen=True)
class Contacts:
    """Pairs that are within reach, one entry each."""

    row_X: np.ndarray
    """Which frame,"""
    short_X: np.ndarray
    """the root of what it costs, negative where that is nothing: what it lacks of its clearance, weighted;"""
    rows_XN: np.ndarray
    """and how that changes with the joints [1/rad]."""

    def rows(self, keep_B: np.ndarray) -> Contacts:
        """Of some frames alone."""
        x = keep_B[self.row_X]
        return Contacts((np.cumsum(keep_B) - 1)[self.row_X[x]], self.short_X[x], self.rows_XN[x])

    def along(self, turn_BN: np.ndarray) -> np.ndarray:
        """How `short_X` changes with the joints' turn [rad], in the model."""
        return np.einsum("xn,xn->x", self.rows_XN, turn_BN[self.row_X])

    def sums(self, value_X: np.ndarray, frames: int) -> np.ndarray:
        """Of each frame (B,)."""
        return np.bincount(self.row_X, value_X, minlength=frames)

    def add_to(self, short_X: np.ndarray, gradient_BN: np.ndarray, hessian_BNN: np.ndarray) -> None:
        """Adds those that cost something, where they lack so much, to the halves of a gradient and a Hessian."""
        x = np.flatnonzero(short_X > 0)
        rows_XN = self.rows_XN[x]
        np.add.at(gradient_BN, self.row_X[x], short_X[x, None] * rows_XN)
        np.add.at(hessian_BNN, self.row_X[x], rows_XN[:, :, None] * rows_XN[:, None, :])

    def costs(self, short_X: np.ndarray, frames: int) -> np.ndarray:
        """What they cost each frame (B,), where they lack so much."""
        return self.sums(np.maximum(short_X, 0.0) ** 2, frames)


def _within(cost: Cost, at_BN: np.ndarray, turn_BN: np.ndarray, slope_BN: np.ndarray) -> np.ndarray:
    """A turn (B, N) [rad] that stays within the limits: each joint's is cut there, or all joints' together: what
    leads further downhill.
    """
    most_BN = np.where(turn_BN > 0, cost.upper_N, cost.lower_N) - at_BN
    over_BN = np.abs(turn_BN) > np.abs(most_BN)
    cut_BN = np.where(over_BN, most_BN, turn_BN)
    free_BN = np.where(over_BN & (most_BN == 0), 0.0, turn_BN)  # without those at a limit, it still leads downhill
    share_B = np.where(over_BN & (most_BN != 0), most_BN / np.where(over_BN, turn_BN, 1.0), 1.0).min(axis=1)
    short_BN = free_BN * share_B[:, None]
    steeper_B = (slope_BN * (cut_BN - short_BN)).sum(axis=1) < 0
    return np.where(steeper_B[:, None], cut_BN, short_BN)


def _share(
    begin_B: np.ndarray,
    bend_B: np.ndarray,
    level_B: np.ndarray,
    near: Contacts,
    lack_X: np.ndarray,
    along_X: np.ndarray,
) -> np.ndarray:
    """How much of a turn (B,), at most all of it, makes the sum least: where  begin + bend s + sum_k along_k
    max(0, lack_k + along_k s)  is 0, which rises with s and is piecewise straight. `level`: what is taken for 0.
    """
    frames, low_B, high_B, share_B = len(begin_B), np.zeros(len(begin_B)), np.ones(len(begin_B)), np.ones(len(begin_B))
    for _ in range(SEARCHES):
        there_X = lack_X + along_X * share_B[near.row_X]
        pushed_X, beyond_X = along_X * np.maximum(there_X, 0.0), there_X > 0
        slope_B = begin_B + bend_B * share_B + near.sums(pushed_X, frames)
        steep_B = bend_B + near.sums(np.where(beyond_X, along_X * along_X, 0.0), frames)
        far_B = np.abs(slope_B) > level_B
        if not far_B.any():
            break
        low_B, high_B = np.where(slope_B > 0, low_B, share_B), np.where(slope_B > 0, share_B, high_B)
        guess_B = share_B - slope_B / np.maximum(steep_B, TINY)
        inside_B = (guess_B > low_B) & (guess_B < high_B)
        guess_B = np.where(inside_B, guess_B, np.where(low_B < 1, (low_B + high_B) / 2, 1.0))
        share_B = np.where(far_B, guess_B, share_B)
    return share_B


def foreseeing_step(
    cost: Cost, q_BN: np.ndarray, model: Model, damping_B: np.ndarray, near: Contacts
) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles (B, N) [rad] after the step above from `q_BN`, within the limits; and how much less the model costs
    there (B,), damping included. `model`: of what has no bend, all joints in one block.
    """
    frames, row_X = len(q_BN), near.row_X
    damped_BNN = model.hessian_BNN.copy()
    diagonal(damped_BNN)[:] += damping_B[:, None] * (diagonal(model.hessian_BNN) + FLOOR)
    at_BN, lack_X, slope_BN = q_BN, near.short_X, model.gradient_BN  # the slope of what has no bend
    going_B = np.ones(frames, bool)
    for _ in range(TURNS):
        whole_BN, system_BNN = slope_BN.copy(), damped_BNN.copy()
        near.add_to(lack_X, whole_BN, system_BNN)
        held_BN = ((at_BN <= cost.lower_N) & (whole_BN > 0)) | ((at_BN >= cost.upper_N) & (whole_BN < 0))
        free_BN = 1.0 - held_BN
        system_BNN *= free_BN[:, :, None] * free_BN[:, None, :]
        diagonal(system_BNN)[:] += held_BN
        turn_BN = -np.linalg.solve(system_BNN, (whole_BN * free_BN)[..., None])[..., 0]
        full_BN, turn_BN = turn_BN, _within(cost, at_BN, turn_BN, whole_BN)
        bent_BN, along_X = np.einsum("bnm,bm->bn", damped_BNN, turn_BN), near.along(turn_BN)
        down_B = -(whole_BN * turn_BN).sum(axis=1)
        going_B &= down_B > LITTLE
        begin_B, bend_B = (slope_BN * turn_BN).sum(axis=1), (bent_BN * turn_BN).sum(axis=1)
        share_B = np.where(going_B, _share(begin_B, bend_B, LEVEL * down_B, near, lack_X, along_X), 0.0)
        next_X = lack_X + share_B[row_X] * along_X
        at_BN = at_BN + share_B[:, None] * turn_BN
        at_BN = np.where(at_BN < cost.lower_N + NEAR, cost.lower_N, at_BN)
        at_BN = np.where(at_BN > cost.upper_N - NEAR, cost.upper_N, at_BN)
        slope_BN = slope_BN + share_B[:, None] * bent_BN
        changed_B = near.sums((next_X > 0) != (lack_X > 0), frames) > 0
        going_B &= (share_B < 1) | changed_B | ((turn_BN != full_BN) | held_BN).any(axis=1)
        lack_X = next_X
        if not going_B.any():
            break
    moved_BN = at_BN - q_BN
    won_B = near.costs(near.short_X, frames) - near.costs(lack_X, frames)
    return at_BN, won_B - ((slope_BN + model.gradient_BN) * moved_BN).sum(axis=1)
