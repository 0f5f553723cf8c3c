"""The filter takes noise away, and follows what moves."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.video.smoothing import smoothed


def test_noise_falls_and_what_moves_is_followed() -> None:
    random = np.random.default_rng(0)
    time_T = np.arange(120) / 30
    true_TK3 = np.zeros((120, 2, 3))
    true_TK3[:, 1] = 0.4 * np.sin(2 * np.pi * 0.5 * time_T)[:, None]  # a wrist at 1.3 m/s
    noisy_TK3 = true_TK3 + 0.003 * random.standard_normal(true_TK3.shape)
    calm_TK3 = smoothed(noisy_TK3, 30.0)
    assert np.diff(calm_TK3[20:, 0], n=2, axis=0).std() < 0.4 * np.diff(noisy_TK3[20:, 0], n=2, axis=0).std()
    assert np.abs(calm_TK3[20:] - true_TK3[20:]).max() < 0.03
    assert np.abs(calm_TK3 - true_TK3)[20:, 0].mean() < np.abs(noisy_TK3 - true_TK3)[20:, 0].mean()


def test_it_is_causal_and_leaves_what_rests() -> None:
    still_TK3 = np.full((10, 3, 3), 0.7)
    assert smoothed(still_TK3, 25.0) == pytest.approx(still_TK3)
    later_TK3 = still_TK3.copy()
    later_TK3[6:] += 1.0
    assert smoothed(later_TK3, 25.0)[:6] == pytest.approx(still_TK3[:6])
    assert (smoothed(later_TK3, 25.0)[6] > 1.5).all(), "a jump is no noise"


def test_gaps_stay_gaps_and_the_filter_begins_anew() -> None:
    point_TK3 = np.random.default_rng(1).standard_normal((8, 2, 3))
    point_TK3[3:5, 0] = np.nan
    calm_TK3 = smoothed(point_TK3, 25.0)
    assert np.array_equal(np.isnan(calm_TK3), np.isnan(point_TK3))
    assert calm_TK3[5, 0] == pytest.approx(point_TK3[5, 0])
    assert calm_TK3[5:, 0] == pytest.approx(smoothed(point_TK3[5:, :1], 25.0)[:, 0])
