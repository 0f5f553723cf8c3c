from __future__ import annotations

import itertools

import pytest
import torch

from mrhubo.reference import OptimizationRetargeter, trajectory
from mrhubo.reference.refine import refine, refine_around
from mrhubo.reference.speed import speed_bound
from mrhubo.reference.terms import Smoothness
from mrhubo.reference.trajectory import MotionTask, best_path, pick, smooth_motion


def test_best_path_equals_trying_all() -> None:
    generator = torch.Generator().manual_seed(0)
    candidates_TSN, cost_TSC = torch.randn(5, 3, 4, generator=generator), torch.rand(5, 3, 2, generator=generator)
    joints_NC = torch.tensor([[1.0, 0], [1, 0], [0, 1], [0, 1]])
    path_TN, path_cost_TC = best_path(candidates_TSN, cost_TSC, joints_NC, 0.1)
    for block in range(2):
        joints_N = joints_NC[:, block].bool()

        def total(states: tuple[int, ...], block: int = block, joints_N: torch.Tensor = joints_N) -> float:
            q_TN = torch.stack([candidates_TSN[t, s, joints_N] for t, s in enumerate(states)])
            costs = sum(float(cost_TSC[t, s, block]) for t, s in enumerate(states))
            return costs + 0.1 * float(q_TN.diff(dim=0).square().sum())

        best = min(itertools.product(range(3), repeat=5), key=total)
        expected_TN = torch.stack([candidates_TSN[t, s, joints_N] for t, s in enumerate(best)])
        torch.testing.assert_close(path_TN[:, joints_N], expected_TN)
        torch.testing.assert_close(
            path_cost_TC[:, block], torch.stack([cost_TSC[t, s, block] for t, s in enumerate(best)])
        )


def test_pick_takes_each_block_from_its_own_candidate() -> None:
    candidates_TSN = torch.arange(12.0).reshape(1, 3, 4)
    joints_NC = torch.tensor([[1.0, 0], [0, 1], [1, 0], [0, 1]])
    assert pick(candidates_TSN, torch.tensor([[2, 0]]), joints_NC).tolist() == [[8.0, 1.0, 10.0, 3.0]]


def test_refined_motion_is_a_minimum(retargeters: dict[str, OptimizationRetargeter]) -> None:
    """Few frames, out of reach in part: no small change inside the limits lowers the motion's cost."""
    problem = retargeters["nao"].problem
    generator, pull, directions = torch.Generator().manual_seed(2), 0.05, len(problem.body_map.directions)
    target_TD3 = torch.nn.functional.normalize(torch.randn(1, directions, 3, generator=generator), dim=-1)
    target_TD3 = torch.nn.functional.normalize(
        target_TD3 + 0.3 * torch.randn(6, directions, 3, generator=generator), dim=-1
    )

    def cost(q_TN: torch.Tensor) -> float:
        each_TC = problem.quadratic(q_TN, target_TD3).cost_BC.double()
        return float(each_TC.sum() + pull * q_TN.diff(dim=0).double().square().sum())

    start_TN = problem.robot.sample(6, generator)
    q_TN, cost_C = refine(problem, start_TN, target_TD3, Smoothness(pull), sweeps=200, tolerance=1e-9)
    assert float(cost_C.sum()) < cost(start_TN)
    assert abs(cost(q_TN) - float(cost_C.sum())) < 1e-4
    for _ in range(100):
        moved_TN = q_TN + 0.02 * torch.randn(q_TN.shape, generator=generator)
        assert cost(torch.clamp(moved_TN, problem.lower_N, problem.upper_N)) > cost(q_TN) - 1e-5


def test_a_block_may_be_refined_alone(retargeters: dict[str, OptimizationRetargeter]) -> None:
    """The others stay to the bit, and it ends where it ends when all are refined."""
    problem, generator = retargeters["nao"].problem, torch.Generator().manual_seed(3)
    q_TN, goal_TN = (problem.robot.sample(8, generator) for _ in range(2))
    target_TD3 = problem.body_map.robot_directions(problem.robot.forward(goal_TN))
    blocks_C = torch.tensor([True] + [False] * (problem.blocks.joints_NC.shape[1] - 1))
    moves_N = blocks_C[problem.blocks.block_N]
    all_TN, one_TN = (
        refine(problem, q_TN, target_TD3, Smoothness(0.02), blocks_C=chosen)[0] for chosen in (None, blocks_C)
    )
    assert torch.equal(one_TN[:, ~moves_N], q_TN[:, ~moves_N]) and not torch.equal(
        all_TN[:, ~moves_N], q_TN[:, ~moves_N]
    )
    torch.testing.assert_close(one_TN[:, moves_N], all_TN[:, moves_N], rtol=0, atol=1e-5)


def test_stretches_are_refined_as_if_they_were_alone(retargeters: dict[str, OptimizationRetargeter]) -> None:
    """Far from each other, so that nothing of one is seen in the other; frames between them stay to the bit."""
    problem, generator = retargeters["nao"].problem, torch.Generator().manual_seed(4)
    q_TN, goal_TN = (problem.robot.sample(40, generator) for _ in range(2))
    target_TD3 = problem.body_map.robot_directions(problem.robot.forward(goal_TN))
    number_T = torch.arange(40)
    first_T, last_T = (number_T >= 5) & (number_T < 12), number_T >= 30

    def refined(free_T: torch.Tensor) -> torch.Tensor:
        return refine_around(problem, q_TN, target_TD3, Smoothness(0.02), free_T, sweeps=30, tolerance=1e-4)

    both_TN = refined(first_T | last_T)
    assert torch.equal(both_TN[~(first_T | last_T)], q_TN[~(first_T | last_T)])
    for free_T in (first_T, last_T):
        assert torch.equal(both_TN[free_T], refined(free_T)[free_T]) and not torch.equal(both_TN[free_T], q_TN[free_T])


def test_windows_do_not_show(retargeters: dict[str, OptimizationRetargeter], monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion that is worked on in windows of a few seconds is the same as in one piece, and as slow as it must be."""
    problem = retargeters["nao"].problem
    generator, rate = torch.Generator().manual_seed(5), 24.0
    keys_1NK = problem.robot.sample(10, generator).T[None]
    q_TN = torch.nn.functional.interpolate(keys_1NK, size=400, mode="linear")[0].T.contiguous()
    target_TD3 = problem.body_map.robot_directions(problem.robot.forward(q_TN))
    jerk_YN = torch.full((397, 8), 0.5)
    task = MotionTask(
        target_TD3, Smoothness(0.02, jerk_YN), rate, *speed_bound(problem.robot.velocity_N / 2, rate), sweeps=30
    )
    found = []
    for window, ahead in ((1000, 100), (220, 110)):
        monkeypatch.setattr(trajectory, "WINDOW", window)
        monkeypatch.setattr(trajectory, "AHEAD", ahead)
        found.append(smooth_motion(problem, q_TN[:, None], problem.cost(q_TN, target_TD3)[:, None], task))
        assert bool((found[-1].diff(dim=0).abs() * rate <= problem.robot.velocity_N / 2).all())
    torch.testing.assert_close(*found, atol=5e-3, rtol=0)
