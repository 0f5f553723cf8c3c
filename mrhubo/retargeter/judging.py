"""What a retargeter tells of answers beside the joint angles: how near they are, how far to trust them, what touches.

Legend: T frames, D directions, N joints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from mrhubo.reference import angle_between
from mrhubo.retargeter.confidence import Signals, find_signals
from mrhubo.retargeter.result import RetargetResult
from mrhubo.robot.plausibility import read

if TYPE_CHECKING:
    from mrhubo.retargeter.package import Retargeter


def signals_of(retargeter: Retargeter, target_TD3: Tensor, robot_TD3: Tensor, shake_TD: Tensor | None) -> Signals:
    """What tells how far to trust answers, whose directions are given beside the human's; how much these shake, where
    that is known.
    """
    reading = read(retargeter.body_map, retargeter.prior, target_TD3)
    return find_signals(retargeter.branches, target_TD3, robot_TD3, reading, shake_TD)


def judge(retargeter: Retargeter, q_TN: Tensor, target_TD3: Tensor, shake_TD: Tensor | None) -> RetargetResult:
    """Joint angles (T, N) [rad] for a human's directions (T, D, 3), with all that is told of them."""
    body_map, branches = retargeter.body_map, retargeter.branches
    links = body_map.robot.forward(q_TN)
    robot_TD3, columns = body_map.robot_directions(links), body_map.measured
    trust_TC = retargeter.confidence(signals := signals_of(retargeter, target_TD3, robot_TD3, shake_TD))
    nothing_T = torch.zeros_like(q_TN[:, 0])
    return RetargetResult(
        q_TN,
        retargeter.joint_names,
        trust_TC.amin(dim=1) if branches else nothing_T,
        torch.rad2deg(angle_between(robot_TD3[:, columns], target_TD3[:, columns])),
        signals.phi.amax(dim=1) if branches else nothing_T,
        retargeter.collision.touches(q_TN, links),
        trust_TC,
        tuple(branch.name for branch in branches),
        body_map.measured_names,
        robot=retargeter.facts,
    )
