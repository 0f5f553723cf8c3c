"""Detours of a motion made smooth, as `mrhubo.reference.detours` does it, where the reasons stand.

Legend: T frames, Y = T - 3 differences of third order, D directions, N joints, C blocks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.fast.masks import widen
from mrhubo.fast.plain.human import norm
from mrhubo.fast.together.problem import Problem
from mrhubo.fast.together.refine import refine_around
from mrhubo.fast.together.smoothness import CALM_JERK, FOLLOWED, Smoothness, averaged, calm_at

ROUGH = 3.0
"""How many times the human's jerk a robot's is where a detour begins; at twice that it is one in full. A human who
jerks less than `CALM_JERK` counts as one who jerks as much."""
STRONGER = 2.0
"""How many times as much jerk costs in a detour as where the human moves evenly. With 1, 2 and 4, Reachy's arms jerk
1.52, 1.40 and 1.30 times as much as the human's in `arm_sweep`, and are 0.64, 0.73 and 0.83 degrees from their optimum.
"""
AROUND_S = 0.5
"""Frames this near in time [s] to a detour belong to it."""
SWEEPS, TOLERANCE = 10, 2e-3


@dataclass(frozen=True)
class Detours:
    """Where a motion makes some."""

    factor_YC: np.ndarray
    """By how much jerk costs more there, for each block."""
    free_T: np.ndarray
    """Frames that may change."""
    blocks_C: np.ndarray
    """Blocks that may."""


def find_detours(
    third_YD3: np.ndarray, weight_YD: np.ndarray, goal_YD3: np.ndarray, directions_DC: np.ndarray, frame_rate: float
) -> Detours | None:
    """Detours of a motion, by third differences of the robot's directions; None: there is none.

    Args:
        third_YD3: the differences.
        weight_YD: what their squares cost; 0 for directions that do not count.
        goal_YD3: what they are to be, most of the human's.
        directions_DC: which block turns which direction.
        frame_rate: frames per second.
    """
    share_YD = weight_YD / np.maximum(weight_YD @ directions_DC @ directions_DC.T, 1e-30)
    robot_YC, human_YC = (
        averaged((norm(third) * share_YD) @ directions_DC * frame_rate**3, frame_rate)
        for third in (third_YD3, goal_YD3 / FOLLOWED)
    )
    detour_YC = np.clip(robot_YC / np.maximum(human_YC, CALM_JERK) / ROUGH - 1, 0, 1)
    if not detour_YC.any():
        return None
    around = math.ceil(AROUND_S * frame_rate)
    padded_XC = np.pad(detour_YC, ((around, around), (0, 0)))
    near_YC = np.lib.stride_tricks.sliding_window_view(padded_XC, 2 * around + 1, axis=0).max(axis=-1)
    factor_YC = 1 + near_YC * (STRONGER / calm_at(human_YC) - 1)
    frame_T = np.pad(detour_YC.any(axis=1), (0, 3))
    return Detours(factor_YC, widen(frame_T, 2 * around), np.asarray(detour_YC.any(axis=0)))  # and the way back


def smooth_detours(
    problem: Problem,
    q_TN: np.ndarray,
    target_TD3: np.ndarray,
    smoothness: Smoothness,
    frame_rate: float,
    step_N: np.ndarray,
    fixed_T: np.ndarray,
) -> tuple[np.ndarray, Smoothness]:
    """The motion (T, N) [rad] with its detours smooth, and what makes them so; both as they are where there is none."""
    jerk, cost = smoothness.directions, problem.cost
    if jerk is None or len(q_TN) <= smoothness.reach:
        return q_TN, smoothness
    third_YD3 = np.diff(problem.directions(q_TN)[0], n=3, axis=0)
    found = find_detours(third_YD3, jerk.weight_YD, jerk.goal_YD3, cost.directions_DC, frame_rate)
    if found is None:
        return q_TN, smoothness
    firmer = replace(
        smoothness,
        jerk_YN=smoothness.jerk_YN * found.factor_YC[:, cost.block_N],
        directions=replace(jerk, weight_YD=jerk.weight_YD * (found.factor_YC @ cost.directions_DC.T)),
    )
    frames = (found.free_T & ~fixed_T, SWEEPS, TOLERANCE)
    return refine_around(problem, q_TN, target_TD3, firmer, *frames, step_N, found.blocks_C), firmer
