"""A way goes on where it was after a root that jumped, in whole motions and frame after frame."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.fast.roots import Ways, without_jumps


def way(frames: int, rate: float) -> np.ndarray:
    """Runs straight on at 6 m/s, up and down [m]."""
    time_T = np.arange(frames) / rate
    return np.stack((0 * time_T, 0.9 + 0.05 * np.sin(20 * time_T), 6 * time_T), axis=1)


def followed(place_T3: np.ndarray, rate: float, keep_height: bool = False) -> np.ndarray:
    """The same, frame by frame, as one of two people."""
    ways, since = Ways(2, keep_height), np.inf
    found = []
    for place_3 in place_T3:
        both = np.stack((place_3, np.full(3, np.nan)))
        found.append(ways.follow(both, np.array([True, False]), np.array([since, np.inf]))[0])
        since = 1 / rate
    return np.stack(found)


@pytest.mark.parametrize("rate", [10.0, 60.0, 1000.0])
def test_what_does_not_jump_stays_as_it_is(rate: float) -> None:
    place_T3 = way(50, rate) + np.random.default_rng(0).normal(scale=0.02, size=(50, 3))
    for found_T3 in (without_jumps(place_T3, rate)[0], followed(place_T3, rate)):
        np.testing.assert_array_equal(found_T3, place_T3)


@pytest.mark.parametrize("rate", [24.0, 60.0, 1000.0])
def test_after_a_jump_the_way_goes_on_from_where_it_was(rate: float) -> None:
    place_T3 = way(60, rate)
    jumped_T3 = place_T3.copy()
    jumped_T3[20:] += [3.0, 1.0, -2.0]
    jumped_T3[40] += [-7.0, 0.0, 0.0]
    found_T3, jump_T3 = without_jumps(jumped_T3, rate)
    assert np.flatnonzero(jump_T3.any(axis=1)).tolist() == [20, 40, 41]
    np.testing.assert_allclose(found_T3, place_T3, atol=3.1 * np.linalg.norm(place_T3[1] - place_T3[0]))
    np.testing.assert_allclose(followed(jumped_T3, rate), found_T3, atol=1e-12)


def test_where_the_floor_is_told_a_height_stays() -> None:
    place_T3 = way(30, 60.0)
    place_T3[10:] += [3.0, 1.0, 0.0]
    for found_T3 in (without_jumps(place_T3, 60.0, keep_height=True)[0], followed(place_T3, 60.0, keep_height=True)):
        np.testing.assert_array_equal(found_T3[:, 1], place_T3[:, 1])
        assert np.abs(found_T3[:, 0]).max() < 0.1


def test_who_was_away_for_long_may_come_back_elsewhere() -> None:
    ways, one = Ways(1, keep_height=False), np.array([True])
    ways.follow(np.zeros((1, 3)), one, np.array([np.inf]))
    assert ways.follow(np.full((1, 3), 4.0), one, np.array([2.0])).tolist() == [[4.0, 4.0, 4.0]]
