"""Where a robot's directions jerk far more than the human's, jerk costs more."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.fast.together.detours import AROUND_S, STRONGER, Detours, find_detours
from mrhubo.fast.together.smoothness import CALM_JERK, FOLLOWED, calm_at

RATE, STEPS = 30.0, 200
BLOCKS_DC = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
WEIGHT_D = np.array([2.0, 1.0, 3.0, 0.0])  # the last does not count


def found(robot_YD: np.ndarray, human_YD: np.ndarray) -> Detours | None:
    """Of jerks (Y, D) [1/s^3], each along an axis."""
    third, goal = ((jerk_YD / RATE**3)[..., None] * [0.0, 1.0, 0.0] for jerk_YD in (robot_YD, human_YD))
    return find_detours(third, np.tile(WEIGHT_D, (STEPS, 1)), FOLLOWED * goal, BLOCKS_DC, RATE)


@given(st.floats(0, 1e4), st.floats(0, 2.9), st.floats(0, 1e9))
def test_a_robot_that_follows_makes_none(human: float, times: float, left_out: float) -> None:
    """Nor does one whose human is calm, as long as it is as calm as a slow movement; what does not count may do all."""
    human_YD = np.full((STEPS, 4), human)
    robot_YD = times * np.maximum(human_YD, CALM_JERK)
    robot_YD[:, 3] = left_out
    assert found(robot_YD, human_YD) is None


@pytest.mark.parametrize("human", [0.0, 100.0])
def test_jerk_costs_there_as_if_the_human_moved_evenly(human: float) -> None:
    human_YD = np.full((STEPS, 4), human)
    robot_YD = human_YD.copy()
    robot_YD[100:110, 2] = 20 * max(human, CALM_JERK)
    made = found(robot_YD, human_YD)
    assert made is not None and made.blocks_C.tolist() == [False, True]
    np.testing.assert_array_equal(made.factor_YC[:, 0], 1)
    costs_Y = made.factor_YC[:, 1] * calm_at(np.full(STEPS, human))
    around = int(AROUND_S * RATE)
    np.testing.assert_allclose(costs_Y[100 - around : 110 + around], STRONGER)
    far = 2 * around
    np.testing.assert_allclose(made.factor_YC[: 100 - far, 1], 1)
    np.testing.assert_allclose(made.factor_YC[110 + far :, 1], 1)
    # Whatever may cost more can change, and what is far away stays.
    changed_Y = (made.factor_YC != 1).any(axis=1)
    for later in range(4):
        assert made.free_T[later : STEPS + later][changed_Y].all()
    assert made.free_T.shape == (STEPS + 3,) and not made.free_T[:50].any() and not made.free_T[160:].any()


def test_a_little_more_jerk_changes_little() -> None:
    """No threshold at which rounding would decide."""
    human_YD = np.full((STEPS, 4), 100.0)
    before = None
    for times in np.linspace(2.9, 6.2, 100):
        made = found(times * human_YD, human_YD)
        factor = 1.0 if made is None else float(made.factor_YC[100, 0])
        assert before is None or 0 <= factor - before < 0.1
        before = factor
    assert before == pytest.approx(STRONGER / calm_at(np.array(100.0)))
