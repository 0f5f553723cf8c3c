"""How far two robot motions are apart, and how far a robot motion is from a human's.

Legend: T frames (or any batch), X steps from one to the next, N joints, D directions, C blocks (see `solve`).
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from mrhubo.errors import UserError, unknown_name
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.terms import REFERENCE_RATE
from mrhubo.robot import BodyMap, LinkPoses, Robot
from mrhubo.rotation import wrap_angle

_AT_LIMIT = 1e-3


def joint_error(q_TN: Tensor, q_ref_TN: Tensor) -> Tensor:
    """Mean absolute difference of joint angles (T,) [rad], modulo 2 pi."""
    return wrap_angle(q_TN - q_ref_TN).abs().mean(dim=-1)


def link_error(
    robot: Robot, q_TN: Tensor, q_ref_TN: Tensor, key_links: Sequence[str], poses: Sequence[LinkPoses] = ()
) -> Tensor:
    """Mean Euclidean distance (T,) [cm] of the key links in the robot's base frame.

    `poses` are the robot's link poses at both, if they are there already.

    Raises:
        UserError: a key link is not among `robot.links`, or there is none.
    """
    if not key_links:
        raise UserError("robot.key_links: is empty; name the links whose error is measured")
    for link in key_links:
        if link not in robot.links:
            raise UserError(f"robot.key_links: {unknown_name('link', link, robot.links)}")
    rows = [robot.link_index(link) for link in key_links]
    position_TL3, reference_TL3 = (
        found.position_BL3[:, rows] for found in poses or map(robot.forward, (q_TN, q_ref_TN))
    )
    return 100 * (position_TL3 - reference_TL3).norm(dim=-1).mean(dim=-1)


def direction_error(body_map: BodyMap, q_TN: Tensor, local_TJ33: Tensor, poses: LinkPoses | None = None) -> Tensor:
    """Angle (T, D) [degrees] between the robot's measured directions (`BodyMap.measured`) and those of human poses,
    local rotations (T, 21, 3, 3).

    `poses` are the robot's link poses at q, if they are there already.
    """
    robot_TD3 = body_map.robot_directions(poses or body_map.robot.forward(q_TN))
    human_TD3 = body_map.human_directions(local_TJ33)
    return torch.rad2deg(angle_between(robot_TD3[:, body_map.measured], human_TD3[:, body_map.measured]))


def at_limit_share(robot: Robot, q_TN: Tensor) -> Tensor:
    """Share of the joints (T,) that are at a limit, within 0.001 rad."""
    return _at_limit(robot, q_TN).mean(dim=-1)


def limit_shares(robot: Robot, q_TN: Tensor) -> Tensor:
    """Share of the frames (N,) in which each joint is at a limit, within 0.001 rad."""
    return _at_limit(robot, q_TN).mean(dim=0)


def _at_limit(robot: Robot, q_TN: Tensor) -> Tensor:
    """1 where a joint is at a limit (T, N), else 0."""
    return ((q_TN - robot.lower_N < _AT_LIMIT) | (robot.upper_N - q_TN < _AT_LIMIT)).float()


def direction_jerk(directions_TD3: Tensor, frame_rate: float) -> Tensor:
    """Mean jerk (T - 3,) [1/s^3] of unit directions (T, D, 3): the length of their third difference in time."""
    return directions_TD3.diff(n=3, dim=0).norm(dim=-1).mean(dim=-1) * frame_rate**3


def angle_between(a: Tensor, b: Tensor) -> Tensor:
    """Angle (...) [rad] in [0, pi] between vectors (..., 3); exact near 0 and pi, where arccos is not."""
    return torch.atan2(torch.linalg.cross(a, b).norm(dim=-1), (a * b).sum(-1))


def count_jumps(problem: DirectionProblem, q_TN: Tensor, target_TD3: Tensor, frame_rate: float) -> int:
    """Steps in which a joint turns by more than 0.5 rad, but the human directions of its block by less than 0.25 rad.

    Both per 1/24 s, whatever the frame rate; a step is counted once per block.
    """
    scale = frame_rate / REFERENCE_RATE
    turned_XC = (q_TN.diff(dim=0).abs()[..., None] * problem.blocks.joints_NC).amax(dim=1) * scale
    columns = problem.body_map.measured
    human_XD = angle_between(target_TD3[1:, columns], target_TD3[:-1, columns])
    asked_XC = (human_XD[..., None] * problem.blocks.directions_DC[columns]).amax(dim=1) * scale
    return int(((turned_XC > 0.5) & (asked_XC < 0.25)).sum())
