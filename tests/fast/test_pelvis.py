"""A pelvis that is lost for a frame or two stays where it was, at once; what a person does passes as it is."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.fast.pelvis import HANGING, Pelvises
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.motion import Motion
from mrhubo.motion.steady import steady_frames

RATES = [30.0, 60.0, 120.0, 1000.0]
GLITCH_33 = axis_angle_to_matrix(np.array([0.3, -0.4, 0.2]))
"""By 31 degrees, as in CMU's 16_17."""


def person(rate: float, frames: int, spin: float = 6.0) -> tuple[np.ndarray, np.ndarray]:
    """Rotations of a pelvis (T, 3, 3) that turns about itself [rad/s], and local rotations (T, 21, 3, 3)."""
    generator, time_T = np.random.default_rng(0), np.arange(frames) / rate
    turn_T33 = axis_angle_to_matrix(np.stack((0 * time_T, spin * time_T, 0 * time_T), axis=1))
    turn_T33 = turn_T33 @ axis_angle_to_matrix(generator.normal(scale=0.02, size=(frames, 3)))
    return turn_T33, np.tile(axis_angle_to_matrix(generator.normal(scale=0.5, size=(21, 3))), (frames, 1, 1, 1))


def lost(turn_T33: np.ndarray, local_TJ33: np.ndarray, chosen: slice) -> tuple[np.ndarray, np.ndarray]:
    """The same with a pelvis that is told to be turned otherwise in some frames, under limbs that stay."""
    turn_T33, local_TJ33 = turn_T33.copy(), local_TJ33.copy()
    turn_T33[chosen] = turn_T33[chosen] @ GLITCH_33
    local_TJ33[chosen, HANGING] = GLITCH_33.T @ local_TJ33[chosen, HANGING]
    return turn_T33, local_TJ33


def followed(turn_T33: np.ndarray, local_TJ33: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """As the first of two people, the second of whom is never seen."""
    pelvises, seen, since, found = Pelvises(2), np.array([True, False]), np.full(2, np.inf), []
    for turn_33, local_J33 in zip(turn_T33, local_TJ33, strict=True):
        both = (np.stack((turn_33, np.full((3, 3), np.nan))), np.stack((local_J33, np.zeros_like(local_J33))))
        found.append([part[0] for part in pelvises.follow(*both, seen, since)])
        since = np.array([1 / rate, np.inf])
    turns, locals_ = zip(*found, strict=True)
    return np.stack(turns), np.stack(locals_)


def off_deg(one_T33: np.ndarray, other_T33: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip((np.einsum("...ij,...ij->...", one_T33, other_T33) - 1) / 2, -1, 1)))


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("spin", [0.0, 6.0, 30.0])
def test_what_a_person_does_stays_to_the_bit(rate: float, spin: float) -> None:
    """Who spins takes the trunk along, however fast."""
    told = person(rate, 60, spin)
    for given, found in zip(told, followed(*told, rate), strict=True):
        np.testing.assert_array_equal(given, found)


@pytest.mark.parametrize(("rate", "frames"), [(60.0, 1), (60.0, 2), (120.0, 3), (1000.0, 30)])
def test_a_pelvis_that_is_lost_stays_and_its_limbs_are_where_they_were(rate: float, frames: int) -> None:
    true_T33, true_TJ33 = person(rate, 80, 0.5)
    told = lost(true_T33, true_TJ33, slice(20, 20 + frames))
    turn_T33, local_TJ33 = followed(*told, rate)
    assert off_deg(turn_T33, true_T33).max() < 6  # the tracker's noise, and where the person turned meanwhile
    np.testing.assert_array_equal(turn_T33[20 + frames :], true_T33[20 + frames :])
    world_THJ = told[0][:, None] @ told[1][:, HANGING]
    np.testing.assert_allclose(turn_T33[:, None] @ local_TJ33[:, HANGING], world_THJ, atol=1e-12)
    np.testing.assert_array_equal(local_TJ33[:, 3:], true_TJ33[:, 3:])


@pytest.mark.parametrize("rate", RATES)
def test_one_that_stays_elsewhere_is_believed_before_long(rate: float) -> None:
    told = lost(*person(rate, 400, 0.0), slice(200, None))
    late = round(0.1 * rate)
    np.testing.assert_array_equal(followed(*told, rate)[0][200 + late :], told[0][200 + late :])


def test_after_a_gap_a_pelvis_may_be_anywhere() -> None:
    turn_T33, local_TJ33 = lost(*person(60.0, 2, 0.0), slice(1, 2))
    pelvises, seen = Pelvises(1), np.array([True])
    pelvises.follow(turn_T33[:1], local_TJ33[:1], seen, np.array([np.inf]))
    pelvises.follow(turn_T33[1:], local_TJ33[1:], ~seen, np.array([0.25]))
    np.testing.assert_array_equal(pelvises.follow(turn_T33[1:], local_TJ33[1:], seen, np.array([0.5]))[0], turn_T33[1:])


def test_a_motion_is_its_frames_and_itself_where_nothing_is_lost() -> None:
    turn_T33, local_TJ33 = (part.astype(np.float32) for part in person(60.0, 30))
    motion = Motion("m", local_TJ33, 60.0, root_rotation_T33=turn_T33)
    assert steady_frames(motion) is motion
    told = lost(turn_T33, local_TJ33, slice(10, 11))
    steady = steady_frames(Motion("m", told[1], 60.0, root_rotation_T33=told[0])).arrays
    for found, expected in zip((steady.root_rotation_T33, steady.local_TJ33), followed(*told, 60.0), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-6)
    assert steady_frames(Motion("m", local_TJ33, 60.0)).arrays.root_rotation_T33 is None
