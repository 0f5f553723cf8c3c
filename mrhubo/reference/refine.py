"""All frames of a motion refined together: Gauss-Newton on every frame's cost and on what couples the frames.

Blocks of joints (see `solve`) share no term, so each has a system, a damping and accepted steps of its own.

Legend: T frames, D directions, N joints, C blocks, M joints of one block.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy.linalg import solveh_banded
from torch import Tensor

from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.terms import Quadratic, Smoothness

_PATIENCE = 6.0


def refine(
    problem: DirectionProblem,
    q_TN: Tensor,
    target_TD3: Tensor,
    smoothness: Smoothness,
    sweeps: int = 100,
    tolerance: float = 3e-4,
    fixed_T: Tensor | None = None,
) -> tuple[Tensor, Tensor]:
    """A local minimum (T, N) [rad] of the motion's cost from angles inside the limits, and each block's cost (C,).

    Gauss-Newton on all frames at once: the system is banded. Joints at a limit that the descent would push beyond it
    are frozen for the step. A block's step counts only if the block's cost falls; damping is raised in the frames whose
    own share of the cost rose, and lowered in the others if the step counted. A block ends when a step turns none of its
    joints by `tolerance` [rad], or six steps in a row were of no use. Frames in `fixed_T` (T,) stay as they are.
    """
    model = _motion_quadratic(problem, q_TN, target_TD3, smoothness)
    cost_C = model.cost_BC.double().sum(0)
    damping_TC = torch.full_like(model.cost_BC, 1e-3)
    failures_C = torch.zeros_like(cost_C)
    for _ in range(sweeps):
        running_C = failures_C < _PATIENCE
        trial_TN = q_TN + _motion_step(problem, q_TN, model, damping_TC, running_C, smoothness, fixed_T)
        trial_TN = torch.clamp(trial_TN, problem.lower_N, problem.upper_N)
        trial_TN = torch.where(running_C[problem.blocks.block_N], trial_TN, q_TN)
        trial = _motion_quadratic(problem, trial_TN, target_TD3, smoothness)
        trial_cost_C = trial.cost_BC.double().sum(0)
        better_C = trial_cost_C < cost_C
        moved_C = ((trial_TN - q_TN).abs()[..., None] * problem.blocks.joints_NC).amax(dim=(0, 1))
        settled_C = better_C & (moved_C < tolerance)
        failures_C = torch.where(better_C, torch.where(settled_C, _PATIENCE, 0), failures_C + 1)
        factor_TC = torch.where(trial.cost_BC > model.cost_BC, 10.0, torch.where(better_C, 0.1, 1.0))
        damping_TC = (damping_TC * factor_TC).clamp(1e-3, 1e6)
        q_TN = torch.where(better_C[problem.blocks.block_N], trial_TN, q_TN)
        cost_C = torch.where(better_C, trial_cost_C, cost_C)
        model = model.where(better_C, problem.blocks.block_N, trial)
        if bool((failures_C >= _PATIENCE).all()):
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
) -> Tensor:
    """`refine` for the frames in `free_T` (T,); the others stay.

    Of a stretch of frames that stay, only those next to the others matter to them, so the rest is left out; what is
    then coupled that has nothing to do with each other stays as it is, and costs always the same.
    """
    used_X = torch.nonzero(widen(free_T, smoothness.reach))[:, 0]
    if not len(used_X):
        return q_TN
    near = smoothness.at(used_X)
    part_XN = refine(problem, q_TN[used_X], target_TD3[used_X], near, sweeps, tolerance, ~free_T[used_X])[0]
    return q_TN.index_copy(0, used_X, part_XN)


def widen(mask_T: Tensor, frames: int) -> Tensor:
    """Frames (T,) that are so many or fewer away from one in the mask."""
    return torch.nn.functional.max_pool1d(mask_T[None].float(), 2 * frames + 1, 1, frames)[0] > 0


def motion_cost(problem: DirectionProblem, q_TN: Tensor, target_TD3: Tensor, smoothness: Smoothness) -> Tensor:
    """What each block of joints costs (C,) in a motion (T, N) [rad]."""
    return _motion_quadratic(problem, q_TN, target_TD3, smoothness).cost_BC.double().sum(0)


def _motion_quadratic(problem: DirectionProblem, q_TN: Tensor, target_TD3: Tensor, smoothness: Smoothness) -> Quadratic:
    """The model of each frame, with what couples it to others in gradients and in costs."""
    chunks = zip(q_TN.split(problem.chunk), target_TD3.split(problem.chunk), strict=True)
    parts = [problem.quadratic(*chunk) for chunk in chunks]
    return Quadratic(
        torch.cat([part.cost_BC for part in parts]) + smoothness.costs(q_TN, problem.blocks.joints_NC),
        torch.cat([part.gradient_BN for part in parts]) + smoothness.gradient(q_TN),
        torch.cat([part.hessian_BNN for part in parts]),
    )


def _motion_step(
    problem: DirectionProblem,
    q_TN: Tensor,
    model: Quadratic,
    damping_TC: Tensor,
    running_C: Tensor,
    smoothness: Smoothness,
    fixed_T: Tensor | None,
) -> Tensor:
    """Damped Gauss-Newton step (T, N) [rad] of the motion's free joints, block by block."""
    free_TN = ~problem.frozen(q_TN, model.gradient_BN)
    if fixed_T is not None:
        free_TN &= ~fixed_T[:, None]
    bands, damping_TN = smoothness.hessian(q_TN), damping_TC[:, problem.blocks.block_N]
    diagonal_TN = model.hessian_BNN.diagonal(dim1=-2, dim2=-1) + bands[0]
    diagonal_TN = diagonal_TN + damping_TN * (diagonal_TN + 0.01)
    diagonal_TN = torch.where(free_TN, diagonal_TN, torch.ones_like(diagonal_TN))
    couplings = [band * (free_TN[lag:] & free_TN[:-lag]) for lag, band in enumerate(bands[1:], start=1)]
    right_TN = -model.gradient_BN * free_TN
    step_TN = torch.zeros_like(q_TN)
    for block, running in enumerate(running_C.tolist()):
        if running:
            joints_M = torch.nonzero(problem.blocks.block_N == block)[:, 0]
            both_TMM = free_TN[:, joints_M, None] & free_TN[:, None, joints_M]
            within_TMM = model.hessian_BNN[:, joints_M[:, None], joints_M] * both_TMM
            parts = (right_TN, diagonal_TN, *couplings)
            right_TM, diagonal_TM, *couplings_TM = (part[:, joints_M].double().cpu().numpy() for part in parts)
            step_TM = _solve_banded(within_TMM.double().cpu().numpy(), diagonal_TM, couplings_TM, right_TM)
            step_TN[:, joints_M] = torch.from_numpy(step_TM).to(q_TN)
    return step_TN


def _solve_banded(
    within_TMM: np.ndarray, diagonal_TM: np.ndarray, couplings_TM: list[np.ndarray], right_TM: np.ndarray
) -> np.ndarray:
    """The solution (T, M) of a symmetric system, of which are given: the entries within a frame, but its diagonal
    apart, and those between a joint and the same joint one, two ... frames later.
    """
    frames, joints = right_TM.shape
    # Lower banded form: row k holds the entries k below the diagonal; the next frame's same joint is `joints` below.
    banded = np.zeros((len(couplings_TM) * joints + 1, frames, joints))
    banded[0] = diagonal_TM
    for k in range(1, joints):
        banded[k, :, : joints - k] = np.diagonal(within_TMM, offset=-k, axis1=1, axis2=2)
    for lag, coupling_TM in enumerate(couplings_TM, start=1):
        banded[lag * joints, : frames - lag] = coupling_TM
    step = solveh_banded(banded.reshape(len(banded), -1), right_TM.ravel(), lower=True, overwrite_ab=True,
                         check_finite=False)  # fmt: skip
    return step.reshape(frames, joints)
