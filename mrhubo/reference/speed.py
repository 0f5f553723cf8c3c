"""No joint turns faster than it can: a hard bound on the steps of a motion.

    |q_t - q_(t-1)| <= step        for every joint, from each frame to the next

First the nearest motion that keeps to it, then the best one near that (`mrhubo.fast.together.bounded`), whose last
millionths the nearest motion takes away again. Where joints run through a wide angle, the jerk of directions is far
from its model, and a few steps from the nearest motion end half way; so they begin where the joints' own terms lead.

Legend: T frames, N joints, D directions.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from mrhubo.fast.together.speed import AROUND_S, FLOAT, SWEEPS, TOLERANCE
from mrhubo.reference.refine import refine_around, widen
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.terms import Smoothness


def speed_bound(velocity_N: Tensor, frame_rate: float) -> tuple[Tensor, int]:
    """How far joints may turn (N,) [rad] from one frame to the next, less what rounding of the angles may add; and how
    many frames away from those that were too fast are still worth changing.
    """
    step_N = velocity_N / frame_rate
    return torch.maximum(step_N - 2 * FLOAT, step_N / 2), math.ceil(AROUND_S * frame_rate)


def nearest_slow(q_TN: Tensor, step_N: Tensor, fixed_T: Tensor | None = None) -> Tensor:
    """The motion (T, N) [rad] without a step longer than `step_N` (N,) whose largest distance from `q_TN` is least.

    It is the mean of the least and the greatest of all motions that keep to the bound, above and below the given one:
    E. J. McShane, "Extension of range of functions", 1934. Nothing leaves the range that the joint had. Joints that
    keep to the bound stay as they are, to the bit. So do frames in `fixed_T` (T,), whose steps are short enough; the
    others are then as near as these let them.
    """
    too_fast_N = (q_TN.diff(dim=0).abs() > step_N).any(dim=0)
    if not bool(too_fast_N.any()):
        return q_TN
    path_TM, step_M = q_TN[:, too_fast_N].double(), step_N[too_fast_N].double()
    ramp_TM = torch.arange(len(q_TN), device=q_TN.device).double()[:, None] * step_M

    def least_above(path_TM: Tensor) -> Tensor:
        """max over s of path_s - step |t - s|."""
        before_TM = (path_TM + ramp_TM).cummax(dim=0).values - ramp_TM
        after_TM = (path_TM - ramp_TM).flip(0).cummax(dim=0).values.flip(0) + ramp_TM
        return torch.maximum(before_TM, after_TM)

    found_TM = (least_above(path_TM) - least_above(-path_TM)) / 2
    if fixed_T is not None and bool(fixed_T.any()):
        from_TM, to_TM = (least_above(torch.where(fixed_T[:, None], p, -torch.inf)) for p in (path_TM, -path_TM))
        found_TM = torch.where(fixed_T[:, None], path_TM, torch.minimum(torch.maximum(found_TM, from_TM), -to_TM))
    found_TN = q_TN.clone()
    found_TN[:, too_fast_N] = found_TM.to(q_TN)
    return found_TN


def keep_speed(
    problem: DirectionProblem,
    q_TN: Tensor,
    target_TD3: Tensor,
    smoothness: Smoothness,
    step_N: Tensor,
    around: int,
    fixed_T: Tensor | None = None,
    sweeps: int = SWEEPS,
) -> Tensor:
    """The best motion (T, N) [rad] near another that keeps to the bound; one that keeps to it stays, to the bit.

    Blocks of joints without a step that is too long stay too, and so do frames that are more than `around` away from
    those that the nearest slow motion changes, and those in `fixed_T` (T,), whose steps are short enough.

    A few `sweeps` do where the nearest slow motion is nearly the best; where it touches the robot itself it is not.
    """
    nearest_TN = nearest_slow(q_TN, step_N, fixed_T)
    changed_TN = nearest_TN != q_TN
    if not bool(changed_TN.any()):
        return q_TN
    free_T = widen(changed_TN.any(dim=1), around)
    if fixed_T is not None:
        free_T = free_T & ~fixed_T
    found_TN = nearest_TN
    concerned_C = changed_TN.any(dim=0).to(q_TN) @ problem.blocks.joints_NC > 0
    for terms in (smoothness,) if smoothness.directions is None else (smoothness.of_joints, smoothness):
        found_TN = refine_around(problem, found_TN, target_TD3, terms, free_T, sweeps, TOLERANCE, step_N, concerned_C)
    found_TN = nearest_slow(found_TN, step_N, fixed_T)
    return torch.where(concerned_C[problem.blocks.block_N], found_TN, q_TN)
