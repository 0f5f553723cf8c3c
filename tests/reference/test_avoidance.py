"""Answers that touch the robot itself give way: nearly all become free, near the human, and nothing else moves."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mrhubo.fast.plain.avoidance import CLEARANCE
from mrhubo.reference import Avoidance, OptimizationRetargeter, count_jumps


@pytest.fixture(scope="module")
def avoidances(retargeters: dict[str, OptimizationRetargeter]) -> dict[str, Avoidance]:
    return {name: retargeter.avoidance for name, retargeter in retargeters.items()}


def shown(avoidance: Avoidance, q_BN: Tensor) -> Tensor:
    """Directions of a human who stands as the robot does."""
    return avoidance.problem.body_map.robot_directions(avoidance.problem.robot.forward(q_BN))


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_poses_that_touch_become_free_and_others_stay(avoidances: dict[str, Avoidance], name: str) -> None:
    avoidance, robot = avoidances[name], avoidances[name].problem.robot
    q_BN = robot.sample(600, torch.Generator().manual_seed(0))
    target_BD3 = shown(avoidance, q_BN)
    found_BN = avoidance(q_BN, target_BD3)
    close_B, touched_B = avoidance.close(q_BN), avoidance.collision.collides(q_BN)
    assert bool(close_B[touched_B].all()) and int(touched_B.sum()) > 10
    assert torch.equal(found_BN[~close_B], q_BN[~close_B])
    assert bool(((found_BN >= robot.lower_N) & (found_BN <= robot.upper_N)).all())
    # Random poses touch anywhere and deeply, as no human's do; of those of motions hardly any stays.
    assert float(avoidance.collision.collides(found_BN).sum()) < 0.2 * float(touched_B.sum())
    cost = [avoidance.problem.cost(q, target_BD3).sum(dim=1) for q in (found_BN, q_BN)]
    assert bool((cost[0] <= cost[1]).all())
    few_BN = avoidance(q_BN[close_B][:3], target_BD3[close_B][:3])
    torch.testing.assert_close(few_BN, found_BN[close_B][:3], rtol=0, atol=1e-5)  # sums of few may round otherwise


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_what_a_robot_has_at_home_is_not_fought(
    avoidances: dict[str, Avoidance], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Neither where its shapes are nearer to each other than the clearance, nor where they overlap."""
    avoidance, robot = avoidances[name], avoidances[name].problem.robot
    home_1N = robot.home()[None]
    assert not bool(avoidance.close(home_1N).any())
    poses_BN = robot.sample(200, torch.Generator().manual_seed(1))
    folded_N = poses_BN[avoidance.collision.collides(poses_BN)][0]
    assert bool(avoidance.close(folded_N[None]).all())
    monkeypatch.setattr(robot, "home", lambda: folded_N)
    other = Avoidance(avoidance.problem.body_map)
    assert not bool(other.close(folded_N[None]).any())
    clear_P = other.collision.clearance(CLEARANCE)
    assert float(clear_P.min()) < 0 < CLEARANCE == pytest.approx(float(clear_P.max()))


def test_who_comes_near_gives_way_gradually(
    avoidances: dict[str, Avoidance], retargeters: dict[str, OptimizationRetargeter], make_pose: Callable[..., Tensor]
) -> None:
    """Arms that are lowered to the thighs and beyond: when they come near, no joint leaps."""
    avoidance, retargeter = avoidances["nao"], retargeters["nao"]
    angle = torch.linspace(0.8, 1.7, 200)[:, None] * torch.tensor([0.0, 0.0, 1.0])
    pose_TJ33 = make_pose(left_shoulder=-angle, right_shoulder=angle)
    free_TN = retargeter.solve_frames(pose_TJ33)[0]
    found_TN = avoidance(free_TN, retargeter.body_map.human_directions(pose_TJ33))
    moved_T = (found_TN - free_TN).abs().amax(dim=1)
    first = int(torch.nonzero(moved_T)[0, 0])
    assert 0 < first < 185 and float(moved_T.max()) > 0.05
    assert float(moved_T[first]) < 0.02
    assert float(found_TN[: first + 15].diff(dim=0).abs().max()) < 0.2


def test_a_motion_gives_way_without_jumps_and_at_no_higher_speed(
    retargeters: dict[str, OptimizationRetargeter], make_pose: Callable[..., Tensor]
) -> None:
    """A human who hugs himself from a T pose and lets go, within a second."""
    half = torch.linspace(0, 1, 12)[:, None]
    swing = torch.cat((half, half.flip(0)))
    turns = {}
    for side, sign in (("left", -1), ("right", 1)):
        turns[f"{side}_shoulder"] = swing * torch.tensor([0.0, sign * 1.9, sign * -0.9])
        turns[f"{side}_elbow"] = swing * torch.tensor([0.0, sign * 1.6, 0.0])
    pose_TJ33 = make_pose(**turns)
    retargeter, rate = retargeters["nao"], 24.0
    robot, collision = retargeter.body_map.robot, retargeter.body_map.collision
    plain_TN = retargeter(pose_TJ33, rate).q
    found_TN = retargeter(pose_TJ33, rate, avoid_collisions=True).q
    before, after = (float(collision.collides(q).float().mean()) for q in (plain_TN, found_TN))
    assert before > 0.1 and after < 0.05
    assert bool((found_TN.diff(dim=0).abs() * rate <= robot.velocity_N).all())
    target_TD3 = retargeter.body_map.human_directions(pose_TJ33)
    assert count_jumps(retargeter.problem, found_TN, target_TD3, rate) == 0
    apart = torch.linspace(0, 0.4, 20)[:, None] * torch.tensor([0.0, 0.0, 1.0])
    free_TJ33 = make_pose(left_shoulder=apart)
    assert torch.equal(retargeter(free_TJ33, rate, avoid_collisions=True).q, retargeter(free_TJ33, rate).q)


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_who_stays_gives_way_and_goes_nowhere_else(avoidances: dict[str, Avoidance], name: str) -> None:
    """Robots that touch, of which the human shows something else: they end free, and far nearer to where they were."""
    avoidance, robot = avoidances[name], avoidances[name].problem.robot
    q_BN = robot.sample(600, torch.Generator().manual_seed(0))
    close_B = avoidance.close(q_BN)
    target_BD3 = shown(avoidance, robot.sample(600, torch.Generator().manual_seed(1)))
    stays_BN, goes_BN = avoidance(q_BN, target_BD3, staying=True), avoidance(q_BN, target_BD3)
    assert torch.equal(stays_BN[~close_B], q_BN[~close_B])
    assert bool(((stays_BN >= robot.lower_N) & (stays_BN <= robot.upper_N)).all())
    touched, stay = (float(avoidance.collision.collides(q).sum()) for q in (q_BN, stays_BN))
    assert stay < 0.2 * touched
    own_BD3 = shown(avoidance, q_BN)
    moved, gone = ((shown(avoidance, q) - own_BD3)[close_B].norm(dim=-1).mean() for q in (stays_BN, goes_BN))
    assert float(moved) < 0.4 * float(gone)
    assert torch.equal(stays_BN, avoidance(q_BN, own_BD3 * target_BD3.norm(dim=-1, keepdim=True)))
