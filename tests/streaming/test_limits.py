"""Joints never leave their limits of angle, speed and acceleration, whatever the goal and the times."""

from __future__ import annotations

import pytest
import torch

from mrhubo.retargeter import Retargeter
from mrhubo.streaming.limits import JointLimits, JointState


@pytest.mark.parametrize("ramp", [0.0, 0.05, 0.5])
@pytest.mark.parametrize("regular", [True, False])
def test_nothing_is_exceeded(retargeter: Retargeter, ramp: float, regular: bool) -> None:
    robot = retargeter.body_map.robot
    limits, generator = JointLimits(robot, ramp), torch.Generator().manual_seed(0)
    state = JointState.at_rest(robot.sample(20, generator))
    goal = robot.sample(20, generator)
    for frame in range(300):
        if frame % 7 == 0:  # now and then wild, and the speed that is claimed is a lie
            goal = robot.sample(20, generator)
        passed = torch.full((20,), 1 / 60) if regular else 10 ** (-3 * torch.rand(20, generator=generator) - 0.7)
        new = limits.follow(state, goal, 9 * torch.randn(20, 8, generator=generator), passed)
        assert bool(((new.q_BN >= robot.lower_N) & (new.q_BN <= robot.upper_N)).all())
        moved = new.q_BN.double() - state.q_BN.double()
        assert bool((moved.abs() <= robot.velocity_N.double() * passed.double()[:, None]).all())
        if ramp:
            change = (new.velocity_BN - state.velocity_BN).abs() / passed.double()[:, None]
            rounding = 1e-6 / passed.double().square()[:, None]
            assert bool((change <= robot.velocity_N / ramp * (1 + 1e-5) + rounding).all())
        state = new


@pytest.mark.parametrize("ramp", [0.0, 0.05, 0.5])
def test_a_goal_is_reached_without_passing_by_and_kept(retargeter: Retargeter, ramp: float) -> None:
    robot = retargeter.body_map.robot
    limits = JointLimits(robot, ramp)
    start, goal = robot.lower_N[None], robot.upper_N[None]  # the longest ways, to a limit
    state, passed, still = JointState.at_rest(start), torch.tensor([1 / 60]), torch.zeros(1, 8)
    path = [start]
    for _ in range(int(60 * (2 * ramp + 1.5 * float(((goal - start) / robot.velocity_N).max()))) + 2):
        state = limits.follow(state, goal, still, passed)
        path.append(state.q_BN)
    whole = torch.cat(path)
    assert bool((whole.diff(dim=0) >= -1e-6).all()) and float((whole[-1] - goal).abs().max()) < 1e-3
    fastest = (whole.diff(dim=0).amax(dim=0) * 60 / robot.velocity_N).max()
    assert float(fastest) > (0.99 if ramp < 0.1 else 0.6)


def test_a_goal_within_the_limits_is_followed_without_lag(retargeter: Retargeter) -> None:
    robot = retargeter.body_map.robot
    limits, middle, passed = JointLimits(robot, 0.1), (robot.lower_N + robot.upper_N) / 2, torch.tensor([1 / 60])
    time_T = torch.arange(200) / 60
    goal_TN = middle + 0.3 * (1 - torch.cos(2 * time_T))[:, None]
    state = JointState.at_rest(goal_TN[:1])
    for last, goal in zip(goal_TN, goal_TN[1:], strict=False):
        state = limits.follow(state, goal[None], ((goal - last) * 60)[None], passed)
        assert float((state.q_BN - goal).abs().max()) < 1e-5
