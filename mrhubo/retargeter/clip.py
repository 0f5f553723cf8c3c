"""All frames of a motion together: what the networks and their steps gave frame by frame, made one smooth motion.

    sum_t  cost_t(q_t)  +  pull * |q_t - q_(t-1)|^2  +  jerk_t * |third difference|^2,       |q_t - q_(t-1)| <= v dt

The first two terms are the reference retargeter's (`mrhubo.reference.trajectory`), as is the bound. Where two answers
are equally good, the twist of a straight arm or an arm along a limit of the shoulder, no method that looks at one frame
can stay with one of them; here each frame's candidates are its own answer and those of frames around.

The third term rounds off the corners that a joint's path has where it meets a limit, which the human's does not have.
It is the stronger, the more evenly the human moves, so that what is quick or jerky of him is followed.

Legend: T frames, Y = T - 3 differences of third order, D directions, N joints, C blocks.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from mrhubo.fast.together.motion import SWEEPS, TOLERANCE
from mrhubo.fast.together.smoothness import CALM_JERK, CUTOFF_HZ, SMOOTHNESS, WINDOW_S, pull_at
from mrhubo.reference import Avoidance, DirectionProblem
from mrhubo.reference.speed import speed_bound
from mrhubo.reference.terms import Smoothness
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
    smoothness = Smoothness(pull_at(SMOOTHNESS, frame_rate), jerk_weights(problem, target_TD3, frame_rate))
    bound = speed_bound(problem.robot.velocity_N, frame_rate)
    task = MotionTask(target_TD3, smoothness, *bound, SWEEPS, TOLERANCE, avoidance)
    return smooth_motion(problem, q_TN[:, None], problem.cost(q_TN, target_TD3)[:, None], task)


def jerk_weights(problem: DirectionProblem, target_TD3: Tensor, frame_rate: float) -> Tensor:
    """Weights (Y, N) [1/rad^2] of the squared third differences: less where the human directions that a joint's block
    turns jerk more.
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
    calm = (frame_rate / (math.tau * CUTOFF_HZ)) ** 6
    return (calm / (1 + (jerk_YC / CALM_JERK).square()))[:, problem.blocks.block_N]
