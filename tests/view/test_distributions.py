"""Panels of histograms."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.view import distributions


def test_every_measure_has_its_panel_and_every_series_its_colour() -> None:
    draw = np.random.default_rng(0)
    one = {"phi": draw.lognormal(size=500), "z": draw.normal(8.0, 1.0, 500)}
    two = {"phi": 3 * one["phi"], "z": one["z"] + 1}
    titles = {"phi": "phi", "z": "|z|"}
    picture = distributions({"fine": one, "fast": two}, titles, (900, 300))
    assert picture.size == (900, 300)
    pixels = np.asarray(picture).reshape(-1, 3).astype(int)
    for color in ((59, 118, 175), (217, 130, 43)):
        assert (np.abs(pixels - color).sum(1) < 30).sum() > 100, "the series is drawn"
    alone = distributions({"fine": one}, titles, (900, 300))
    assert np.asarray(alone).tobytes() != np.asarray(picture).tobytes()


@pytest.mark.parametrize("bad", [[], [0.0, 0.0], [1.0, np.nan], [np.inf, 1.0]])
def test_what_cannot_be_drawn_is_refused(bad: list[float]) -> None:
    with pytest.raises(ValueError, match="finite numbers"):
        distributions({"a": {"x": np.array(bad)}}, {"x": "x"})


def test_equal_values_and_zeros_are_drawn() -> None:
    assert distributions({"a": {"x": np.array([0.0, 2.0, 2.0])}}, {"x": "x"}).width > 0
