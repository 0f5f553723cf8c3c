"""All frames of a motion together: what the networks and their steps gave frame by frame, made one smooth motion.

    sum_t  cost_t(q_t)  +  pull * |q_t - q_(t-1)|^2  +  joints' jerk  +  directions' jerk,   |q_t - q_(t-1)| <= v dt

The first two terms are the reference retargeter's (`mrhubo.reference.trajectory`), as is the bound. Where two answers
are equally good, the twist of a straight arm or an arm along a limit of the shoulder, no method that looks at one frame
can stay with one of them; here each frame's candidates are its own answer and those of frames around.

The last terms (`mrhubo.reference.terms`) round off the corners that a path has where a joint meets a limit or its
speed, which the human's does not have. The jerk of directions is what an observer sees; that of joints, with a much
smaller weight, evens out what directions do not tell. Both are the stronger, the more evenly the human moves, so that
what is quick or jerky of him is followed.

Legend: T frames, Y = T - 3 differences of third order, D directions, N joints, C blocks.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.fast.together.motion import SWEEPS, TOLERANCE
from mrhubo.fast.together.smoothness import (
    CALM_JERK,
    DIRECTIONS_HZ,
    FOLLOWED,
    JOINTS_HZ,
    SMOOTHNESS,
    WINDOW_S,
    jerk_weight,
    pull_at,
)
from mrhubo.reference import Avoidance, DirectionProblem
from mrhubo.reference.speed import speed_bound
from mrhubo.reference.terms import DirectionJerk, Smoothness
from mrhubo.reference.trajectory import MotionTask, smooth_motion


@torch.no_grad()
def join_frames(
    problem: DirectionProblem,
    q_TN: Tensor,
    target_TD3: Tensor,
    frame_rate: float,
    avoidance: Avoidance | None = None,
) -> Tensor:
    """One motion (T, N) [rad] near answers that were found frame by frame (T, N), inside the limits of joints and of
    their speeds.

    Args:
        problem: the optimiser's cost.
        q_TN: the answers.
        target_TD3: the human's directions.
        frame_rate: frames per second.
        avoidance: what makes frames give way in which the robot touches itself; None: nothing does.
    """
    if len(q_TN) < 2:
        return q_TN if avoidance is None else avoidance(q_TN, target_TD3)
    smoothness = smoothness_of(problem, target_TD3, frame_rate)
    bound = speed_bound(problem.robot.velocity_N, frame_rate)
    task = MotionTask(target_TD3, smoothness, frame_rate, *bound, SWEEPS, TOLERANCE, avoidance)
    return smooth_motion(problem, q_TN[:, None], problem.cost(q_TN, target_TD3)[:, None], task)


def smoothness_of(problem: DirectionProblem, target_TD3: Tensor, frame_rate: float) -> Smoothness:
    """That of a motion, for human directions (T, D, 3)."""
    blocks, calm_YC = problem.blocks, calmness(problem, target_TD3, frame_rate)
    weight_D = torch.zeros_like(problem.directions.weight_D)
    weight_D[problem.body_map.measured] = problem.directions.weight_D[problem.body_map.measured]
    weight_YD = jerk_weight(DIRECTIONS_HZ, frame_rate) * calm_YC @ blocks.directions_DC.T * weight_D
    directions = DirectionJerk(weight_YD, FOLLOWED * target_TD3.diff(n=3, dim=0))
    jerk_YN = jerk_weight(JOINTS_HZ, frame_rate) * calm_YC[:, blocks.block_N]
    return Smoothness(pull_at(SMOOTHNESS, frame_rate), jerk_YN, directions)


def calmness(problem: DirectionProblem, target_TD3: Tensor, frame_rate: float) -> Tensor:
    """Factor (Y, C) of the weights of jerk for each block, 1 or less: the less, the more the human directions (T, D, 3)
    jerk that the block turns.
    """
    columns = problem.body_map.measured
    jerk_YD = target_TD3[:, columns].diff(n=3, dim=0).norm(dim=-1) * frame_rate**3
    weight_DC = (problem.blocks.directions_DC * problem.directions.weight_D[:, None])[columns]
    jerk_YC = jerk_YD @ (weight_DC / weight_DC.sum(dim=0).clamp(min=1e-9))
    if len(jerk_YC):
        half = round(WINDOW_S / 2 * frame_rate)
        jerk_YC = torch.nn.functional.avg_pool1d(
            jerk_YC.T[:, None], 2 * half + 1, stride=1, padding=half, count_include_pad=False
        )[:, 0].T
    return 1 / (1 + (jerk_YC / CALM_JERK).square())
