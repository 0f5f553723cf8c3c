"""Joint angles among which a motion finds its way: each frame's local minima, from several starts.

Frames on their own are all solved from all starts. Of a motion it is enough to do that in a few frames a second, the
keys: a minimum goes along with the person, so the frames between two keys start from what is best in these. Where one
of them then costs more than the keys around it, a better minimum may have come up: it gets all starts as well.

Legend: B or T frames, K keys, X frames between keys, Y those that get all starts, S candidates or starts, D directions,
N joints, C blocks (see `solve`).
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.starts import StartPool
from mrhubo.reference.trajectory import best_path

STEPS, TOLERANCE = 6, 1e-2
"""How nearly candidates converge, as for `DirectionProblem.minimise`."""
KEY_S = 0.15
"""Time [s] from one key to the next."""
DEARER_RAD = math.radians(2.0)
"""A block gets all starts in a frame that costs more than the dearer of the keys around it, by as much as all of its
directions being so far off costs."""


def from_starts(problem: DirectionProblem, pool: StartPool, target_BD3: Tensor) -> tuple[Tensor, Tensor]:
    """Nearly converged solutions (B, S, N) [rad] from all starts, and the cost of their blocks (B, S, C)."""
    several = target_BD3.split(max(1, problem.chunk // pool.starts))
    parts = [_minima(problem, pool.near(part_BD3), part_BD3) for part_BD3 in several]
    return torch.cat([q for q, _ in parts]), torch.cat([cost for _, cost in parts])


def along_motion(
    problem: DirectionProblem, pool: StartPool, target_TD3: Tensor, frame_rate: float, pull: float
) -> tuple[Tensor, Tensor]:
    """The same, (T, S, N) and (T, S, C), for the frames of one motion, in a third of the time. Frames between keys
    have two candidates, which take turns in the S places.

    Args:
        problem: the cost.
        pool: the starts.
        target_TD3: the person's directions.
        frame_rate: frames per second.
        pull: of the motion's smoothness [1/rad^2].
    """
    frames, stride = len(target_TD3), round(KEY_S * frame_rate)
    if stride < 2 or frames <= stride:
        return from_starts(problem, pool, target_TD3)
    frame_T = torch.arange(frames, device=target_TD3.device)
    is_key_T = (frame_T % stride == 0) | (frame_T == frames - 1)
    key_K, frame_X = frame_T[is_key_T], frame_T[~is_key_T]
    keys_KSN, keys_KSC = from_starts(problem, pool, target_TD3[key_K])
    best_KN, best_KC = best_path(keys_KSN, keys_KSC, problem.blocks.joints_NC, pull / stride)
    around_X2 = (frame_X // stride)[:, None] + torch.arange(2, device=frame_X.device)
    between_X2N, between_X2C = _minima(problem, best_KN[around_X2], target_TD3[frame_X])
    turn_S = torch.arange(pool.starts, device=frame_X.device) % 2
    candidates_TSN = target_TD3.new_empty(frames, *keys_KSN.shape[1:])
    cost_TSC = target_TD3.new_empty(frames, *keys_KSC.shape[1:])
    candidates_TSN[key_K], cost_TSC[key_K] = keys_KSN, keys_KSC
    candidates_TSN[frame_X], cost_TSC[frame_X] = between_X2N[:, turn_S], between_X2C[:, turn_S]
    most_XC = best_KC[around_X2].amax(dim=1) + problem.weights(target_TD3[frame_X]) * DEARER_RAD**2
    dear_Y = frame_X[(between_X2C.amin(dim=1) > most_XC).any(dim=1)]
    if len(dear_Y):
        candidates_TSN[dear_Y], cost_TSC[dear_Y] = from_starts(problem, pool, target_TD3[dear_Y])
    return candidates_TSN, cost_TSC


def _minima(problem: DirectionProblem, start_BSN: Tensor, target_BD3: Tensor) -> tuple[Tensor, Tensor]:
    starts = start_BSN.shape[1]
    target_XD3 = target_BD3.repeat_interleave(starts, dim=0)
    q_XN, cost_XC = problem.minimise(start_BSN.flatten(0, 1), target_XD3, STEPS, TOLERANCE)
    return q_XN.unflatten(0, (-1, starts)), cost_XC.unflatten(0, (-1, starts))
