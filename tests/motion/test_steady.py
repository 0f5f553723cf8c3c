"""A pelvis that does not shake: spikes and noise go, what a person does stays, and no limb turns in the world."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import Skeleton
from mrhubo.motion import Motion
from mrhubo.motion.steady import SPIKE_M, smooth_rotations, steady_root, without_spikes

RATES = [24.0, 60.0, 120.0]


def turns(vector_T3: np.ndarray) -> np.ndarray:
    return rotation.axis_angle_to_matrix(torch.as_tensor(vector_T3, dtype=torch.float64)).numpy()


def off_deg(a_T33: np.ndarray, b_T33: np.ndarray) -> np.ndarray:
    return np.degrees(rotation.geodesic_distance(torch.as_tensor(a_T33), torch.as_tensor(b_T33)).numpy())


def person(rate: float, seconds: float = 3.0) -> np.ndarray:
    """Rotations (T, 3, 3) of a pelvis that turns about itself, faster and faster, and sways and nods."""
    time_T = np.arange(round(rate * seconds)) / rate
    spin_T33 = turns(np.stack((0 * time_T, 1.2 * time_T**2, 0 * time_T), axis=1))
    sway_T3 = np.stack(
        (0.3 * np.sin(2 * np.pi * 1.5 * time_T), 0 * time_T, 0.15 * np.sin(2 * np.pi * 2 * time_T)), axis=1
    )
    return spin_T33 @ turns(sway_T3)


@pytest.mark.parametrize("rate", RATES)
def test_what_a_person_does_stays(rate: float) -> None:
    true_T33 = person(rate)
    off_T = off_deg(smooth_rotations(true_T33, rate), true_T33)
    assert off_T.max() < 1.0 and off_T[10:-10].max() < 0.4


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("frames", [1, 2])
def test_a_spike_goes(rate: float, frames: int) -> None:
    true_T33 = person(rate)
    seen_T33 = true_T33.copy()
    for start in (len(seen_T33) // 4, len(seen_T33) // 2):
        seen_T33[start : start + frames] = seen_T33[start : start + frames] @ turns(np.array([[0.4, 0.3, -0.3]]))
    off_T = off_deg(smooth_rotations(seen_T33, rate), true_T33)
    assert off_T.max() < 2.0


def walked(rate: float, seconds: float = 3.0) -> np.ndarray:
    """A way (T, 3) [m] that goes up and down and from side to side."""
    time_T = np.arange(round(rate * seconds)) / rate
    return np.stack((0.05 * np.sin(6 * time_T), 0.9 + 0.03 * np.sin(12 * time_T), 1.5 * time_T), axis=1)


@pytest.mark.parametrize("rate", RATES)
def test_a_way_without_spikes_stays_as_it_is(rate: float) -> None:
    way_T3 = walked(rate).astype(np.float32)
    assert without_spikes(way_T3, rate) is way_T3


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("far", [0.05, 0.2, 0.45, 3.0])
def test_spikes_of_a_way_go(rate: float, far: float) -> None:
    """For a fortieth of a second."""
    true_T3, frames = walked(rate), max(1, round(rate / 40))
    seen_T3 = true_T3.copy()
    for start in (len(seen_T3) // 4, len(seen_T3) // 2):
        seen_T3[start : start + frames] += [far, 0.0, 0.0]
    found_T3 = without_spikes(seen_T3, rate)
    assert np.linalg.norm(found_T3 - true_T3, axis=1).max() < (SPIKE_M if far < 1 else 5 * 1.6 / rate)


def test_a_spike_moves_no_other_frame() -> None:
    motion = Motion("m", torch.eye(3).repeat(180, 21, 1, 1), 60.0, root_rotation_T33=torch.eye(3).repeat(180, 1, 1))
    place_T3 = torch.from_numpy(walked(60.0)).float()
    place_T3[90, 1] += 0.3
    found_T3 = steady_root(motion.changed(root_position_T3=place_T3)).root_position_T3
    assert found_T3 is not None and torch.nonzero((found_T3 != place_T3).any(dim=1)).tolist() == [[90]]
    assert float(found_T3[90, 1]) == pytest.approx(walked(60.0)[90, 1], abs=0.005)


def test_noise_becomes_less() -> None:
    true_T33 = person(60.0)
    seen_T33 = true_T33 @ turns(np.random.default_rng(0).normal(0, 0.01, (len(true_T33), 3)))
    before_T, after_T = (off_deg(found_T33, true_T33) for found_T33 in (seen_T33, smooth_rotations(seen_T33, 60.0)))
    assert np.square(after_T).mean() < 0.5 * np.square(before_T).mean()
    jerk, smooth = (np.linalg.norm(np.diff(x, n=3, axis=0)) for x in (seen_T33, smooth_rotations(seen_T33, 60.0)))
    assert smooth < 0.2 * jerk


def test_it_does_not_matter_how_the_world_is_turned() -> None:
    seen_T33 = person(60.0) @ turns(np.random.default_rng(1).normal(0, 0.02, (180, 3)))
    world_33 = turns(np.array([[0.3, -2.0, 0.7]]))
    found_T33 = smooth_rotations(world_33 @ seen_T33, 60.0)
    np.testing.assert_allclose(found_T33, world_33 @ smooth_rotations(seen_T33, 60.0), atol=1e-9)
    np.testing.assert_allclose(found_T33.swapaxes(1, 2) @ found_T33, np.tile(np.eye(3), (180, 1, 1)), atol=1e-9)


def test_limbs_are_turned_in_the_world_as_they_were() -> None:
    generator = torch.Generator().manual_seed(0)
    local_TJ33 = rotation.axis_angle_to_matrix(0.4 * torch.randn(180, 21, 3, generator=generator))
    seen_T33 = torch.from_numpy(person(60.0)).float() @ rotation.axis_angle_to_matrix(
        0.05 * torch.randn(180, 3, generator=generator)
    )
    motion = Motion("m", local_TJ33, 60.0, root_rotation_T33=seen_T33, root_position_T3=torch.zeros(180, 3))
    steady = steady_root(motion)
    assert steady.root_rotation_T33 is not None
    assert off_deg(steady.root_rotation_T33.numpy(), seen_T33.numpy()).max() > 1
    before = seen_T33[:, None] @ Skeleton().global_rotations(local_TJ33)[:, 1:]
    after = steady.root_rotation_T33[:, None] @ Skeleton().global_rotations(steady.local_TJ33)[:, 1:]
    torch.testing.assert_close(after, before, atol=1e-5, rtol=0)


def test_what_is_left_as_it_is() -> None:
    still = torch.eye(3).repeat(20, 21, 1, 1)
    broken_T33 = torch.eye(3).repeat(20, 1, 1)
    broken_T33[7] = torch.nan
    for motion in (
        Motion("no root", still, 60.0),
        Motion("NaN", still, 60.0, root_rotation_T33=broken_T33),
        Motion("short", still[:7], 60.0, root_rotation_T33=torch.eye(3).repeat(7, 1, 1)),
        Motion("empty", still[:0], 60.0, root_rotation_T33=torch.eye(3).repeat(0, 1, 1)),
    ):
        assert steady_root(motion) is motion
