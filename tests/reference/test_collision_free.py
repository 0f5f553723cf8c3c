"""The collision-free motion: never a collision, inside the limits, near the other; and what happens when there is none."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.reference import OptimizationRetargeter, collision_free
from mrhubo.reference.collision_free import CollisionFreeProblem, avoid_collisions


def test_quadratic_is_the_cost_and_its_derivative(retargeters: dict[str, OptimizationRetargeter]) -> None:
    problem = CollisionFreeProblem(retargeters["nao"].body_map, margin=0.02)
    q_BN = problem.robot.sample(400, torch.Generator().manual_seed(0))
    q_BN = q_BN[problem.collision.collides(q_BN)][:8]
    target_BD3 = problem.body_map.robot_directions(problem.robot.forward(q_BN.flip(0)))
    model = problem.quadratic(q_BN, target_BD3)
    assert bool((model.cost_BC > retargeters["nao"].problem.quadratic(q_BN, target_BD3).cost_BC.sum(1)[:, None]).all())
    assert float(torch.linalg.eigvalsh(model.hessian_BNN).min()) > 0
    step = 5e-4
    for joint in range(q_BN.shape[1]):
        ends = []
        for sign in (-1, 1):
            moved = q_BN.clone()
            moved[:, joint] += sign * step
            ends.append(problem.quadratic(moved, target_BD3).cost_BC[:, 0])
        difference = (ends[1] - ends[0]) / (2 * step)
        torch.testing.assert_close(2 * model.gradient_BN[:, joint], difference, atol=0.05, rtol=0.03)


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_arms_crossed_through_the_body_come_free(
    name: str, retargeters: dict[str, OptimizationRetargeter], make_pose: Callable[..., Tensor]
) -> None:
    """A human who hugs himself from a T pose and lets go: any robot's forearms would go through its chest."""
    half = torch.linspace(0, 1, 30)[:, None]
    swing = torch.cat((half, half.flip(0)))
    across = {side: swing * torch.tensor([0.0, sign * 1.9, sign * -0.9]) for side, sign in (("left", -1), ("right", 1))}
    bend = {side: swing * torch.tensor([0.0, sign * 1.6, 0.0]) for side, sign in (("left", -1), ("right", 1))}
    pose = make_pose(
        left_shoulder=across["left"], right_shoulder=across["right"], left_elbow=bend["left"], right_elbow=bend["right"]
    )
    retargeter = retargeters[name]
    shapes, robot = retargeter._free_problem.collision, retargeter.body_map.robot
    plain = retargeter.retarget(pose, 24.0)
    assert float(shapes.collides(plain.q_TN).float().mean()) > 0.1
    free = retargeter.retarget_collision_free(pose, 24.0, plain.q_TN)
    assert not bool(shapes.collides(free.q_TN).any()) and not bool(free.rests_T.any())
    assert bool(((free.q_TN >= robot.lower_N) & (free.q_TN <= robot.upper_N)).all())
    assert free.jumps <= plain.jumps + 2  # an arm may have to give way to the other at once
    assert float((free.residual_deg_TD - plain.residual_deg_TD).mean()) < 25


def test_a_motion_without_contact_stays_as_it_is(
    retargeters: dict[str, OptimizationRetargeter], make_pose: Callable[..., Tensor]
) -> None:
    angle = torch.linspace(0, 0.4, 20)[:, None] * torch.tensor([0.0, 0.0, 1.0])
    pose = make_pose(left_shoulder=angle)
    plain = retargeters["nao"].retarget(pose, 24.0)
    assert torch.equal(retargeters["nao"].retarget_collision_free(pose, 24.0).q_TN, plain.q_TN)


def test_frames_that_cannot_be_freed_rest(
    retargeters: dict[str, OptimizationRetargeter], monkeypatch: pytest.MonkeyPatch
) -> None:
    retargeter = retargeters["nao"]
    problem = CollisionFreeProblem(retargeter.body_map)
    q_TN = problem.robot.home().expand(6, -1).clone()
    target_TD3 = problem.body_map.robot_directions(problem.robot.forward(q_TN))
    monkeypatch.setattr(problem.contact, "margin", 10.0)  # something is always near
    monkeypatch.setattr(collision_free, "refine_around", lambda p, q, *a: q)
    monkeypatch.setattr(collision_free, "_start_again", lambda p, pool, q, *a: q)
    touching = torch.tensor([False, True, True, False, False, True])
    q_TN += torch.arange(6.0)[:, None] * 0.01
    monkeypatch.setattr(problem.collision, "collides", lambda q: touching)
    found_TN, rests_T = avoid_collisions(problem, retargeter._pool, q_TN, target_TD3, 0.02)
    assert torch.equal(rests_T, touching)
    assert torch.equal(found_TN, q_TN[[0, 0, 3, 3, 4, 4]])
    monkeypatch.setattr(problem.collision, "collides", lambda q: torch.ones(len(q), dtype=torch.bool))
    with pytest.raises(UserError, match="collides with itself in every pose"):
        avoid_collisions(problem, retargeter._pool, q_TN, target_TD3, 0.02)
