"""Detours made smooth: where a robot cannot go the human's way, it goes its own way evenly.

An arm that has to come to its other side, as its shoulder's roll is at a limit, or whose joints are not fast enough to
pass by the shoulder's axis, leaves the human for a moment. `mrhubo.retargeter.clip` lets jerk cost little where the
human himself moves quickly, so that he is followed; of a detour there is nothing to follow, and what is quick of it is
the robot's alone. So where the robot's directions jerk far more than the human's, jerk costs as much as if he moved
evenly, and more, and the frames around are refined once more.

Legend: T frames, Y = T - 3 differences of third order, D directions, N joints, C blocks.
"""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from mrhubo.fast.together.detours import SWEEPS, TOLERANCE, find_detours
from mrhubo.reference.refine import refine_around
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.terms import Smoothness


def smooth_detours(
    problem: DirectionProblem,
    q_TN: Tensor,
    target_TD3: Tensor,
    smoothness: Smoothness,
    frame_rate: float,
    step_N: Tensor,
    fixed_T: Tensor,
) -> tuple[Tensor, Smoothness]:
    """The motion (T, N) [rad] with its detours smooth, and what makes them so; both as they are where there is none,
    and where the jerk of directions costs nothing.

    Args:
        problem: what frames cost.
        q_TN: a motion that keeps to the bound.
        target_TD3: the human's directions.
        smoothness: of the joints and directions.
        frame_rate: frames per second.
        step_N: the longest step of a joint from one frame to the next [rad].
        fixed_T: frames that stay.
    """
    jerk, blocks = smoothness.directions, problem.blocks
    if jerk is None or smoothness.jerk_YN is None or len(q_TN) <= smoothness.reach:
        return q_TN, smoothness
    direction_TD3 = torch.cat([
        problem.state(*chunk).direction_BD3
        for chunk in zip(q_TN.split(problem.chunk), target_TD3.split(problem.chunk), strict=True)
    ])  # fmt: skip
    third_YD3, weight_YD, goal_YD3, directions_DC = (
        tensor.double().cpu().numpy()
        for tensor in (direction_TD3.diff(n=3, dim=0), jerk.weight_YD, jerk.goal_YD3, blocks.directions_DC)
    )
    found = find_detours(third_YD3, weight_YD, goal_YD3, directions_DC, frame_rate)
    if found is None:
        return q_TN, smoothness
    factor_YC = torch.from_numpy(found.factor_YC).to(q_TN)
    free_T, blocks_C = (torch.from_numpy(mask).to(fixed_T) for mask in (found.free_T, found.blocks_C))
    firmer = replace(
        smoothness,
        jerk_YN=smoothness.jerk_YN * factor_YC[:, blocks.block_N],
        directions=replace(jerk, weight_YD=jerk.weight_YD * (factor_YC @ blocks.directions_DC.T)),
    )
    frames = (free_T & ~fixed_T, SWEEPS, TOLERANCE)
    return refine_around(problem, q_TN, target_TD3, firmer, *frames, step_N, blocks_C), firmer
