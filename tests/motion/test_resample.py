"""Other frame rates: the same motion."""

from __future__ import annotations

import pytest
import torch

from mrhubo.errors import UserError
from mrhubo.motion import Motion, resample
from mrhubo.rotation import axis_angle_to_matrix, geodesic_distance


def turning(frames: int, rate: float, speed: float = 2.0) -> Motion:
    """Every joint turns about an axis of its own at a constant speed [rad/s]."""
    axis_J3 = torch.nn.functional.normalize(torch.randn(21, 3, generator=torch.Generator().manual_seed(0)), dim=-1)
    seconds_T = torch.arange(frames) / rate
    local_TJ33 = axis_angle_to_matrix(speed * seconds_T[:, None, None] * axis_J3)
    place_T3 = seconds_T[:, None] * torch.tensor([1.0, 0.5, 2.0])
    return Motion("turning", local_TJ33, rate, root_rotation_T33=local_TJ33[:, 0], root_position_T3=place_T3)


@pytest.mark.parametrize(("rate", "other"), [(24.0, 60.0), (60.0, 24.0), (120.0, 30.0), (30.0, 29.97), (1.0, 400.0)])
def test_a_steady_turn_stays_one(rate: float, other: float) -> None:
    found, expected = resample(turning(50, rate), other), turning(1 + int(49 / rate * other + 1e-9), other)
    assert len(found) == len(expected) and found.frame_rate == other
    assert float(geodesic_distance(found.local_TJ33, expected.local_TJ33).max()) < 1e-4
    assert found.root_rotation_T33 is not None and found.root_position_T3 is not None
    assert float(geodesic_distance(found.root_rotation_T33, found.local_TJ33[:, 0]).max()) < 1e-6
    torch.testing.assert_close(found.root_position_T3, expected.root_position_T3)


def test_frames_of_both_rates_stay_as_they_are() -> None:
    motion = turning(31, 30.0)
    doubled = resample(motion, 60.0)
    assert len(doubled) == 61 and torch.equal(doubled.local_TJ33[::2], motion.local_TJ33)
    assert torch.equal(resample(doubled, 30.0).local_TJ33, motion.local_TJ33)
    assert torch.equal(resample(turning(1, 30.0), 60.0).local_TJ33, turning(1, 30.0).local_TJ33)
    assert len(resample(turning(0, 30.0), 60.0)) == 0


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e12, 2e7])
def test_rates_that_make_no_sense_are_refused(rate: float) -> None:
    with pytest.raises(UserError, match="frame"):
        resample(turning(5, 30.0), rate)
