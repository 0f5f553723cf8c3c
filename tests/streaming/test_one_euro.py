"""The filter: still where a limb rests, quick where it moves, the same at any rate."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.streaming import StreamSettings
from mrhubo.streaming.one_euro import OneEuroState, one_euro

UNIT = torch.ones(1, 1)
SETTINGS = StreamSettings()


def arc(angle_T: Tensor) -> Tensor:
    """Directions (T, 1, 1, 3) on a great circle."""
    return torch.stack((angle_T.cos(), angle_T.sin(), torch.zeros_like(angle_T)), dim=-1)[:, None, None]


def angles(seen: Tensor, passed_T: Tensor, settings: StreamSettings = SETTINGS) -> Tensor:
    """Angles [rad] of what the filter makes of directions on the great circle."""
    state, found = OneEuroState.at(seen[0]), []
    for raw, passed in zip(seen[1:], passed_T[1:], strict=True):
        state = one_euro(state, raw, passed[None], UNIT, settings)
        found.append(state.filtered_BD3[0, 0])
    whole = torch.stack(found)
    torch.testing.assert_close(whole.norm(dim=-1), torch.ones(len(whole)))
    return torch.atan2(whole[:, 1], whole[:, 0])


@pytest.mark.parametrize("rate", [30.0, 60.0, 240.0])
@pytest.mark.parametrize("speed", [0.05, 1.0, 5.0])
def test_a_steady_turn_is_followed_with_the_lag_of_its_time_constant(rate: float, speed: float) -> None:
    time_T = torch.arange(int(2 * rate)) / rate
    found = angles(arc(speed * time_T), torch.full_like(time_T, 1 / rate))
    lag = float((speed * time_T[1:] - found)[-int(rate / 4) :].remainder(math.tau).mean())
    tau = SETTINGS.rest_time / (1 + speed / SETTINGS.half_speed)
    assert lag == pytest.approx(speed * tau, rel=0.15, abs=1e-4)
    assert lag < 1.05 * SETTINGS.rest_time * SETTINGS.half_speed


def test_a_step_from_rest_is_reached_and_nothing_goes_beyond_it() -> None:
    angle_T = torch.cat((torch.zeros(10), torch.full((60,), 0.5)))
    found = angles(arc(angle_T), torch.full_like(angle_T, 1 / 60))
    assert bool((found[:9].abs() < 1e-6).all()) and bool((found.diff() >= -1e-6).all())
    assert float(found.max()) <= 0.5 + 1e-5 and float(found[12]) > 0.4 and float(found[-1]) > 0.499


def test_noise_of_a_limb_at_rest_is_damped() -> None:
    noise_T = math.radians(0.5) * torch.randn(1_000, generator=torch.Generator().manual_seed(0))
    found = angles(arc(noise_T), torch.full_like(noise_T, 1 / 60))
    assert float(found.std()) < 0.7 * float(noise_T.std())
    off = angles(arc(noise_T), torch.full_like(noise_T, 1 / 60), StreamSettings(rest_time=0))
    torch.testing.assert_close(off, noise_T[1:], atol=1e-5, rtol=0)


def test_irregular_times_give_nearly_the_same() -> None:
    generator = torch.Generator().manual_seed(1)
    passed_T = torch.rand(400, generator=generator) / 60 + 1 / 120
    time_T = passed_T.cumsum(0)
    found = angles(arc(torch.sin(3 * time_T)), passed_T)
    regular_T = torch.arange(int(60 * float(time_T[-1]))) / 60
    regular = angles(arc(torch.sin(3 * regular_T)), torch.full_like(regular_T, 1 / 60))
    behind = [(torch.sin(3 * t[1:]) - f).abs().mean() for t, f in ((time_T, found), (regular_T, regular))]
    assert float(behind[0]) == pytest.approx(float(behind[1]), rel=0.2)


def test_a_length_that_is_no_unit_is_filtered_along() -> None:
    short, unit = torch.tensor([[[0.2, 0.0, 0.0]]]), torch.tensor([[[1.0, 0.0, 0.0]]])
    for columns, expected in ((torch.zeros(1, 1), (0.2, 1.0)), (UNIT, (0.999, 1.001))):
        state = one_euro(OneEuroState.at(short), unit, torch.tensor([1 / 60]), columns, SETTINGS)
        assert expected[0] < float(state.filtered_BD3.norm()) < expected[1]


@pytest.mark.parametrize(
    ("name", "value"),
    [("rest_time", -0.1), ("half_speed", 0.0), ("ramp_time", math.nan), ("longest_gap", 0), ("worse_deg", "5")],
)
def test_settings_out_of_bounds_are_refused(name: str, value: float) -> None:
    with pytest.raises(UserError, match=f"stream settings: {name} must be"):
        StreamSettings(**{name: value})
