"""From candidates per frame to one smooth motion: the best path through them, then all frames refined together.

    cost(q_1 .. q_T) = sum_t cost_t(q_t)  +  pull * sum_t |q_t - q_(t-1)|^2  + ...        (`terms.smoothness`)

Blocks of joints (see `solve`) share no term, so each has its own path, its own damping and its own accepted steps.

Legend: T frames, X those of a part, L that are settled, S candidates per frame, D directions, N joints, C blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from mrhubo.fast.together.motion import (
    AHEAD,
    BRIDGE_STEPS,
    BRIDGE_TOLERANCE,
    JUMP,
    PRICES,
    REACH,
    WINDOW,
    sides,
)
from mrhubo.reference.avoidance import Avoidance
from mrhubo.reference.detours import smooth_detours
from mrhubo.reference.refine import motion_cost, refine
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.speed import keep_speed, nearest_slow
from mrhubo.reference.terms import Smoothness

_PART = 512


@dataclass(frozen=True)
class MotionTask:
    """What a motion is to follow, and how."""

    target_TD3: Tensor
    """The human's directions."""
    smoothness: Smoothness
    """Of the joints."""
    frame_rate: float
    """Frames per second."""
    step_N: Tensor
    """The longest step of a joint from one frame to the next [rad]."""
    around: int
    """Frames this near to those that were too fast may change."""
    sweeps: int = 100
    tolerance: float = 3e-4
    """How long a motion is refined, as for `refine`."""
    avoidance: Avoidance | None = None
    """What makes frames give way that touch; None: nothing does."""

    def at(self, part: slice) -> MotionTask:
        """The same for some frames alone."""
        frame_X = torch.arange(len(self.target_TD3), device=self.target_TD3.device)[part]
        return replace(self, target_TD3=self.target_TD3[part], smoothness=self.smoothness.at(frame_X))


def smooth_motion(problem: DirectionProblem, candidates_TSN: Tensor, cost_TSC: Tensor, task: MotionTask) -> Tensor:
    """The cheapest motion (T, N) [rad] that is found from candidates (T, S, N) with their blocks' costs (T, S, C);
    without a step that is too long.

    Long motions are worked on in windows, so that memory is bounded, and hard frames do not hold up those that are far
    away. Each begins where the one before has been settled, and looks ahead much further than one frame still matters
    to another: joints that nothing else determines forget within sqrt(pull / ridge of the posture) frames, less than a
    second at any frame rate.
    """
    frames, found, settled = len(candidates_TSN), [candidates_TSN[:0, 0]], 0
    while settled < frames:
        before_LN = torch.cat(found[-2:])[-task.smoothness.reach :]
        part = slice(settled - len(before_LN), settled + WINDOW)
        motion_XN = _smooth_window(problem, candidates_TSN[part], cost_TSC[part], task.at(part), before_LN)
        used = WINDOW - AHEAD if settled + WINDOW < frames else WINDOW
        found.append(motion_XN[len(before_LN) :][:used])
        settled += used
    return nearest_slow(torch.cat(found), task.step_N)


def _smooth_window(
    problem: DirectionProblem, candidates_TSN: Tensor, cost_TSC: Tensor, task: MotionTask, before_LN: Tensor
) -> Tensor:
    """`smooth_motion` of one window, whose first frames are settled (L, N)."""
    smoothness, target_TD3, joints_NC = task.smoothness, task.target_TD3, problem.blocks.joints_NC
    fixed_T = torch.arange(len(candidates_TSN), device=candidates_TSN.device) < len(before_LN)

    def polish(path_TN: Tensor) -> Tensor:
        motion_TN, _ = refine(problem, path_TN, target_TD3, smoothness, task.sweeps, task.tolerance, fixed_T)
        return keep_speed(problem, motion_TN, target_TD3, smoothness, task.step_N, task.around, fixed_T)

    settled = _settled(candidates_TSN, cost_TSC, before_LN)
    path_TN, path_cost_TC = best_path(*settled, joints_NC, smoothness.pull)
    paths = [path_TN]
    more_TSN, more_cost_TSC = _bridge(problem, path_TN, path_cost_TC, target_TD3)
    if more_TSN.shape[1]:
        candidates_TSN, cost_TSC = torch.cat((candidates_TSN, more_TSN), 1), torch.cat((cost_TSC, more_cost_TSC), 1)
        settled = _settled(candidates_TSN, cost_TSC, before_LN)
        for price in PRICES:
            other_TN, _ = best_path(*settled, joints_NC, smoothness.pull * price)
            if all(bool(((other_TN - known_TN).abs() > JUMP).any()) for known_TN in paths):
                paths.append(other_TN)
    motions = [polish(path_TN) for path_TN in paths]
    motion_TN = motions[0]
    if len(motions) > 1:
        cost_SC = torch.stack([motion_cost(problem, own_TN, target_TD3, smoothness) for own_TN in motions])
        motion_TN = pick(torch.stack(motions, 1), cost_SC.argmin(dim=0).expand(len(path_TN), -1), joints_NC)
    motion_TN, smoothness = smooth_detours(
        problem, motion_TN, target_TD3, smoothness, task.frame_rate, task.step_N, fixed_T
    )
    if task.avoidance is None:
        return motion_TN
    return task.avoidance.in_motion(motion_TN, target_TD3, smoothness, task.step_N, task.around, fixed_T)


def _settled(candidates_TSN: Tensor, cost_TSC: Tensor, before_LN: Tensor) -> tuple[Tensor, Tensor]:
    """The candidates and their costs, the first frames' all the same."""
    first = len(before_LN)
    if not first:
        return candidates_TSN, cost_TSC
    settled_LSN = before_LN[:, None].expand(-1, candidates_TSN.shape[1], -1)
    return torch.cat((settled_LSN, candidates_TSN[first:])), torch.cat((0 * cost_TSC[:first], cost_TSC[first:]))


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
    """More candidates (T, S, N) near the path's jumps and between them, and their cost (T, S, C); S = 0 if there is no
    jump.

    Where a path jumps, the solution that it leaves is often only missing for some frames, because it lies at a limit or
    is not the best. It is looked for from the path's angles a few frames before and after; elsewhere the path is
    repeated. A joint at the one end of nearly a turn may also jump to the other end and, seconds later, back, which
    takes it longer than the gain is worth: the solution that a block leaves is looked for until its next jump, and
    the one that it takes then, back to the last one.
    """
    frames, reach_S = len(path_TN), torch.tensor(REACH, device=path_TN.device)
    jumped_TN = torch.nn.functional.pad(path_TN.diff(dim=0).abs() > JUMP, (0, 0, 1, 0))
    jumps_T = jumped_TN.any(dim=1).cumsum(0)
    if not bool(jumps_T[-1]):
        return path_TN.new_empty(frames, 0, path_TN.shape[1]), path_cost_TC.new_empty(frames, 0, path_cost_TC.shape[1])
    frame_T1 = torch.arange(frames, device=path_TN.device)[:, None]
    source_TS = (frame_T1 + reach_S).clamp(0, frames - 1)
    across_TS = jumps_T[source_TS] != jumps_T[:, None]
    jumped_TC = jumped_TN.to(path_TN.dtype) @ problem.blocks.joints_NC > 0
    side_TSC = torch.from_numpy(sides(jumped_TC.cpu().numpy())).to(path_TN.device)
    sides_TS = (side_TSC != frame_T1[:, None]).any(dim=2)
    joint_N = torch.arange(path_TN.shape[1], device=path_TN.device)
    start_TSN = torch.cat((path_TN[source_TS], path_TN[side_TSC[:, :, problem.blocks.block_N], joint_N]), dim=1)
    asked_TS = torch.cat((across_TS, sides_TS), dim=1)
    found_TSN = path_TN[:, None].repeat(1, asked_TS.shape[1], 1)
    cost_TSC = path_cost_TC[:, None].repeat(1, asked_TS.shape[1], 1)
    frame_X = torch.nonzero(asked_TS)[:, 0]
    found_TSN[asked_TS], cost_TSC[asked_TS] = problem.minimise(
        start_TSN[asked_TS], target_TD3[frame_X], steps=BRIDGE_STEPS, tolerance=BRIDGE_TOLERANCE
    )
    return found_TSN, cost_TSC
