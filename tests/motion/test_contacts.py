"""Feet of known steps: what is planted, when, and where the floor is; at any rate, on any floor."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.motion.contacts import PLANTED_M, RAMP_S, WANDERED_M, find_contacts, find_floor, root_scale, speeds

STEP_S, STRIDE_M = 0.6, 0.7


def walk(rate: float, floor: float = 0.0, steps: int = 6) -> np.ndarray:
    """Two points (T, 2, 3) [m] that take turns: one stands for STEP_S while the other swings 0.15 m high."""
    time_T = np.arange(int(steps * STEP_S * rate)) / rate
    found = np.zeros((len(time_T), 2, 3))
    for point in (0, 1):
        cycle_T = time_T / (2 * STEP_S) + 0.5 * point
        share_T = np.clip((cycle_T % 1 - 0.5) / 0.5, 0, 1)  # the second half of a cycle is swing
        eased_T = share_T**2 * (3 - 2 * share_T)
        found[:, point, 2] = STRIDE_M * 2 * (np.floor(cycle_T) + eased_T)
        found[:, point, 1] = floor + 0.15 * np.sin(np.pi * share_T) ** 2
    return found


@pytest.mark.parametrize("rate", [24.0, 60.0, 120.0])
@pytest.mark.parametrize("floor", [0.0, -0.8, 0.93])
def test_steps_are_found_at_any_rate_on_any_floor(rate: float, floor: float) -> None:
    place_TP3 = walk(rate, floor)
    noise = np.random.default_rng(0).normal(scale=0.001, size=place_TP3.shape)
    found = find_contacts(place_TP3 + noise, rate)
    assert found.floor == pytest.approx(floor, abs=0.01)
    swings_TP = np.stack(
        [(np.arange(len(place_TP3)) / rate / (2 * STEP_S) + 0.5 * p) % 1 > 0.5 for p in (0, 1)], axis=1
    )
    wrong_TP = found.planted_TP == swings_TP
    assert wrong_TP.mean() < 0.25, "a swing begins and ends slowly, and near the floor"
    still_TP = (place_TP3[..., 1] - floor < 0.001) & (speeds(place_TP3, rate) < 0.001)
    assert found.planted_TP[still_TP].all() and not found.planted_TP[place_TP3[..., 1] - floor > 0.1].any()
    assert 6 <= found.phase_TP.max() + 1 <= 8, "three or four contacts of each point, and no flicker"


def test_a_contact_grows_and_fades_but_not_at_the_motions_ends() -> None:
    found = find_contacts(walk(120.0), 120.0)
    for phase in range(found.phase_TP.max() + 1):
        frame_X, point_X = np.nonzero(found.phase_TP == phase)
        weight_X = found.weight_TP[frame_X, point_X]
        first, last = frame_X[0] == 0, frame_X[-1] == len(found.phase_TP) - 1
        assert np.abs(np.diff(weight_X)).max() < 2 / (RAMP_S * 120.0)
        if len(weight_X) < 2 * RAMP_S * 120.0:
            continue
        assert weight_X.max() == 1.0
        assert weight_X[0] == 1.0 if first else weight_X[0] < 0.05
        assert weight_X[-1] == 1.0 if last else weight_X[-1] < 0.05
    assert (found.weight_TP[found.phase_TP < 0] == 0).all()


def test_a_point_between_the_thresholds_does_not_flicker() -> None:
    place_TP3 = np.zeros((200, 1, 3))
    place_TP3[:, 0, 1] = PLANTED_M + 0.015 + 0.01 * np.sin(np.arange(200) / 4)
    place_TP3[:20, 0, 1] = np.linspace(0, place_TP3[20, 0, 1], 20)
    assert find_contacts(place_TP3, 60.0, floor=0.0).planted_TP.all()
    place_TP3[:20, 0, 1] = 1.0
    assert not find_contacts(place_TP3, 60.0, floor=0.0).planted_TP[20:].any()


def test_a_foot_that_shuffles_is_planted_anew() -> None:
    place_TP3 = np.zeros((120, 1, 3))
    place_TP3[:, 0, 0] = 0.1 * np.arange(120) / 60
    found = find_contacts(place_TP3, 60.0)
    assert found.planted_TP.all()
    for phase in range(found.phase_TP.max() + 1):
        assert np.ptp(place_TP3[found.phase_TP == phase][:, 0]) <= WANDERED_M
    assert found.phase_TP.max() == int(0.2 / WANDERED_M)


def test_the_floor_is_below_what_is_stood_on_too() -> None:
    height_TP, speed_TP = np.concatenate((np.zeros(100), np.full(150, 0.4)))[:, None], np.zeros((250, 1))
    assert find_floor(height_TP, speed_TP) == pytest.approx(0.0, abs=0.005)
    height_TP[:3] = -0.5  # a glitch is no floor
    assert find_floor(height_TP, speed_TP) == pytest.approx(0.0, abs=0.005)
    assert find_floor(height_TP, speed_TP + 5) == pytest.approx(-0.5, abs=0.51), "nobody stands: the lowest tells"


@pytest.mark.parametrize("person", [0.8, 0.97, 1.0, 1.03, 1.2])
@pytest.mark.parametrize("rate", [24.0, 60.0])
def test_a_roots_way_is_made_to_fit_the_legs(person: float, rate: float) -> None:
    place_TP3 = walk(rate)
    root_T3 = np.stack((0 * place_TP3[:, 0, 0], 0.9 + 0 * place_TP3[:, 0, 0], place_TP3[..., 2].mean(axis=1)), axis=1)
    found = root_scale(place_TP3 - root_T3[:, None], person * root_T3, rate)
    assert found * person == pytest.approx(1.0, abs=0.07), "5%, and what is left where the root sways"
    assert found == 1.0 or abs(person - 1) > 0.05
    still = np.zeros((50, 1, 3))
    assert root_scale(still, person * root_T3[:1].repeat(50, axis=0), rate) == 1.0


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_motions_of_a_frame_or_two(frames: int) -> None:
    found = find_contacts(np.zeros((frames, 2, 3)), 30.0)
    assert found.planted_TP.all() and found.weight_TP.min() == 1.0 and found.floor == 0.0


def test_soles_above_the_root_tell_nothing_of_the_floor() -> None:
    """Who stands for a second and then on the hands for five."""
    place_TP3 = np.zeros((180, 2, 3))
    place_TP3[30:, :, 1] = np.minimum(np.arange(150) / 15, 1)[:, None] * 2.2
    found = find_contacts(place_TP3, 30.0, root_T=np.full(180, 1.0))
    assert found.floor == 0 and found.planted_TP[:30].all() and not found.planted_TP[32:].any()
    assert find_contacts(place_TP3, 30.0).floor == pytest.approx(2.2)  # on a stool, say
