"""Eight numbers side by side do what each does alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrhubo.fast import FastRetargeter
from mrhubo.retargeter import Retargeter

numba = pytest.importorskip("numba")
pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def worked_out() -> np.ndarray:
    """Functions (R, 12, 8) of numbers (R, 2, 8), compiled as the run-time path is."""
    from mrhubo.fast.compiled import functions, lane_arrays, lanes, tables

    @numba.njit(**tables.COMPILED)
    def work(given_R2L, out_RXL):
        given, out = lane_arrays.side_by_side(given_R2L), lane_arrays.side_by_side(out_RXL)
        for r in range(len(given)):
            a, b = given[r, 0], given[r, 1]
            out[r, 0], out[r, 1] = functions.sine_cosine(a)
            out[r, 2], out[r, 3] = functions.exponential(a), functions.logarithm(abs(b))
            out[r, 4], out[r, 5] = functions.asinh(a), functions.tanh(a)
            out[r, 6] = lanes.choose((a < b) & lanes.no(a < 0) | (b >= 7), a - 2 * b, 3)
            out[r, 7] = min(max(a, -1), b) / b
            out[r, 7] += 1
            out[r, 8] = lanes.alike(a, 1.0 if lanes.some(a > b) else 0.0)
            total = 0.0  # becomes lanes on the way
            for k in range(3):
                total += k * a
            out[r, 9] = -total

    given = np.random.default_rng(0).normal(size=(200, 2, 8)) * np.array([20.0, 5.0])[:, None]
    given[0, 0], given[0, 1], given[1, 0] = -9.0, 9.0, np.arange(8) * np.pi / 2
    out = np.zeros((len(given), 10, 8))
    work(given, out)
    a, b = given[:, 0], given[:, 1]
    wanted = [
        np.sin(a), np.cos(a), np.exp(a), np.log(np.abs(b)), np.arcsinh(a), np.tanh(a),
        np.where((a < b) & (a >= 0) | (b >= 7), a - 2 * b, 3), np.minimum(np.maximum(a, -1), b) / b + 1,
        np.repeat((a > b).any(axis=1, keepdims=True), 8, axis=1), -3 * a,
    ]  # fmt: skip
    return np.stack([out, np.stack(wanted, axis=1)])


@pytest.mark.parametrize("function", range(10))
def test_lanes_are_numbers(worked_out: np.ndarray, function: int) -> None:
    found, wanted = worked_out[:, :, function]
    np.testing.assert_allclose(found, wanted, rtol=1e-13, atol=1e-15 * (1 + np.abs(wanted).max()))


def test_a_column_is_written_lane_by_lane() -> None:
    from mrhubo.fast.compiled import lane_arrays, tables

    @numba.njit(**tables.COMPILED)
    def write(given_1L, into_RC):
        lane_arrays.scatter(lane_arrays.side_by_side(given_1L)[0], into_RC, 2, 3, 1)

    into_RC = np.zeros((26, 3), np.float32)
    write(np.arange(1.0, 9.0)[None], into_RC)
    wanted_RC = np.zeros_like(into_RC)
    wanted_RC[2::3, 1] = np.arange(1, 9)
    np.testing.assert_array_equal(into_RC, wanted_RC)


def test_steps_of_many_frames_are_those_of_each(make: Callable[[str], Retargeter], array: np.ndarray) -> None:
    """Of untrained networks, so that most frames start again from other places."""
    fast = FastRetargeter(make("nao").describe(), "compiled")
    for avoid in (False, True):
        together = fast(array, 10, avoid_collisions=avoid)
        alone = [fast(pose, 10, avoid_collisions=avoid) for pose in array]
        off_B = np.abs(together.q - np.stack([answer.q for answer in alone])).max(axis=1)
        assert np.quantile(off_B, 0.9) < 1e-6 and off_B.max() < 1e-4
        collision_B = np.array([answer.collision for answer in alone])
        np.testing.assert_array_equal(together.collision, collision_B)
        assert avoid or 0 < collision_B.mean() < 1
        np.testing.assert_array_equal(fast.predict(array, 10, avoid), together.q)
