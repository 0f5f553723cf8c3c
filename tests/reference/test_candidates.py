"""Of a motion, few frames need all starts, and what is found among the others' candidates is no worse."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.candidates import along_motion, from_starts
from mrhubo.reference.refine import motion_cost
from mrhubo.reference.starts import StartPool
from tests.reference.standing.steppers import bow
from tests.reference.walkers import walker

RATE = 60.0


@pytest.fixture(scope="module")
def retargeter(tmp_path_factory: pytest.TempPathFactory) -> OptimizationRetargeter:
    return OptimizationRetargeter(walker(tmp_path_factory.mktemp("walker"), waist=True))


@pytest.fixture(scope="module")
def bowing(retargeter: OptimizationRetargeter) -> Tensor:
    return retargeter.body_map.human_directions(bow(120, RATE).local_TJ33)


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of frames that all starts were looked up for."""
    counts: list[int] = []
    near = StartPool.near

    def counted(pool: StartPool, target_BD3: Tensor) -> Tensor:
        counts.append(len(target_BD3))
        return near(pool, target_BD3)

    monkeypatch.setattr(StartPool, "near", counted)
    return counts


def test_a_motion_costs_no_more_of_few_starts(
    retargeter: OptimizationRetargeter, bowing: Tensor, started: list[int]
) -> None:
    problem, smoothness = retargeter.problem, retargeter._smoothness(RATE)
    few = along_motion(problem, retargeter._pool, bowing, RATE, smoothness.pull)
    assert sum(started) < len(bowing) / 4
    every = from_starts(problem, retargeter._pool, bowing)
    assert few[0].shape == every[0].shape and few[1].shape == every[1].shape
    cheap_C, whole_C = (
        motion_cost(problem, retargeter._motion(bowing, found, RATE), bowing, smoothness) for found in (few, every)
    )
    assert bool((cheap_C < 1.001 * whole_C + 1e-6).all())


def test_costs_are_those_of_the_candidates(retargeter: OptimizationRetargeter, bowing: Tensor) -> None:
    problem = retargeter.problem
    q_TSN, cost_TSC = along_motion(problem, retargeter._pool, bowing, RATE, 1e-3)
    for q_TN, cost_TC in zip(q_TSN.unbind(1), cost_TSC.unbind(1), strict=True):
        torch.testing.assert_close(problem.cost(q_TN, bowing), cost_TC, atol=1e-5, rtol=1e-4)
        assert bool(((q_TN >= problem.lower_N) & (q_TN <= problem.upper_N)).all())


def test_a_frame_that_the_keys_know_nothing_of_gets_all_starts(
    retargeter: OptimizationRetargeter, bowing: Tensor, started: list[int]
) -> None:
    """Both legs turn upside down for a frame, which no joint follows: it costs more than any key."""
    along_motion(retargeter.problem, retargeter._pool, bowing, RATE, 1e-3)
    usual, strange_TD3 = sum(started), bowing.clone()
    started.clear()
    legs = [d for d, name in enumerate(retargeter.body_map.direction_names) if "knee" in name or "ankle" in name]
    strange_TD3[40, legs] *= -1.0
    few = along_motion(retargeter.problem, retargeter._pool, strange_TD3, RATE, 1e-3)
    assert sum(started) == usual + 1
    every = from_starts(retargeter.problem, retargeter._pool, strange_TD3[40:41])
    for found, wanted in zip(few, every, strict=True):
        torch.testing.assert_close(found[40:41], wanted, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize(("frames", "rate"), [(12, 8.0), (9, RATE), (1, RATE)])
def test_few_frames_are_all_solved_from_all_starts(
    retargeter: OptimizationRetargeter, bowing: Tensor, frames: int, rate: float
) -> None:
    found = along_motion(retargeter.problem, retargeter._pool, bowing[:frames], rate, 1e-3)
    for one, other in zip(found, from_starts(retargeter.problem, retargeter._pool, bowing[:frames]), strict=True):
        assert torch.equal(one, other)
