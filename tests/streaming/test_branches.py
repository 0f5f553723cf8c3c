"""The answer that is followed is left for a better one, but not for every breath."""

from __future__ import annotations

import math

import pytest
import torch

from mrhubo.reference import OptimizationRetargeter
from mrhubo.retargeter import Retargeter
from mrhubo.streaming import StreamSettings
from mrhubo.streaming.branches import Branches, BranchState
from tests.poses import prior_poses


@pytest.mark.parametrize("wait", [0.2, 0.05])
def test_a_worse_branch_is_left_after_the_time_that_is_set_and_not_before(retargeter: Retargeter, wait: float) -> None:
    problem = retargeter.directions
    pose = prior_poses(60, 2)
    target = problem.body_map.human_directions(pose)
    best, _ = OptimizationRetargeter(retargeter.body_map).solve_frames(pose)
    start = problem.robot.sample(60, torch.Generator().manual_seed(0))
    stuck, cost = problem.minimise(start, target, 40)
    weight = (target.norm(dim=-1) * problem.directions.weight_D) @ problem.blocks.directions_DC
    excess = torch.rad2deg((cost / weight).sqrt() - (problem.cost(best, target) / weight).sqrt())
    worse, alike = excess > 6, excess.abs() < 4
    assert bool(worse.any()) and bool(alike.any())

    branches, passed = Branches(problem, StreamSettings(worse_time=wait)), torch.full((60,), 1 / 60)
    state, block = BranchState.at(stuck, 2), problem.blocks.block_N
    crossed = torch.zeros_like(stuck, dtype=torch.bool)
    for frame in range(1, round(60 * wait) + 3):
        state, velocity, begun = branches.advance(state, best, target, passed)
        crossed |= begun
        left = ((state.kept_BN - best).abs() @ problem.blocks.joints_NC) < 0.3 * (
            (stuck - best).abs() @ problem.blocks.joints_NC
        )
        if frame <= math.floor(60 * wait) - 1:
            assert not bool(left[worse].any()), frame
            assert float((state.kept_BN - stuck).abs().max()) < 0.3 and not bool(crossed.any())
        assert float((velocity.abs() / problem.robot.velocity_N).max()) <= 1 + 1e-5
    assert bool(left[worse].all())
    assert bool(crossed[worse[:, block]].all()), "who stood still elsewhere crosses over"
    stays = alike & ~worse
    assert float((state.kept_BN - stuck).abs()[stays[:, block]].max()) < 0.3
    assert bool((problem.cost(state.kept_BN, target) <= cost + 1e-4).all())


def test_the_pull_holds_what_the_limbs_leave_open(retargeter: Retargeter) -> None:
    """From one frame to the next a well determined arm goes nearly all of the way, and no joint faster than it can."""
    problem = retargeter.directions
    q = 0.5 * (problem.lower_N + problem.upper_N) + 0.2 * torch.randn(40, 8, generator=torch.Generator().manual_seed(0))
    q = q.clamp(problem.lower_N, problem.upper_N)
    moved = (q + 0.03).clamp(problem.lower_N, problem.upper_N)
    target = problem.body_map.robot_directions(problem.robot.forward(moved))
    passed = torch.full((40,), 1 / 60)
    state, *_ = Branches(problem, StreamSettings()).advance(BranchState.at(q, 2), q, target, passed)
    before, after = problem.cost(q, target), problem.cost(state.kept_BN, target)
    assert float((after.sqrt() / before.sqrt()).max()) < 0.25
    far = problem.robot.sample(40, torch.Generator().manual_seed(3))
    state, *_ = Branches(problem, StreamSettings(smoothness=0)).advance(BranchState.at(far, 2), q, target, passed)
    assert bool(((state.kept_BN - far).abs() <= problem.robot.velocity_N / 60 * (1 + 1e-5)).all())


def test_who_is_only_behind_does_not_cross_over(retargeter: Retargeter) -> None:
    """Where joints turn as fast as they can towards what the human shows, another answer is taken up, without a pause."""
    problem, passed = retargeter.directions, torch.full((60,), 1 / 60)
    pose = prior_poses(60, 2)
    target = problem.body_map.human_directions(pose)
    best, _ = OptimizationRetargeter(retargeter.body_map).solve_frames(pose)
    generator = torch.Generator().manual_seed(0)
    behind = (best + 0.6 * torch.randn(60, 8, generator=generator)).clamp(problem.lower_N, problem.upper_N)
    branches = Branches(problem, StreamSettings(worse_time=0, worse_deg=2, smoothness=0))
    state, velocity, begun = branches.advance(BranchState.at(behind, 2), best, target, passed)
    joints = problem.blocks.joints_NC
    left = ((state.kept_BN == best) | (velocity == 0)).float() @ joints == joints.sum(dim=0)
    own = Branches(problem, StreamSettings(worse_time=1e3, smoothness=0))
    step = (own.advance(BranchState.at(behind, 2), best, target, passed)[0].kept_BN - behind).abs()
    held = ((step >= 0.999 * problem.robot.velocity_N / 60).float() @ joints) > 0
    assert int((left & held).sum()) > 20, "hardly any arm is held up"
    assert not bool(begun[held[:, problem.blocks.block_N]].any())
