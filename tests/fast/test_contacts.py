"""Contacts found frame by frame, beside those of the whole motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.fast.plain.contacts import LiveContacts, next_contacts
from mrhubo.motion import mirror, read_motion, resample, trim
from mrhubo.motion.contacts import find_contacts
from mrhubo.motion.writers.amass import write_motion
from mrhubo.reference.standing import Legs, read_steps
from mrhubo.rotation import matrix_to_axis_angle
from tests.reference.standing.steppers import squat
from tests.reference.walkers import walker


def stepping(rate: float, seconds: float = 4.0, floor: float = 0.0) -> np.ndarray:
    """One foot's two points (T, 2, 3) [m]: still for half a second, then half a second forward in an arc, again and
    again; another foot's the other way about."""
    time_T = np.arange(round(seconds * rate)) / rate
    feet = []
    for late in (0.0, 0.5):
        phase_T = (time_T + late) % 1.0
        swing_T = np.clip((phase_T - 0.5) / 0.5, 0, 1)
        ahead_T = np.floor(time_T + late) * 0.6 + 0.6 * swing_T
        height_T = floor + 0.15 * np.sin(np.pi * swing_T)
        feet += [np.stack((0 * time_T, height_T, ahead_T + toe), axis=1) for toe in (-0.05, 0.15)]
    return np.stack(feet, axis=1)


def live(place_TP3: np.ndarray, rate: float, **options: object) -> list[LiveContacts]:
    """The contacts after each frame."""
    state, found = LiveContacts.none(1, place_TP3.shape[1]), []
    for place_P3 in place_TP3:
        state = next_contacts(state, place_P3[None], np.array([1 / rate]), **options)  # pyright: ignore
        found.append(state)
    return found


@pytest.mark.parametrize("floor", [0.0, -0.9, 0.7])
@pytest.mark.parametrize("rate", [24.0, 60.0])
def test_they_are_those_of_the_whole_motion_a_little_later(rate: float, floor: float) -> None:
    place_TP3 = stepping(rate, floor=floor)
    whole_TP = find_contacts(place_TP3, rate).planted_TP
    found = live(place_TP3, rate)
    live_TP = np.stack([state.planted_BP[0] for state in found])
    late = next(k for k in range(5) if (live_TP[5 + k :] == whole_TP[5 : len(whole_TP) - k]).mean() > 0.95)
    assert late / rate < 0.1
    assert found[-1].floor_B[0] == pytest.approx(floor, abs=0.01)
    weight_TP = np.stack([state.weight_BP[0] for state in found])
    assert ((weight_TP >= 0) & (weight_TP <= 1)).all() and not weight_TP[~live_TP].any()
    assert weight_TP[live_TP].max() == 1


def test_soles_above_the_root_tell_nothing_of_the_floor() -> None:
    """Who stands on the hands for half a minute."""
    place_TP3 = np.concatenate((np.zeros((60, 4, 3)), np.zeros((1800, 4, 3)) + [0.0, 2.2, 0.0]))
    found = live(place_TP3, 60.0, root_B=np.array([1.0]))
    assert found[59].planted_BP.all() and not any(state.planted_BP.any() for state in found[60:])
    assert abs(found[-1].floor_B[0]) < 0.01
    assert live(place_TP3, 60.0)[-1].floor_B[0] == pytest.approx(2.2, abs=0.01)  # on a stool, say


@pytest.mark.parametrize("storeys", [3.0, -3.0])
def test_a_floor_is_found_on_every_storey(storeys: float) -> None:
    """Who climbs or sinks far, or whose tracker does, stands there too."""
    here, rate = stepping(60.0), 60.0
    parts = [here + [0.0, k * storeys, 0.0] for k in range(3)]
    stairs = [np.linspace(a[-1], b[0], 240) for a, b in zip(parts, parts[1:], strict=False)]
    found = live(np.concatenate([parts[0], stairs[0], parts[1], stairs[1], parts[2], parts[2]]), rate)
    assert found[-1].floor_B[0] == pytest.approx(2 * storeys, abs=0.01)
    live_TP = np.stack([state.planted_BP[0] for state in found[-len(here) :]])
    whole_TP = find_contacts(here, rate).planted_TP
    assert (live_TP == whole_TP).mean() > 0.9


def test_contacts_that_are_given_are_taken(rate: float = 60.0) -> None:
    place_TP3 = stepping(rate, 1.0)
    given_BP = np.array([[True, False, True, False]])
    for state in live(place_TP3, rate, given_BP=given_BP):
        assert (state.planted_BP == given_BP).all()
    assert live(place_TP3, rate, floor=0.3)[-1].floor_B[0] == 0.3


def test_people_know_nothing_of_each_other() -> None:
    one_TP3, two_TP3 = stepping(60.0, 1.5), stepping(60.0, 1.5, floor=-0.5)
    state = LiveContacts.none(2, 4)
    for places in zip(one_TP3, two_TP3, strict=True):
        state = next_contacts(state, np.stack(places), np.full(2, 1 / 60))
    for person, place_TP3 in enumerate((one_TP3, two_TP3)):
        alone = live(place_TP3, 60.0)[-1]
        assert (state.planted_BP[person] == alone.planted_BP[0]).all() and state.floor_B[person] == alone.floor_B[0]
        np.testing.assert_allclose(state.weight_BP[person], alone.weight_BP[0], atol=1e-12)


def test_contacts_of_a_file_come_back_and_are_taken(tmp_path: Path) -> None:
    motion, given_T4 = squat(6), np.arange(24).reshape(6, 4) % 3 == 0
    turns_TJ3 = matrix_to_axis_angle(motion.local_TJ33)
    assert motion.root_position_T3 is not None
    write_motion(tmp_path / "a.npz", turns_TJ3.flatten(1).numpy(), np.zeros((6, 3)), motion.root_position_T3.numpy(), 24.0,
                 "squats", given_T4)  # fmt: skip
    found = read_motion(tmp_path / "a.npz")
    assert np.array_equal(found.arrays.contact_T4, given_T4)
    assert np.array_equal(mirror(found).arrays.contact_T4, given_T4[:, [2, 3, 0, 1]])
    assert np.array_equal(resample(found, 12.0).arrays.contact_T4, given_T4[::2])
    assert np.array_equal(trim(found, 0.0, 0.1).arrays.contact_T4, given_T4[:3])
    place_TP3 = np.zeros((6, 4, 3)) + [0.0, 0.3, 0.0]
    contacts = find_contacts(place_TP3, 24.0, given_TP=given_T4)
    assert np.array_equal(contacts.planted_TP, given_T4) and contacts.floor == pytest.approx(0.3)
    legs = Legs(walker(tmp_path))
    steps = read_steps(found, found.local_TJ33, legs)
    assert steps is not None and np.array_equal(steps.contacts.planted_TP, given_T4)


def test_contacts_of_another_shape_are_left_out(tmp_path: Path) -> None:
    with np.errstate(all="ignore"):
        np.savez(tmp_path / "a.npz", pose_body=np.zeros((3, 63)), mocap_frame_rate=24.0, contact=np.ones((2, 4), bool))
    found = read_motion(tmp_path / "a.npz")
    assert found.arrays.contact_T4 is None and any("'contact' is left out" in note for note in found.notes)
