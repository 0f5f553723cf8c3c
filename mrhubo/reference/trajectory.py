"""From candidates per frame to one smooth motion: the best path through them, then all frames refined together.

    cost(q_1 .. q_T) = sum_t cost_t(q_t)  +  pull * sum_t |q_t - q_(t-1)|^2        (`terms.smoothness`)

Blocks of joints (see `solve`) share no term, so each has its own path, its own damping and its own accepted steps.

Legend: T frames, S candidates per frame, D directions, N joints, C blocks.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy.linalg import solveh_banded
from torch import Tensor

from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.terms import Quadratic, add_pull, pull_diagonal

_PART = 512
_PATIENCE = 5.0
_JUMP = 0.5
_REACH = (-16, -8, -4, -2, -1, 1, 2, 4, 8, 16)


def smooth_motion(
    problem: DirectionProblem, candidates_TSN: Tensor, cost_TSC: Tensor, target_TD3: Tensor, pull: float
) -> Tensor:
    """The cheapest motion (T, N) [rad] that is found from candidates (T, S, N) with their blocks' costs (T, S, C)."""
    path_TN, path_cost_TC = best_path(candidates_TSN, cost_TSC, problem.blocks.joints_NC, pull)
    motion_TN, cost_C = refine(problem, path_TN, target_TD3, pull)
    more_TSN, more_cost_TSC = _bridge(problem, path_TN, path_cost_TC, target_TD3)
    if more_TSN.shape[1]:
        candidates_TSN, cost_TSC = torch.cat((candidates_TSN, more_TSN), 1), torch.cat((cost_TSC, more_cost_TSC), 1)
        other_TN = best_path(candidates_TSN, cost_TSC, problem.blocks.joints_NC, pull)[0]
        if bool(((other_TN - path_TN).abs() > _JUMP).any()):
            other_TN, other_cost_C = refine(problem, other_TN, target_TD3, pull)
            motion_TN = torch.where((other_cost_C < cost_C)[problem.blocks.block_N], other_TN, motion_TN)
    return motion_TN


def best_path(candidates_TSN: Tensor, cost_TSC: Tensor, joints_NC: Tensor, pull: float) -> tuple[Tensor, Tensor]:
    """Each block's cheapest path through its candidates (dynamic programming): angles (T, N) [rad], costs (T, C)."""
    cost_TCS = cost_TSC.transpose(1, 2).cpu()
    total_CS, back = cost_TCS[0], []
    for first in range(0, len(cost_TCS) - 1, _PART):
        part_TSN = candidates_TSN[first : first + _PART + 1]
        moves_XSSC = (part_TSN[:-1, :, None] - part_TSN[1:, None]).square() @ joints_NC * pull
        for move_CSS, cost_CS in zip(moves_XSSC.permute(0, 3, 1, 2).cpu(), cost_TCS[first + 1 :], strict=False):
            least = (total_CS[:, :, None] + move_CSS).min(dim=1)
            total_CS = least.values + cost_CS
            back.append(least.indices)
    state_C = total_CS.argmin(dim=1)
    states = [state_C]
    for came_from_CS in reversed(back):
        state_C = came_from_CS.gather(1, state_C[:, None])[:, 0]
        states.append(state_C)
    state_TC = torch.stack(states[::-1]).to(candidates_TSN.device)
    return pick(candidates_TSN, state_TC, joints_NC), cost_TSC.gather(1, state_TC[:, None])[:, 0]


def pick(candidates_TSN: Tensor, state_TC: Tensor, joints_NC: Tensor) -> Tensor:
    """Angles (T, N) of the candidate that each block has chosen (T, C)."""
    state_TN = state_TC[:, joints_NC.argmax(dim=1)]
    return candidates_TSN.gather(1, state_TN[:, None])[:, 0]


def _bridge(
    problem: DirectionProblem, path_TN: Tensor, path_cost_TC: Tensor, target_TD3: Tensor
) -> tuple[Tensor, Tensor]:
    """More candidates (T, S, N) near the path's jumps, and their cost (T, S, C); S = 0 if there is no jump.

    Where a path jumps, the solution that it leaves is often only missing for some frames, because it lies at a limit or
    is not the best. It is looked for from the path's angles a few frames before and after; elsewhere the path is
    repeated.
    """
    frames, reach_S = len(path_TN), torch.tensor(_REACH, device=path_TN.device)
    jumps_T = torch.nn.functional.pad((path_TN.diff(dim=0).abs() > _JUMP).any(dim=1).cumsum(0), (1, 0))
    if not bool(jumps_T[-1]):
        return path_TN.new_empty(frames, 0, path_TN.shape[1]), path_cost_TC.new_empty(frames, 0, path_cost_TC.shape[1])
    source_TS = (torch.arange(frames, device=path_TN.device)[:, None] + reach_S).clamp(0, frames - 1)
    across_TS = jumps_T[source_TS] != jumps_T[:, None]
    found_TSN = path_TN[:, None].repeat(1, len(_REACH), 1)
    cost_TSC = path_cost_TC[:, None].repeat(1, len(_REACH), 1)
    frame_X = torch.nonzero(across_TS)[:, 0]
    found_TSN[across_TS], cost_TSC[across_TS] = problem.minimise(
        path_TN[source_TS[across_TS]], target_TD3[frame_X], steps=12, tolerance=1e-2
    )
    return found_TSN, cost_TSC


def refine(
    problem: DirectionProblem,
    q_TN: Tensor,
    target_TD3: Tensor,
    pull: float,
    sweeps: int = 100,
    tolerance: float = 3e-4,
    fixed_T: Tensor | None = None,
) -> tuple[Tensor, Tensor]:
    """A local minimum (T, N) [rad] of the motion's cost from angles inside the limits, and each block's cost (C,).

    Gauss-Newton on all frames at once: the system is block-tridiagonal, solved as a banded one. Joints at a limit that
    the descent would push beyond it are frozen for the step. A block's step counts only if the block's cost falls;
    damping is raised in the frames whose own share of the cost rose. A block ends when a step turns none of its joints
    by `tolerance` [rad], or five steps in a row were of no use. Frames in `fixed_T` (T,) stay as they are.
    """
    model = _motion_quadratic(problem, q_TN, target_TD3, pull)
    cost_C = model.cost_BC.double().sum(0)
    damping_TC = torch.full_like(model.cost_BC, 1e-3)
    failures_C = torch.zeros_like(cost_C)
    for _ in range(sweeps):
        running_N = (failures_C < _PATIENCE)[problem.blocks.block_N]
        trial_TN = q_TN + _motion_step(problem, q_TN, model, damping_TC[:, problem.blocks.block_N], pull, fixed_T)
        trial_TN = torch.where(running_N, torch.clamp(trial_TN, problem.lower_N, problem.upper_N), q_TN)
        trial = _motion_quadratic(problem, trial_TN, target_TD3, pull)
        trial_cost_C = trial.cost_BC.double().sum(0)
        better_C = trial_cost_C < cost_C
        moved_C = ((trial_TN - q_TN).abs()[..., None] * problem.blocks.joints_NC).amax(dim=(0, 1))
        settled_C = better_C & (moved_C < tolerance)
        failures_C = torch.where(better_C, torch.where(settled_C, _PATIENCE, 0), failures_C + 1)
        damping_TC = torch.where(trial.cost_BC > model.cost_BC, damping_TC * 10, damping_TC * 0.1).clamp(1e-3, 1e6)
        q_TN = torch.where(better_C[problem.blocks.block_N], trial_TN, q_TN)
        cost_C = torch.where(better_C, trial_cost_C, cost_C)
        model = model.where(better_C, problem.blocks.block_N, trial)
        if bool((failures_C >= _PATIENCE).all()):
            break
    return q_TN, cost_C


def _motion_quadratic(problem: DirectionProblem, q_TN: Tensor, target_TD3: Tensor, pull: float) -> Quadratic:
    """The model of each frame, with the pull in gradients and in costs (half of a step's in each of its two frames)."""
    chunks = zip(q_TN.split(problem.chunk), target_TD3.split(problem.chunk), strict=True)
    parts = [problem.quadratic(*chunk) for chunk in chunks]
    model = Quadratic(
        torch.cat([part.cost_BC for part in parts]),
        torch.cat([part.gradient_BN for part in parts]),
        torch.cat([part.hessian_BNN for part in parts]),
    )
    return add_pull(model, q_TN, pull, problem.blocks.joints_NC)


def _motion_step(
    problem: DirectionProblem, q_TN: Tensor, model: Quadratic, damping_TN: Tensor, pull: float, fixed_T: Tensor | None
) -> Tensor:
    """Damped Gauss-Newton step (T, N) [rad] of the motion's free joints."""
    frames, joints = q_TN.shape
    free_TN = ~problem.frozen(q_TN, model.gradient_BN)
    if fixed_T is not None:
        free_TN &= ~fixed_T[:, None]
    both_TNN = free_TN[:, :, None] & free_TN[:, None, :]
    system_TNN = (model.hessian_BNN * both_TNN).double().cpu().numpy()
    diagonal_TN = model.hessian_BNN.diagonal(dim1=-2, dim2=-1)
    diagonal_TN = diagonal_TN + pull_diagonal(frames, pull, diagonal_TN) + damping_TN * (diagonal_TN + 0.01)
    # Lower banded form: row k holds the entries k below the diagonal; the next frame's same joint is `joints` below.
    banded = np.zeros((joints + 1, frames, joints))
    banded[0] = torch.where(free_TN, diagonal_TN, torch.ones_like(diagonal_TN)).cpu().numpy()
    for k in range(1, joints):
        banded[k, :, : joints - k] = np.diagonal(system_TNN, offset=-k, axis1=1, axis2=2)
    banded[joints, :-1] = -pull * (free_TN[1:] & free_TN[:-1]).cpu().numpy()
    right = -(model.gradient_BN * free_TN).double().cpu().numpy()
    step = solveh_banded(banded.reshape(joints + 1, -1), right.ravel(), lower=True, overwrite_ab=True, overwrite_b=True,
                         check_finite=False)  # fmt: skip
    return torch.from_numpy(step.reshape(frames, joints)).to(q_TN)
