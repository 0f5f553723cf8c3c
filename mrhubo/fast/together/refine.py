"""All frames of a motion refined together, as `mrhubo.reference.refine` does it, where the reasons stand.

Legend: T frames, X some of them, D directions, N joints, C blocks, M joints of one block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.masks import stretches, widen
from mrhubo.fast.plain.steps import Model, diagonal
from mrhubo.fast.side_by_side import side_by_side
from mrhubo.fast.together.banded import Banded
from mrhubo.fast.together.bounded import bounded_minimum
from mrhubo.fast.together.bounds import Bounds
from mrhubo.fast.together.problem import Problem
from mrhubo.fast.together.smoothness import Smoothness

PATIENCE = 6
"""Steps in a row that are of no use, after which a block ends."""
DAMPING, EASIER, HARDER, LEAST, MOST, FLOOR = 1e-3, 0.1, 10.0, 1e-3, 1e6, 0.01
"""Damping at first; its factors after a step that helped and one that did not; its bounds; and what is added to the
diagonal that it multiplies: that of the frames' own cost, for smoothness weighs far more on each frame alone than on
frames that move together."""
ROUNDING, LEVEL = 1e-6, 0.5
"""Where a step changes a cost by no more than this share of it, which is what rounding may add in float32, its slope
tells whether the step helped: at its end at most this share of what it was at its beginning, the other way (the
"approximate Wolfe conditions" of W. W. Hager, H. Zhang, "A new conjugate gradient method with guaranteed descent and an
efficient line search", SIAM Journal on Optimization, 2005)."""


def refine(
    problem: Problem,
    q_TN: np.ndarray,
    target_TD3: np.ndarray,
    smoothness: Smoothness,
    sweeps: int,
    tolerance: float,
    fixed_T: np.ndarray,
    step_N: np.ndarray | None = None,
    blocks_C: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """A local minimum (T, N) [rad] of the motion's cost from angles inside the limits, and each block's cost (C,).
    `step_N` bounds how far joints turn from one frame to the next [rad], and `blocks_C` (C,) are the blocks that may
    move; None: nothing bounds them, and all may.
    """
    cost = problem.cost
    model = _motion_model(problem, q_TN, target_TD3, smoothness)
    cost_C, damping_TC = model.frames.cost_BC.sum(axis=0), np.full_like(model.frames.cost_BC, DAMPING)
    failures_C = np.zeros(len(cost_C), int) if blocks_C is None else np.where(blocks_C, 0, PATIENCE)
    for _ in range(sweeps):
        running_C = failures_C < PATIENCE
        step_TN = _motion_step(problem, q_TN, model, damping_TC, running_C, smoothness, fixed_T, step_N)
        trial_TN = np.clip(q_TN + step_TN, cost.lower_N, cost.upper_N)
        trial_TN = np.where(running_C[cost.block_N], trial_TN, q_TN)
        trial = _motion_model(problem, trial_TN, target_TD3, smoothness)
        trial_cost_C = trial.frames.cost_BC.sum(axis=0)
        moved_TN = trial_TN - q_TN
        slope_C, end_C = (
            (around.frames.gradient_BN * moved_TN).sum(axis=0) @ cost.joints_NC for around in (model, trial)
        )
        better_C = (trial_cost_C < cost_C) | ((trial_cost_C < cost_C * (1 + ROUNDING)) & (end_C < -LEVEL * slope_C))
        settled_C = better_C & ((np.abs(moved_TN).max(axis=0)[:, None] * cost.joints_NC).max(axis=0) < tolerance)
        failures_C = np.where(better_C, np.where(settled_C, PATIENCE, 0), failures_C + 1)
        factor_TC = np.where(trial.frames.cost_BC > model.frames.cost_BC, HARDER, np.where(better_C, EASIER, 1.0))
        damping_TC = np.clip(damping_TC * factor_TC, LEAST, MOST)
        q_TN = np.where(better_C[cost.block_N], trial_TN, q_TN)
        cost_C = np.where(better_C, trial_cost_C, cost_C)
        model = model.where(better_C, cost.block_N, trial)
        if (failures_C >= PATIENCE).all():
            break
    return q_TN, cost_C


def motion_cost(problem: Problem, q_TN: np.ndarray, target_TD3: np.ndarray, smoothness: Smoothness) -> np.ndarray:
    """What each block of joints costs (C,) in a motion (T, N) [rad]."""
    return _motion_model(problem, q_TN, target_TD3, smoothness).frames.cost_BC.sum(axis=0)


def refine_around(
    problem: Problem,
    q_TN: np.ndarray,
    target_TD3: np.ndarray,
    smoothness: Smoothness,
    free_T: np.ndarray,
    sweeps: int,
    tolerance: float,
    step_N: np.ndarray | None = None,
    blocks_C: np.ndarray | None = None,
) -> np.ndarray:
    """`refine` of some blocks (C,), or all, for the frames in `free_T` (T,), with a bound or none; the others stay."""
    found_TN = q_TN.copy()

    def work(used: slice) -> None:
        near = smoothness.at(np.arange(used.start, used.stop))
        found_TN[used], _ = refine(
            problem, q_TN[used], target_TD3[used], near, sweeps, tolerance, ~free_T[used], step_N, blocks_C
        )

    # The longest first, so that none is left to one thread at the end.
    side_by_side(work, sorted(stretches(widen(free_T, smoothness.reach)), key=lambda used: used.start - used.stop))
    return found_TN


@dataclass(frozen=True)
class _MotionModel:
    """The model of a motion around some joint angles."""

    frames: Model
    """Of each frame, with what couples it to others in gradients and in costs."""
    jacobian_TD3N: np.ndarray | None
    """How its directions turn [1/rad]; None where their jerk costs nothing."""

    def where(self, better_C: np.ndarray, block_N: np.ndarray, other: _MotionModel) -> _MotionModel:
        """`other` in the blocks that are better."""
        frames = self.frames.where(np.broadcast_to(better_C, self.frames.cost_BC.shape), block_N, other.frames)
        if self.jacobian_TD3N is None or other.jacobian_TD3N is None:
            return _MotionModel(frames, None)
        return _MotionModel(frames, np.where(better_C[block_N], other.jacobian_TD3N, self.jacobian_TD3N))


def _motion_model(problem: Problem, q_TN: np.ndarray, target_TD3: np.ndarray, smoothness: Smoothness) -> _MotionModel:
    model, jacobian_TD3N = problem.quadratic(q_TN, target_TD3), None
    model.cost_BC += smoothness.costs(q_TN, problem.cost.joints_NC)
    model.gradient_BN += smoothness.gradient(q_TN)
    if smoothness.directions is not None and len(q_TN) > smoothness.reach:
        direction_TD3, jacobian_TD3N = problem.directions(q_TN)
        model.cost_BC += smoothness.directions.costs(direction_TD3, problem.cost.directions_DC)
        model.gradient_BN += smoothness.directions.gradient(direction_TD3, jacobian_TD3N)
    return _MotionModel(model, jacobian_TD3N)


def _motion_step(
    problem: Problem,
    q_TN: np.ndarray,
    model: _MotionModel,
    damping_TC: np.ndarray,
    running_C: np.ndarray,
    smoothness: Smoothness,
    fixed_T: np.ndarray,
    step_N: np.ndarray | None,
) -> np.ndarray:
    """Damped Gauss-Newton step (T, N) [rad] of the motion's free joints, block by block."""
    cost, free_T = problem.cost, ~fixed_T
    right_TN = -model.frames.gradient_BN * free_T[:, None]
    own_TN, bands, step_TN = diagonal(model.frames.hessian_BNN), smoothness.hessian(q_TN), np.zeros_like(q_TN)

    def work(block: int) -> None:
        joints_M = np.flatnonzero(cost.block_N == block)
        entries = _coupled(model, smoothness, np.flatnonzero(cost.block_D == block), joints_M, bands)
        within_TMM, *couplings_TMM = (
            entry * (free_T[lag:] & free_T[: len(free_T) - lag])[:, None, None] for lag, entry in enumerate(entries)
        )
        extra_TM = damping_TC[:, block, None] * (own_TN[:, joints_M] + FLOOR)
        diagonal_TM = np.where(free_T[:, None], diagonal(entries[0]) + extra_TM, 1.0)
        system = Banded(within_TMM, diagonal_TM, couplings_TMM)
        bounds = _bounds(cost.lower_N - q_TN, cost.upper_N - q_TN, free_T, step_N, q_TN, joints_M)
        step_TN[:, joints_M] = bounded_minimum(system, right_TN[:, joints_M], bounds, problem.factor)

    side_by_side(work, np.flatnonzero(running_C).tolist())
    return step_TN


def _coupled(
    model: _MotionModel, smoothness: Smoothness, columns_E: np.ndarray, joints_M: np.ndarray, bands: list[np.ndarray]
) -> list[np.ndarray]:
    """Half of a block's Hessian: entries within a frame (T, M, M), and those between frames (T - 1, M, M), (T - 2, M,
    M) ...
    """
    if smoothness.directions is not None and model.jacobian_TD3N is not None:
        entries = smoothness.directions.hessian(model.jacobian_TD3N[:, columns_E][..., joints_M], columns_E)
    else:
        entries = [np.zeros((len(band_XN), len(joints_M), len(joints_M))) for band_XN in bands]
    entries[0] += model.frames.hessian_BNN[:, joints_M[:, None], joints_M]
    for entry_XMM, band_XN in zip(entries, bands, strict=True):
        diagonal(entry_XMM)[:] += band_XN[:, joints_M]
    return entries


def _bounds(
    down_TN: np.ndarray,
    up_TN: np.ndarray,
    free_T: np.ndarray,
    step_N: np.ndarray | None,
    q_TN: np.ndarray,
    joints_M: np.ndarray,
) -> Bounds:
    moves_2TM = np.stack((down_TN[:, joints_M], up_TN[:, joints_M]))
    if step_N is None:
        return Bounds.of(moves_2TM, free_T)
    moved_XM, most_M = np.diff(q_TN[:, joints_M], axis=0), step_N[joints_M]
    steps_2XM = np.stack((-most_M - moved_XM, most_M - moved_XM))
    return Bounds.of(moves_2TM, free_T, steps_2XM, free_T[1:] | free_T[:-1])
