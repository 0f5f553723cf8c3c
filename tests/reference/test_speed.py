"""No joint turns faster than it can: the nearest motion that keeps to it, and the best one near that."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from mrhubo.reference import DirectionProblem, OptimizationRetargeter
from mrhubo.reference.refine import motion_cost, refine
from mrhubo.reference.speed import keep_speed, nearest_slow, speed_bound
from mrhubo.reference.terms import Smoothness


def random_walk(frames: int, joints: int, seed: int) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    quick = torch.rand(frames, 1, generator=generator) < 0.2
    return (torch.randn(frames, joints, generator=generator) * (0.05 + quick)).cumsum(0).clamp(-2, 2)


@given(st.integers(1, 60), st.floats(0.01, 1.0), st.integers(0, 1000))
def test_the_nearest_slow_motion(frames: int, step: float, seed: int) -> None:
    """It keeps to the bound and the range; half of what the worst pair of frames asks too much is how far it must go,
    and no motion can do with less.
    """
    q_TN, step_N = random_walk(frames, 3, seed), torch.tensor([step, 2 * step, 1e3])
    found_TN = nearest_slow(q_TN, step_N)
    assert bool((found_TN.diff(dim=0).abs() <= step_N + 1e-6).all())
    assert bool((found_TN.amin(0) >= q_TN.amin(0)).all()) and bool((found_TN.amax(0) <= q_TN.amax(0)).all())
    assert torch.equal(found_TN[:, 2], q_TN[:, 2])
    apart_TT1 = torch.arange(frames)[:, None, None] - torch.arange(frames)[None, :, None]
    asked_N = ((q_TN[:, None] - q_TN[None]).abs() - apart_TT1.abs() * step_N).amax(dim=(0, 1)).clamp(min=0) / 2
    torch.testing.assert_close((found_TN - q_TN).abs().amax(0), asked_N, atol=1e-5, rtol=0)


def test_a_long_motion_loses_no_digits() -> None:
    q_TN = random_walk(100_000, 1, 0)
    found_TN = nearest_slow(q_TN, torch.tensor([0.3]))
    assert float(found_TN.diff(dim=0).abs().max()) <= 0.3 + 1e-6
    assert torch.equal(nearest_slow(found_TN, torch.tensor([0.3 + 1e-6])), found_TN)


@pytest.mark.parametrize("rate", [1.0, 24.0, 60.0, 1000.0])
def test_rounded_angles_keep_to_the_bound(rate: float) -> None:
    velocity_N = torch.tensor([0.5, 8.0, 12.0])
    step_N, around = speed_bound(velocity_N, rate)
    q_TN = nearest_slow(3 * random_walk(500, 3, 1), step_N)
    assert bool((q_TN.diff(dim=0).abs() * rate <= velocity_N).all())
    assert bool((step_N > 0.99 * velocity_N / rate).all()) and around == math.ceil(rate / 2)


@pytest.fixture(scope="module")
def quick(retargeters: dict[str, OptimizationRetargeter]) -> tuple[DirectionProblem, Tensor, Tensor]:
    """A robot that runs from one pose to another and back with one arm; the other arm takes its time."""
    problem = retargeters["nao"].problem
    ends_EN = problem.robot.sample(2, torch.Generator().manual_seed(3))
    part_T = (torch.arange(60)[:, None] - 30).div(4).sigmoid()
    slow_T = torch.linspace(0, 0.2, 60)[:, None]
    q_TN = torch.cat((ends_EN[0, :4].lerp(ends_EN[1, :4], part_T), ends_EN[0, 4:].lerp(ends_EN[1, 4:], slow_T)), dim=1)
    return problem, q_TN, problem.body_map.robot_directions(problem.robot.forward(q_TN))


def test_the_best_slow_motion_is_better_than_the_nearest_one(quick: tuple[DirectionProblem, Tensor, Tensor]) -> None:
    problem, q_TN, target_TD3 = quick
    step_N, smoothness = torch.full((8,), 0.09), Smoothness(0.02)
    nearest_TN = nearest_slow(q_TN, step_N)
    assert float((nearest_TN - q_TN).abs().max()) > 0.1
    found_TN = keep_speed(problem, q_TN, target_TD3, smoothness, step_N, around=5)
    assert bool((found_TN.diff(dim=0).abs() <= step_N + 1e-6).all())
    assert bool(((found_TN >= problem.lower_N) & (found_TN <= problem.upper_N)).all())
    nearest_C, found_C = (motion_cost(problem, motion, target_TD3, smoothness) for motion in (nearest_TN, found_TN))
    assert float(found_C[0]) < 0.9 * float(nearest_C[0])
    assert torch.equal(found_TN[:, 4:], q_TN[:, 4:])  # the other arm was slow enough
    far_T = (nearest_TN != q_TN).any(dim=1).nonzero()[0] - 5
    assert int(far_T) > 2 and torch.equal(found_TN[: int(far_T)], q_TN[: int(far_T)])


def test_a_slow_motion_stays_as_it_is(quick: tuple[DirectionProblem, Tensor, Tensor]) -> None:
    problem, q_TN, target_TD3 = quick
    assert keep_speed(problem, q_TN, target_TD3, Smoothness(0.02), torch.full((8,), 2.0), around=10) is q_TN


def test_settled_frames_stay(quick: tuple[DirectionProblem, Tensor, Tensor]) -> None:
    problem, q_TN, target_TD3 = quick
    fixed_T = torch.arange(60) < 28
    found_TN, _ = refine(problem, q_TN + 0.01, target_TD3, Smoothness(0.02), fixed_T=fixed_T)
    assert torch.equal(found_TN[:28], q_TN[:28] + 0.01) and not torch.equal(found_TN[28:], q_TN[28:] + 0.01)
    step_N = torch.full((8,), float(q_TN[:29].diff(dim=0).abs().max()))
    found_TN = keep_speed(problem, q_TN, target_TD3, Smoothness(0.02), step_N, around=40, fixed_T=fixed_T)
    assert bool((found_TN.diff(dim=0).abs() <= step_N + 1e-6).all()) and torch.equal(found_TN[:28], q_TN[:28])
