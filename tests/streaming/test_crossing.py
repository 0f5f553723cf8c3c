"""Who crosses over to another answer takes the time that is set, all joints of an arm together, and no longer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from mrhubo.fast.plain import crossing as in_numpy
from mrhubo.retargeter import Retargeter
from mrhubo.streaming import StreamSettings
from mrhubo.streaming.crossing import Crossing
from mrhubo.streaming.limits import JointLimits, JointState

RATE = 120.0
PASSED = torch.tensor([1 / RATE])


@pytest.fixture(scope="module")
def ends(retargeter: Retargeter) -> tuple[Tensor, Tensor]:
    """Where 40 robots stand, and where they are to go: some of their joints far, some near."""
    robot, generator = retargeter.body_map.robot, torch.Generator().manual_seed(0)
    start_BN, end_BN = robot.sample(40, generator), robot.sample(40, generator)
    share_BN = torch.rand(40, 8, generator=generator) ** 3
    return start_BN, start_BN + share_BN * (end_BN - start_BN)


def run(
    retargeter: Retargeter, start_BN: Tensor, goal_BN: Tensor, settings: StreamSettings, seconds: float
) -> tuple[Tensor, Tensor]:
    """Joint angles (T, B, N) on the way, and for how long each joint was to cross over [s]."""
    limits, blocks = JointLimits(retargeter.body_map.robot, settings.ramp_time), retargeter.directions.blocks
    state, still_BN = JointState.at_rest(start_BN), torch.zeros_like(start_BN)
    crossing, begun_BN = Crossing.none(start_BN), torch.ones_like(start_BN, dtype=torch.bool)
    crossing = crossing.begun(blocks, settings, begun_BN, (goal_BN - start_BN).double().abs(), limits.speed_N)
    left_BN, path = crossing.left_BN, [start_BN]
    for _ in range(round(seconds * RATE)):
        on_way = crossing.goals(state.q_BN, state.velocity_BN, goal_BN, still_BN, PASSED)
        state, crossing = limits.follow(state, *on_way, PASSED), crossing.after(PASSED)
        path.append(state.q_BN)
    return torch.stack(path), left_BN


@pytest.mark.parametrize("time", [0.05, 0.1, 0.4])
def test_they_arrive_gently_in_the_time_that_is_theirs(
    retargeter: Retargeter, ends: tuple[Tensor, Tensor], time: float
) -> None:
    """They never speed up or brake more than the time allows, never pass by, and the one with the longest way needs
    what it was given, to a tenth.
    """
    (start_BN, goal_BN), speed_N = ends, retargeter.body_map.robot.velocity_N
    path_TBN, left_BN = run(retargeter, start_BN, goal_BN, StreamSettings(crossing_time=time), 3.0)
    block_N, alike = retargeter.directions.blocks.block_N, left_BN
    for block in (0, 1):
        assert torch.equal(alike[:, block_N == block], alike[:, block_N == block][:, :1].expand(-1, 4))
    acceleration_TBN = path_TBN.double().diff(n=2, dim=0) * RATE**2
    assert float((acceleration_TBN.abs() / (speed_N / time)).max()) < 1.02
    way_BN, done_TBN = goal_BN - start_BN, path_TBN - start_BN
    assert float((done_TBN * way_BN.sign() - way_BN.abs()).max()) < 1e-5, "a joint passed by"
    assert float((path_TBN[-1] - goal_BN).abs().max()) < 1e-4
    there_BN = ((path_TBN - goal_BN).abs() > 0.005 * way_BN.abs() + 1e-5).sum(dim=0) / RATE
    assert bool((there_BN <= left_BN + 1.5 / RATE).all())
    slowest_B, given_B = there_BN.amax(dim=1), left_BN.amax(dim=1)
    assert bool((slowest_B > 0.85 * given_B - 1.5 / RATE).all())


def test_who_may_be_as_quick_as_the_limits_is(retargeter: Retargeter, ends: tuple[Tensor, Tensor]) -> None:
    start_BN, goal_BN = ends
    hard_TBN, left_BN = run(retargeter, start_BN, goal_BN, StreamSettings(crossing_time=0.02, ramp_time=0.02), 1.0)
    assert not bool(left_BN.any())
    limits, state = JointLimits(retargeter.body_map.robot, 0.02), JointState.at_rest(start_BN)
    for q_BN in hard_TBN[1:]:
        state = limits.follow(state, goal_BN, torch.zeros_like(start_BN), PASSED)
        assert torch.equal(state.q_BN, q_BN)


def test_after_its_time_a_joint_follows_its_goal_whatever_that_did(
    retargeter: Retargeter, ends: tuple[Tensor, Tensor]
) -> None:
    """A goal that runs on while the joints cross over is caught up with, as quickly as ever."""
    robot, settings = retargeter.body_map.robot, StreamSettings()
    limits, blocks = JointLimits(robot, settings.ramp_time), retargeter.directions.blocks
    start_BN, goal_BN = ends
    state, run_on = JointState.at_rest(start_BN), 0.3 * robot.velocity_N
    crossing = Crossing.none(start_BN).begun(
        blocks,
        settings,
        torch.ones_like(start_BN, dtype=torch.bool),
        (goal_BN - start_BN).double().abs(),
        limits.speed_N,
    )
    left, time = float(crossing.left_BN.max()), 0.0
    while time < 2 * left + 0.5:
        time += 1 / RATE
        last_BN, goal_BN = goal_BN, (goal_BN + run_on / RATE).clamp(robot.lower_N, robot.upper_N)
        on_way = crossing.goals(state.q_BN, state.velocity_BN, goal_BN, (goal_BN - last_BN) * RATE, PASSED)
        state, crossing = limits.follow(state, *on_way, PASSED), crossing.after(PASSED)
    assert float((state.q_BN - goal_BN).abs().max()) < 1e-4


@dataclass(frozen=True)
class Joined:
    """What `Crossing` reads of a robot's cost."""

    joints_NC: np.ndarray
    block_N: np.ndarray


def test_numpy_has_the_same_numbers(retargeter: Retargeter, ends: tuple[Tensor, Tensor]) -> None:
    robot, blocks, settings = retargeter.body_map.robot, retargeter.directions.blocks, StreamSettings()
    cost: Any = Joined(blocks.joints_NC.double().numpy(), blocks.block_N.numpy())
    generator, speed_N = torch.Generator().manual_seed(2), robot.velocity_N.double()
    start_BN, goal_BN = (end.double() for end in ends)
    velocity_BN, turning_BN = torch.randn(2, 40, 8, generator=generator, dtype=torch.float64)
    begun_BN = torch.rand(40, 8, generator=generator) < 0.5
    distance_BN, crossing = (goal_BN - start_BN).abs(), Crossing.none(start_BN)
    wanted = crossing.begun(blocks, settings, begun_BN, distance_BN, speed_N)
    goals = wanted.goals(start_BN, turning_BN, goal_BN, velocity_BN, PASSED.double())
    for b in range(40):
        found = in_numpy.Crossing.none(8).begun(
            cost, settings, begun_BN[b].numpy(), distance_BN[b].numpy(), speed_N.numpy()
        )
        np.testing.assert_allclose(found.left_N, wanted.left_BN[b], rtol=1e-12)
        at, turns, goal, moves = (part[b].numpy() for part in (start_BN, turning_BN, goal_BN, velocity_BN))
        for one, other in zip(found.goals(at, turns, goal, moves, float(PASSED.double())), goals, strict=True):
            np.testing.assert_allclose(one, other[b], rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(
            found.after(0.05).left_N, wanted.after(torch.full((40,), 0.05)).left_BN[b], atol=1e-8
        )
