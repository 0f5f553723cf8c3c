"""From answers that were found frame by frame to one smooth motion, as `mrhubo.retargeter.clip` and
`mrhubo.reference.trajectory` do it, where the reasons stand.

Legend: T frames, L that are settled, S candidates per frame, D directions, N joints, C blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.side_by_side import side_by_side
from mrhubo.fast.together.avoiding import GivingWay
from mrhubo.fast.together.detours import smooth_detours
from mrhubo.fast.together.problem import Problem
from mrhubo.fast.together.refine import motion_cost, refine
from mrhubo.fast.together.smoothness import Smoothness, smoothness_of
from mrhubo.fast.together.speed import keep_speed, nearest_slow, speed_bound

SWEEPS, TOLERANCE = 20, 2e-3
WINDOW, AHEAD = 4096, 1024
"""Frames that are worked on together, and how many of them only serve to look ahead."""
JUMP = 0.5
"""Steps of a path [rad] that are jumps."""
REACH = (-16, -8, -4, -2, -1, 1, 2, 4, 8, 16)
"""How many frames away the other side of a jump is looked for."""
FAR = 512
"""Frames over which the side of a jump is looked for that it leaves, or that the next one takes."""
BRIDGE_STEPS, BRIDGE_TOLERANCE = 12, 1e-2
PRICES = (1.0, 30.0)
"""How many times as much the moves of other paths are made to cost. A path pays for a jump once, and the joints, which
are not as fast, for every frame on the way to its other side: what stays on one side may be cheaper in the end."""


def join_frames(
    description: Description,
    problem: Problem,
    giving_way: GivingWay | None,
    q_TN: np.ndarray,
    target_TD3: np.ndarray,
    frame_rate: float,
) -> np.ndarray:
    """One motion (T, N) [rad] near answers that were found frame by frame (T, N), inside the limits of joints and of
    their speeds.

    Args:
        description: the robot's.
        problem: what frames cost.
        giving_way: what makes frames give way in which the robot touches itself; None: nothing does.
        q_TN: the answers.
        target_TD3: the human's directions.
        frame_rate: frames per second.
    """
    if len(q_TN) < 2:
        return q_TN if giving_way is None else giving_way.alone(q_TN, target_TD3)
    smoothness = smoothness_of(description, target_TD3, frame_rate)
    task = Task(target_TD3, smoothness, frame_rate, *speed_bound(problem.cost.velocity_N, frame_rate), giving_way)
    return smooth_motion(problem, q_TN, task)


@dataclass(frozen=True)
class Task:
    """What a motion is to follow, and how."""

    target_TD3: np.ndarray
    """The human's directions."""
    smoothness: Smoothness
    frame_rate: float
    """Frames per second."""
    step_N: np.ndarray
    """The longest step of a joint from one frame to the next [rad]."""
    around: int
    """Frames this near to those that were too fast may change."""
    giving_way: GivingWay | None = None

    def at(self, part: slice) -> Task:
        """The same for some frames alone."""
        frame_X = np.arange(len(self.target_TD3))[part]
        return replace(self, target_TD3=self.target_TD3[part], smoothness=self.smoothness.at(frame_X))


def smooth_motion(problem: Problem, q_TN: np.ndarray, task: Task) -> np.ndarray:
    """The cheapest motion (T, N) [rad] that is found near answers (T, N), without a step that is too long."""
    frames, found, settled = len(q_TN), [q_TN[:0]], 0
    while settled < frames:
        before_LN = np.concatenate(found[-2:])[-task.smoothness.reach :]
        part = slice(settled - len(before_LN), settled + WINDOW)
        motion_XN = _smooth_window(problem, q_TN[part], task.at(part), before_LN)
        used = WINDOW - AHEAD if settled + WINDOW < frames else WINDOW
        found.append(motion_XN[len(before_LN) :][:used])
        settled += used
    return nearest_slow(np.concatenate(found), task.step_N)


def _smooth_window(problem: Problem, q_TN: np.ndarray, task: Task, before_LN: np.ndarray) -> np.ndarray:
    """`smooth_motion` of one window, whose first frames are settled (L, N)."""
    smoothness, target_TD3 = task.smoothness, task.target_TD3
    fixed_T = np.arange(len(q_TN)) < len(before_LN)
    path_TN = np.concatenate((before_LN, q_TN[len(before_LN) :]))

    def polish(path_TN: np.ndarray) -> np.ndarray:
        motion_TN, _ = refine(problem, path_TN, target_TD3, smoothness, SWEEPS, TOLERANCE, fixed_T)
        return keep_speed(problem, motion_TN, target_TD3, smoothness, task.step_N, task.around, fixed_T)

    def polish_own(path_TN: np.ndarray) -> list[np.ndarray]:
        return [polish(path_TN)]

    def polish_others(path_TN: np.ndarray) -> list[np.ndarray]:
        return side_by_side(polish, _other_paths(problem, path_TN, target_TD3, smoothness.pull, len(before_LN)))

    ways = side_by_side(lambda work: work(path_TN), (polish_own, polish_others))
    motion_TN, *others = motions = [motion_TN for way in ways for motion_TN in way]
    if others:
        cost_SC = np.stack([motion_cost(problem, own_TN, target_TD3, smoothness) for own_TN in motions])
        motion_TN = np.choose(cost_SC.argmin(axis=0)[problem.cost.block_N], motions)
    motion_TN, smoothness = smooth_detours(
        problem, motion_TN, target_TD3, smoothness, task.frame_rate, task.step_N, fixed_T
    )
    if task.giving_way is None:
        return motion_TN
    return task.giving_way.in_motion(motion_TN, target_TD3, smoothness, task.step_N, task.around, fixed_T)


def _other_paths(
    problem: Problem, path_TN: np.ndarray, target_TD3: np.ndarray, pull: float, settled: int
) -> list[np.ndarray]:
    """Other paths (T, N), of which some frames are settled, through answers that are found from either side of the
    path's jumps, for each of `PRICES`; none if it does not jump, or no other is better.
    """
    if not (np.abs(np.diff(path_TN, axis=0)) > JUMP).any():
        return []
    path_cost_TC = problem.quadratic(path_TN, target_TD3).cost_BC
    path_cost_TC[:settled] = 0.0
    more_TSN, more_cost_TSC = _bridge(problem, path_TN, path_cost_TC, target_TD3)
    candidates_TSN = np.concatenate((path_TN[:, None], more_TSN), axis=1)
    cost_TSC = np.concatenate((path_cost_TC[:, None], more_cost_TSC), axis=1)
    candidates_TSN[:settled], cost_TSC[:settled] = path_TN[:settled, None], 0.0
    paths = [path_TN]
    for price in PRICES:
        other_TN = best_path(candidates_TSN, cost_TSC, problem.cost.joints_NC, pull * price)
        if all((np.abs(other_TN - known_TN) > JUMP).any() for known_TN in paths):
            paths.append(other_TN)
    return paths[1:]


def best_path(candidates_TSN: np.ndarray, cost_TSC: np.ndarray, joints_NC: np.ndarray, pull: float) -> np.ndarray:
    """Each block's cheapest path (T, N) [rad] through its candidates (dynamic programming)."""
    cost_TCS = cost_TSC.swapaxes(1, 2)
    total_CS, back = cost_TCS[0], []
    for before_SN, after_SN, cost_CS in zip(candidates_TSN[:-1], candidates_TSN[1:], cost_TCS[1:], strict=True):
        move_SSC = (before_SN[:, None] - after_SN) ** 2 @ joints_NC * pull
        reached_CSS = total_CS[:, :, None] + np.moveaxis(move_SSC, -1, 0)
        back.append(reached_CSS.argmin(axis=1))
        total_CS = reached_CSS.min(axis=1) + cost_CS
    block_C = np.arange(len(total_CS))
    states = [total_CS.argmin(axis=1)]
    for came_from_CS in reversed(back):
        states.append(came_from_CS[block_C, states[-1]])
    state_TN = np.array(states[::-1])[:, joints_NC.argmax(axis=1)]
    return np.take_along_axis(candidates_TSN, state_TN[:, None], axis=1)[:, 0]


def _bridge(
    problem: Problem, path_TN: np.ndarray, path_cost_TC: np.ndarray, target_TD3: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """More candidates (T, S, N) near the path's jumps and between them, and their cost (T, S, C); elsewhere the path is
    repeated.
    """
    frame_T1, jumped_TN = np.arange(len(path_TN))[:, None], np.zeros(path_TN.shape, bool)
    jumped_TN[1:] = np.abs(np.diff(path_TN, axis=0)) > JUMP
    jumps_T = jumped_TN.any(axis=1).cumsum()
    source_TS = np.clip(frame_T1 + np.array(REACH), 0, len(path_TN) - 1)
    across_TS = jumps_T[source_TS] != jumps_T[:, None]
    joints_NC, block_N = problem.cost.joints_NC, problem.cost.block_N
    side_TSC = sides(jumped_TN @ joints_NC > 0)
    sides_TS = (side_TSC != frame_T1[..., None]).any(axis=2)
    starts = path_TN[source_TS], path_TN[side_TSC[:, :, block_N], np.arange(path_TN.shape[1])]
    start_TSN, asked_TS = np.concatenate(starts, axis=1), np.concatenate((across_TS, sides_TS), axis=1)
    found_TSN, cost_TSC = (np.repeat(value[:, None], asked_TS.shape[1], axis=1) for value in (path_TN, path_cost_TC))
    frame_X = np.nonzero(asked_TS)[0]
    found_TSN[asked_TS], cost_TSC[asked_TS] = problem.minimise(
        start_TSN[asked_TS], target_TD3[frame_X], BRIDGE_STEPS, BRIDGE_TOLERANCE
    )
    return found_TSN, cost_TSC


def sides(jumped_TC: np.ndarray) -> np.ndarray:
    """For each frame and block, the last frame before the block's last jump, and the first after its next one
    (T, 2, C); the frame itself where there is none that is not far.

    Args:
        jumped_TC: whether a block jumped to a frame from the one before it.
    """
    frames, frame_T1 = len(jumped_TC), np.arange(len(jumped_TC))[:, None]
    never = frames + FAR + 1
    before_TC = np.maximum.accumulate(np.where(jumped_TC, frame_T1 - 1, -never))
    next_TC = np.roll(np.where(jumped_TC, frame_T1, 2 * never), -1, axis=0)  # nothing jumps to the first frame
    after_TC = np.minimum.accumulate(next_TC[::-1])[::-1]
    side_T2C = np.stack((before_TC, after_TC), axis=1)
    return np.where(np.abs(side_T2C - frame_T1[:, None]) <= FAR, side_T2C, frame_T1[:, None])
