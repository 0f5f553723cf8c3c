"""Steps from an answer: never a worse one, and out of a wrong valley."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mrhubo.reference import OptimizationRetargeter, Polish


@pytest.fixture(scope="module")
def polish(retargeters: dict[str, OptimizationRetargeter]) -> Polish:
    return Polish(retargeters["nao"].problem)


@pytest.fixture(scope="module")
def posed(polish: Polish, random_pose: Callable[[int, int], Tensor]) -> tuple[Tensor, Tensor]:
    """Human directions, and random places to begin at."""
    problem = polish.problem
    return problem.body_map.human_directions(random_pose(200, 3)), problem.robot.sample(200, torch.Generator())


def test_wrong_valleys_are_left(
    polish: Polish, posed: tuple[Tensor, Tensor], retargeters: dict[str, OptimizationRetargeter]
) -> None:
    problem, (target, start) = polish.problem, posed
    best = retargeters["nao"]._polish(*retargeters["nao"]._candidates(target), target)[1]
    weight = problem.directions.weight_D @ problem.blocks.directions_DC

    def share_wrong(cost: Tensor) -> float:
        return float(((cost / weight).sqrt() - (best / weight).sqrt() > math.radians(3)).float().mean())

    plain_q, plain = problem.minimise(start, target, 10)
    found_q = polish(start, target, 10)
    found = problem.quadratic(found_q, target).cost_BC
    assert share_wrong(plain) > 0.03 and share_wrong(found) < 0.1 * share_wrong(plain)
    assert bool((found <= plain + 1e-6).all())
    near = plain < weight * math.radians(2.9) ** 2
    own = near[:, problem.blocks.block_N]
    assert bool(near.any()) and torch.equal(found_q[own], plain_q[own]), "blocks that are near are left alone"
    assert bool(((found_q >= problem.lower_N) & (found_q <= problem.upper_N)).all())


@pytest.mark.parametrize("steps", [1, 10])
def test_a_frame_has_the_same_answer_in_any_batch(polish: Polish, posed: tuple[Tensor, Tensor], steps: int) -> None:
    target, start = (tensor[:14] for tensor in posed)
    whole = polish(start, target, steps)
    assert torch.equal(polish(start, target, steps), whole)
    for size in (1, 5):
        parts = zip(start.split(size), target.split(size), strict=True)
        assert torch.equal(torch.cat([polish(*part, steps) for part in parts]), whole)


def test_the_start_is_not_written_to(polish: Polish, posed: tuple[Tensor, Tensor]) -> None:
    target, start = posed
    before = start.clone()
    polish(start, target, 3)
    assert torch.equal(start, before)
    assert polish(start[:0], target[:0], 3).shape == (0, start.shape[1])
