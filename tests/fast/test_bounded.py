"""The minimum of a motion's quadratic model inside bounds: its slope is what the bounds that hold it push back with."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from mrhubo.fast.together import bounded
from mrhubo.fast.together.banded import Banded, halve
from mrhubo.fast.together.bounds import Bounds

FRAMES, JOINTS = 12, 2


def problem(seed: int, steps: bool, jerk: float = 1.0) -> tuple[Banded, np.ndarray, Bounds]:
    """A model whose minimum is beyond many of its bounds, in which jerk ties frames to each other."""
    generator = np.random.default_rng(seed)
    third = np.diff(np.eye(FRAMES), n=3, axis=0)
    jerk_TT = jerk * third.T @ third
    couplings = [np.stack([jerk_TT[t + lag, t] * np.eye(JOINTS) for t in range(FRAMES - lag)]) for lag in range(1, 4)]
    diagonal_TM = 0.3 + np.diag(jerk_TT)[:, None] + generator.random((FRAMES, JOINTS))
    system = Banded(generator.normal(0, 0.05, (FRAMES, JOINTS, JOINTS)), diagonal_TM, couplings)
    free_T = np.arange(FRAMES) > 0
    side_2TM = generator.uniform(0.05, 0.3, (2, FRAMES, JOINTS)) * np.array([-1, 1])[:, None, None]
    step_2XM = np.tile(np.array([-0.1, 0.1])[:, None, None], (1, FRAMES - 1, JOINTS))
    bounds = (
        Bounds.of(side_2TM, free_T, step_2XM, np.arange(FRAMES - 1) % 5 > 0) if steps else Bounds.of(side_2TM, free_T)
    )
    for entry, rows in ((system.within_TMM, 0), *((c, lag) for lag, c in enumerate(couplings, start=1))):
        entry *= (free_T[rows:] & free_T[: FRAMES - rows])[:, None, None]
    diagonal_TM[0] = 1.0
    return system, generator.normal(0, 2.0, (FRAMES, JOINTS)) * free_T[:, None], bounds


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("way", ["either", "from inside"])
def test_the_slope_is_what_bounds_push_back_with(seed: int, way: str) -> None:
    system, right_TM, bounds = problem(seed, steps=True)
    solve = bounded.bounded_minimum if way == "either" else bounded._from_inside
    x_TM = solve(system, right_TM, bounds, halve)
    check(system, right_TM, bounds, x_TM)


@pytest.mark.parametrize("seed", range(6))
def test_limits_alone(seed: int) -> None:
    """Where frames are loosely tied the set settles."""
    system, right_TM, bounds = problem(seed, steps=False, jerk=0.005)
    x_TM, is_minimum = bounded.by_active_set(system, right_TM, bounds, halve)
    assert is_minimum
    check(system, right_TM, bounds, x_TM)


def check(system: Banded, right_TM: np.ndarray, bounds: Bounds, x_TM: np.ndarray) -> None:
    over_KTM = bounds.apply(x_TM) - bounds.upper_KTM
    assert over_KTM.max() < 2e-5 and (over_KTM > -1e-5).any() and not x_TM[0].any()
    slope_TM = system.times(x_TM) - right_TM
    pushes = []
    for place in np.argwhere(over_KTM > -1e-5):
        one_KTM = np.zeros_like(over_KTM)
        one_KTM[tuple(place)] = 1.0
        pushes.append(bounds.transposed(one_KTM).ravel())
    assert nnls(np.stack(pushes, axis=1), -slope_TM.ravel())[1] < 2e-3
