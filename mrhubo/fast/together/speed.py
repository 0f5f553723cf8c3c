"""No joint turns faster than it can, as `mrhubo.reference.speed` has it, where the reasons stand.

Legend: T frames, N joints, D directions.
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.fast.masks import widen
from mrhubo.fast.together.problem import Problem
from mrhubo.fast.together.refine import refine_around
from mrhubo.fast.together.smoothness import Smoothness

SWEEPS, TOLERANCE = 5, 2e-3
AROUND_S = 0.5
"""Frames this near in time [s] to those that were too fast may change."""
FLOAT = 4e-7
"""Rounding of a difference of two angles of up to 2 pi [rad], float32."""


def speed_bound(velocity_N: np.ndarray, frame_rate: float) -> tuple[np.ndarray, int]:
    """How far joints may turn (N,) [rad] from one frame to the next, less what rounding of the angles may add; and how
    many frames away from those that were too fast are still worth changing.
    """
    step_N = velocity_N / frame_rate
    return np.maximum(step_N - 2 * FLOAT, step_N / 2), math.ceil(AROUND_S * frame_rate)


def nearest_slow(q_TN: np.ndarray, step_N: np.ndarray, fixed_T: np.ndarray | None = None) -> np.ndarray:
    """The motion (T, N) [rad] without a step longer than `step_N` (N,) whose largest distance from `q_TN` is least;
    joints that keep to the bound stay as they are, and so do frames in `fixed_T` (T,).
    """
    too_fast_N = (np.abs(np.diff(q_TN, axis=0)) > step_N).any(axis=0)
    if not too_fast_N.any():
        return q_TN
    path_TM, step_M = q_TN[:, too_fast_N], step_N[too_fast_N]
    ramp_TM = np.arange(len(q_TN))[:, None] * step_M

    def least_above(path_TM: np.ndarray) -> np.ndarray:
        """max over s of path_s - step |t - s|."""
        before_TM = np.maximum.accumulate(path_TM + ramp_TM) - ramp_TM
        after_TM = np.maximum.accumulate((path_TM - ramp_TM)[::-1])[::-1] + ramp_TM
        return np.maximum(before_TM, after_TM)

    found_TM = (least_above(path_TM) - least_above(-path_TM)) / 2
    if fixed_T is not None and fixed_T.any():
        from_TM, to_TM = (least_above(np.where(fixed_T[:, None], p, -np.inf)) for p in (path_TM, -path_TM))
        found_TM = np.where(fixed_T[:, None], path_TM, np.minimum(np.maximum(found_TM, from_TM), -to_TM))
    found_TN = q_TN.copy()
    found_TN[:, too_fast_N] = found_TM
    return found_TN


def keep_speed(
    problem: Problem,
    q_TN: np.ndarray,
    target_TD3: np.ndarray,
    smoothness: Smoothness,
    step_N: np.ndarray,
    around: int,
    fixed_T: np.ndarray,
    sweeps: int = SWEEPS,
) -> np.ndarray:
    """The best motion (T, N) [rad] near another that keeps to the bound; one that keeps to it stays, to the bit."""
    nearest_TN = nearest_slow(q_TN, step_N, fixed_T)
    changed_TN = nearest_TN != q_TN
    if not changed_TN.any():
        return q_TN
    free_T = widen(changed_TN.any(axis=1), around) & ~fixed_T
    concerned_C = changed_TN.any(axis=0) @ problem.cost.joints_NC > 0
    found_TN = nearest_TN
    for terms in (smoothness.of_joints, smoothness):
        found_TN = refine_around(problem, found_TN, target_TD3, terms, free_T, sweeps, TOLERANCE, step_N, concerned_C)
    found_TN = nearest_slow(found_TN, step_N, fixed_T)
    return np.where(concerned_C[problem.cost.block_N], found_TN, q_TN)
