"""Who is who in a film through which one body was followed."""

from __future__ import annotations

import numpy as np

from mrhubo.video.people import tell_apart

RATE = 30.0
TRUNK = [11, 12, 23, 24]
BODY_K3 = np.random.default_rng(0).uniform(-0.8, 0.8, (33, 3))


def seen(places: list[tuple[float, float] | None], pixels_per_metre: float = 200.0) -> np.ndarray:
    """Who is found where bodies are at places [pixels], a frame each; None where nobody is."""
    here = [(np.nan, np.nan) if place is None else place for place in places]
    pixel_TK2 = np.array(here)[:, None] + pixels_per_metre * BODY_K3[:, :2] * [1, -1]
    point_TK3 = np.where(np.isfinite(pixel_TK2[:, :1, :1]), BODY_K3, np.nan)
    return tell_apart(np.arange(len(places)) / RATE, point_TK3, pixel_TK2, TRUNK)


def test_one_who_runs_and_is_away_for_a_while_is_one() -> None:
    run = [(100 + 40.0 * frame, 300.0) for frame in range(20)]  # 6 m/s
    assert (seen(run) == 0).all()
    away = [*run[:5], *[None] * 30, (1500.0, 300.0)]
    assert seen(away).tolist() == [0] * 5 + [-1] * 30 + [0]


def test_who_is_elsewhere_at_once_is_another_and_who_comes_back_is_known_again() -> None:
    first, second = [(600.0, 250.0)] * 6, [(200.0, 700.0)] * 4
    assert seen([*first, *second]).tolist() == [0] * 6 + [1] * 4
    back = [(640.0, 260.0)] * 3
    assert seen([*first, *second, None, *back]).tolist() == [0] * 6 + [1] * 4 + [-1] + [0] * 3
    third = [(1500.0, 700.0)] * 2
    assert seen([*first, *second, *third, *second]).tolist() == [0] * 6 + [1] * 4 + [2] * 2 + [1] * 4


def test_how_far_is_told_in_metres_of_the_body() -> None:
    places = [(600.0, 250.0), (900.0, 250.0)]
    assert seen(places, 400.0).tolist() == [0, 1] and seen(places, 800.0).tolist() == [0, 0]


def test_points_without_an_extent_tell_nothing() -> None:
    point_TK3 = np.ones((4, 33, 3)) * np.arange(4)[:, None, None]
    assert tell_apart(np.arange(4) / RATE, point_TK3, 1000 * point_TK3[..., :2], TRUNK).tolist() == [0, 0, 0, 0]


def test_a_film_in_which_everybody_is_another_is_read_in_bounded_time() -> None:
    places = [(float(x), 300.0) for x in np.random.default_rng(1).permutation(3000) * 5000]
    assert len(set(seen(places).tolist())) == 3000
