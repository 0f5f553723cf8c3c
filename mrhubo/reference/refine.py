"""All frames of a motion refined together: Gauss-Newton on every frame's cost and on what couples the frames.

Blocks of joints (see `solve`) share no term, so each has a system, a damping and accepted steps of its own.

Legend: T frames, D directions, N joints, C blocks, M joints of one block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from mrhubo.fast.masks import stretches
from mrhubo.fast.together.banded import Banded
from mrhubo.fast.together.bounded import bounded_minimum
from mrhubo.fast.together.bounds import Bounds
from mrhubo.fast.together.refine import (
    DAMPING,
    EASIER,
    FLOOR,
    HARDER,
    LEAST,
    LEVEL,
    MOST,
    PATIENCE,
    ROUNDING,
)
from mrhubo.reference.banded import factor
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.terms import Quadratic, Smoothness


def refine(
    problem: DirectionProblem,
    q_TN: Tensor,
    target_TD3: Tensor,
    smoothness: Smoothness,
    sweeps: int = 100,
    tolerance: float = 3e-4,
    fixed_T: Tensor | None = None,
    step_N: Tensor | None = None,
    blocks_C: Tensor | None = None,
) -> tuple[Tensor, Tensor]:
    """A local minimum (T, N) [rad] of the motion's cost from angles inside the limits, and each block's cost (C,).

    Gauss-Newton on all frames at once: the system is banded, and limits hold a step while it is found. A block's step
    counts only if the block's cost falls (or, where rounding hides that, its slope); damping, in units of what the
    frame's own cost curves by, is raised in the frames whose own share of the cost rose, and lowered in the others if
    the step counted. A block ends when a step turns none of its joints by `tolerance` [rad], or six steps in a row were
    of no use. Frames in `fixed_T` (T,) stay as they are.

    With a bound `step_N` of how far joints turn from one frame to the next [rad], which the given angles keep to, so do
    the found ones, but for 1e-5 rad. `blocks_C` (C,) are the blocks that may move; None: all.
    """
    model = _motion_model(problem, q_TN, target_TD3, smoothness)
    cost_C = model.frames.cost_BC.double().sum(0)
    damping_TC = torch.full_like(model.frames.cost_BC, DAMPING)
    failures_C, joints_NC = torch.zeros_like(cost_C), problem.blocks.joints_NC.double()
    if blocks_C is not None:
        failures_C = failures_C.masked_fill(~blocks_C, PATIENCE)
    for _ in range(sweeps):
        running_C = failures_C < PATIENCE
        trial_TN = q_TN + _motion_step(problem, q_TN, model, damping_TC, running_C, smoothness, fixed_T, step_N)
        trial_TN = torch.clamp(trial_TN, problem.lower_N, problem.upper_N)
        trial_TN = torch.where(running_C[problem.blocks.block_N], trial_TN, q_TN)
        trial = _motion_model(problem, trial_TN, target_TD3, smoothness)
        trial_cost_C = trial.frames.cost_BC.double().sum(0)
        moved_TN = trial_TN - q_TN
        slope_C, end_C = (
            (around.frames.gradient_BN * moved_TN).double().sum(0) @ joints_NC for around in (model, trial)
        )
        better_C = (trial_cost_C < cost_C) | ((trial_cost_C < cost_C * (1 + ROUNDING)) & (end_C < -LEVEL * slope_C))
        moved_C = (moved_TN.abs()[..., None] * problem.blocks.joints_NC).amax(dim=(0, 1))
        settled_C = better_C & (moved_C < tolerance)
        failures_C = torch.where(better_C, torch.where(settled_C, PATIENCE, 0), failures_C + 1)
        factor_TC = torch.where(trial.frames.cost_BC > model.frames.cost_BC, HARDER, torch.where(better_C, EASIER, 1.0))
        damping_TC = (damping_TC * factor_TC).clamp(LEAST, MOST)
        q_TN = torch.where(better_C[problem.blocks.block_N], trial_TN, q_TN)
        cost_C = torch.where(better_C, trial_cost_C, cost_C)
        model = model.where(better_C, problem.blocks.block_N, trial)
        if bool((failures_C >= PATIENCE).all()):
            break
    return q_TN, cost_C


def refine_around(
    problem: DirectionProblem,
    q_TN: Tensor,
    target_TD3: Tensor,
    smoothness: Smoothness,
    free_T: Tensor,
    sweeps: int,
    tolerance: float,
    step_N: Tensor | None = None,
    blocks_C: Tensor | None = None,
) -> Tensor:
    """`refine` for the frames in `free_T` (T,); the others stay.

    Of a stretch of frames that stay, only those next to the others matter to them. So each stretch of free frames is
    refined by itself, with those: what has nothing to do with each other converges at its own pace.
    """
    used_T, found_TN = widen(free_T, smoothness.reach), q_TN.clone()
    for used in stretches(used_T.cpu().numpy()):
        near = smoothness.at(torch.arange(used.start, used.stop, device=q_TN.device))
        found_TN[used], _ = refine(
            problem, q_TN[used], target_TD3[used], near, sweeps, tolerance, ~free_T[used], step_N, blocks_C
        )
    return found_TN


def widen(mask_T: Tensor, frames: int) -> Tensor:
    """Frames (T,) that are so many or fewer away from one in the mask."""
    return torch.nn.functional.max_pool1d(mask_T[None].float(), 2 * frames + 1, 1, frames)[0] > 0


def motion_cost(problem: DirectionProblem, q_TN: Tensor, target_TD3: Tensor, smoothness: Smoothness) -> Tensor:
    """What each block of joints costs (C,) in a motion (T, N) [rad]."""
    return _motion_model(problem, q_TN, target_TD3, smoothness).frames.cost_BC.double().sum(0)


@dataclass(frozen=True)
class _MotionModel:
    """The model of a motion around some joint angles."""

    frames: Quadratic
    """Of each frame, with what couples it to others in gradients and in costs."""
    jacobian_TD3N: Tensor | None
    """How its directions turn [1/rad]; None where their jerk costs nothing."""

    def where(self, better_C: Tensor, block_N: Tensor, other: _MotionModel) -> _MotionModel:
        """`other` in the blocks that are better."""
        jacobian_TD3N = other.jacobian_TD3N
        if self.jacobian_TD3N is not None and jacobian_TD3N is not None:
            jacobian_TD3N = torch.where(better_C[block_N], jacobian_TD3N, self.jacobian_TD3N)
        return _MotionModel(self.frames.where(better_C, block_N, other.frames), jacobian_TD3N)


def _motion_model(problem: DirectionProblem, q_TN: Tensor, target_TD3: Tensor, smoothness: Smoothness) -> _MotionModel:
    chunks = zip(q_TN.split(problem.chunk), target_TD3.split(problem.chunk), strict=True)
    states = [problem.state(*chunk) for chunk in chunks]
    parts, jacobian_TD3N = [problem.quadratic_at(s) for s in states], None
    cost_TC = torch.cat([part.cost_BC for part in parts]) + smoothness.costs(q_TN, problem.blocks.joints_NC)
    gradient_TN = torch.cat([part.gradient_BN for part in parts]) + smoothness.gradient(q_TN)
    if smoothness.directions is not None and len(q_TN) > smoothness.reach:
        direction_TD3 = torch.cat([s.direction_BD3 for s in states])
        jacobian_TD3N = torch.cat([s.jacobian_BD3N for s in states])
        cost_TC = cost_TC + smoothness.directions.costs(direction_TD3, problem.blocks.directions_DC)
        gradient_TN = gradient_TN + smoothness.directions.gradient(direction_TD3, jacobian_TD3N)
    hessian_TNN = torch.cat([part.hessian_BNN for part in parts])
    return _MotionModel(Quadratic(cost_TC, gradient_TN, hessian_TNN), jacobian_TD3N)


def _motion_step(
    problem: DirectionProblem,
    q_TN: Tensor,
    model: _MotionModel,
    damping_TC: Tensor,
    running_C: Tensor,
    smoothness: Smoothness,
    fixed_T: Tensor | None,
    step_N: Tensor | None,
) -> Tensor:
    """Damped Gauss-Newton step (T, N) [rad] of the motion's free joints, block by block."""
    free_T = torch.ones_like(q_TN[:, 0], dtype=torch.bool) if fixed_T is None else ~fixed_T
    right_TN = -model.frames.gradient_BN * free_T[:, None]
    own_TN = model.frames.hessian_BNN.diagonal(dim1=-2, dim2=-1)
    bands, step_TN = smoothness.hessian(q_TN), torch.zeros_like(q_TN)
    for block, running in enumerate(running_C.tolist()):
        if running:
            joints_M = torch.nonzero(problem.blocks.block_N == block)[:, 0]
            entries = _coupled(problem, model, smoothness, block, joints_M, bands)
            extra_TM = damping_TC[:, block, None] * (own_TN[:, joints_M] + FLOOR)
            diagonal_TM = entries[0].diagonal(dim1=-2, dim2=-1) + extra_TM
            diagonal_TM = torch.where(free_T[:, None], diagonal_TM, torch.ones_like(diagonal_TM))
            within_TMM, *couplings_TMM = (
                _array(entry * (free_T[lag:] & free_T[: len(free_T) - lag])[:, None, None])
                for lag, entry in enumerate(entries)
            )
            system = Banded(within_TMM, _array(diagonal_TM), couplings_TMM)
            bounds = _bounds(problem, q_TN, free_T, step_N, joints_M)
            step_TM = bounded_minimum(system, _array(right_TN[:, joints_M]), bounds, factor)
            step_TN[:, joints_M] = torch.from_numpy(step_TM).to(q_TN)
    return step_TN


def _coupled(
    problem: DirectionProblem,
    model: _MotionModel,
    smoothness: Smoothness,
    block: int,
    joints_M: Tensor,
    bands: list[Tensor],
) -> list[Tensor]:
    """Half of a block's Hessian: entries within a frame (T, M, M), and those between frames (T - 1, M, M), (T - 2, M,
    M) ...
    """
    entries = [band_XN[:, joints_M].diag_embed() for band_XN in bands]
    entries[0] += model.frames.hessian_BNN[:, joints_M[:, None], joints_M]
    if smoothness.directions is not None and model.jacobian_TD3N is not None:
        columns_E = torch.nonzero(problem.blocks.directions_DC[:, block])[:, 0]
        jacobian_TE3M = model.jacobian_TD3N[:, columns_E][..., joints_M]
        more = smoothness.directions.hessian(jacobian_TE3M, columns_E)
        entries = [entry + other for entry, other in zip(entries, more, strict=True)]
    return entries


def _bounds(problem: DirectionProblem, q_TN: Tensor, free_T: Tensor, step_N: Tensor | None, joints_M: Tensor) -> Bounds:
    moves_2TM = _array(torch.stack((problem.lower_N - q_TN, problem.upper_N - q_TN))[..., joints_M])
    if step_N is None:
        return Bounds.of(moves_2TM, _array(free_T))
    moved_XM, most_M = q_TN.diff(dim=0)[:, joints_M], step_N[joints_M]
    steps_2XM = _array(torch.stack((-most_M - moved_XM, most_M - moved_XM)))
    return Bounds.of(moves_2TM, _array(free_T), steps_2XM, _array(free_T[1:] | free_T[:-1]))


def _array(tensor: Tensor) -> np.ndarray:
    return tensor.double().cpu().numpy()
