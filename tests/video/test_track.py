"""A body through a video; how it is followed is looked at with an estimator whose answers are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.robot_motion.clock import at_rate
from mrhubo.video import track as module
from mrhubo.video.estimator import Estimate
from mrhubo.video.frames import Frame
from mrhubo.video.sides import EXCHANGED
from mrhubo.video.track import track_body

FAR = 150
SPREAD_K3 = np.random.default_rng(0).uniform(-1, 1, (33, 3))
SPREAD_K3[[11, 12, 23, 24]] = [[1, 1, 0], [-1, 1, 0], [1, 0, 0], [-1, 0, 0]]
"""Points of those who are found in pictures brighter than `FAR`, by whom one can tell how large they are: a metre is a
pixel, and places are brightnesses."""


class Known:
    """Finds points at the brightness of a picture's first pixel; nobody where it is black."""

    def __init__(self, others: bool = False) -> None:
        self.resets, self.others, self.looks = 0, others, 0

    def reset(self) -> None:
        self.resets += 1

    def landmarks(self, image_HW3: np.ndarray) -> Estimate:
        value = float(image_HW3[0, 0, 0]) or np.nan
        point_K3 = np.full((33, 3), value)
        pixel_K2 = point_K3[:, :2] + (SPREAD_K3[:, :2] if value > FAR else 0)
        return Estimate(
            point_K3 + (SPREAD_K3 if value > FAR else 0), np.nan_to_num(point_K3[:, 0] / 255), 1.0, pixel_K2
        )

    def sees_others(self, image_HW3: np.ndarray) -> bool:
        self.looks += 1
        return self.others


@pytest.fixture
def film(monkeypatch: pytest.MonkeyPatch):
    """Gives a film of pictures at given times."""

    def make(times: list[float], values: list[int]) -> None:
        images = [np.full((2, 2, 3), value, np.uint8) for value in values]
        monkeypatch.setattr(module, "frames", lambda path: map(Frame, times, images))

    return make


def test_a_steady_film_is_taken_as_it_is(film) -> None:
    times = [round(number / 30, 3) for number in range(10)]  # as Matroska rounds them
    film(times, list(range(100, 110)))
    estimator = Known()
    track = track_body(Path("a.mkv"), estimator)
    assert estimator.resets == 1 and track.rate == 30 and track.notes == ()
    assert track.point_TK3[:, 0, 0] == pytest.approx(np.arange(100, 110)) and track.seen_T.all()


def test_an_unsteady_film_is_interpolated_between_its_true_times(film) -> None:
    film([0.0, 0.1, 0.2, 0.5, 0.6, 0.7], [10, 20, 30, 60, 70, 80])
    track = track_body(Path("a.mkv"), Known())
    assert track.rate == pytest.approx(10) and "100 to 300 ms" in track.notes[0]
    assert track.point_TK3[:, 0, 0] == pytest.approx(np.arange(10, 90, 10))


def test_an_unsteady_film_whose_times_are_rounded_has_a_round_rate(film) -> None:
    times = np.delete(np.round(np.arange(40) / 30, 3), [5, 6, 7, 20])
    film(times.tolist(), list(range(100, 136)))
    assert track_body(Path("a.mkv"), Known()).rate == 30


def test_nobody_stays_nobody(film) -> None:
    film([0.0, 0.1, 0.2, 0.3, 0.45], [10, 0, 30, 40, 55])
    track = track_body(Path("a.mkv"), Known())
    assert track.seen_T.tolist() == [True, False, True, True, True] and (track.visibility_TK[1] == 0).all()
    assert track.notes[0] == "nobody is found in 1 of 5 frames"
    film([0.0, 0.1, 0.2], [0, 0, 0])
    with pytest.raises(UserError, match="a.mkv: nobody is found in any of its 3 frames; a person has to be as tall"):
        track_body(Path("a.mkv"), Known())


def test_who_is_followed_after_another_is_somebody_else(film) -> None:
    values = [200, 200, 200, 0, 240, 240, 202, 202]
    film([0.1 * number for number in range(8)], values)
    track = track_body(Path("a.mkv"), Known())
    assert track.who_T is not None and track.who_T.tolist() == [0, 0, 0, -1, 1, 1, 0, 0]
    first, second = track.only(0), track.only(1)
    assert first.seen_T.tolist() == [True, True, True, False, False, False, True, True] and first.who_T is None
    assert (first.visibility_TK[3:6] == 0).all() and len(second.point_TK3) == 2 and second.seen_T.all()
    film([0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.7], [200, 200, 200, 200, 240, 240, 240])
    track = track_body(Path("a.mkv"), Known())
    assert track.who_T is not None and track.who_T.tolist() == [0, 0, 0, 0, -1, 1, 1, 1]
    assert track.seen_T.tolist() == [True] * 4 + [False] + [True] * 3, "nothing is between two people"


def test_sides_that_change_for_a_moment_are_put_back(film) -> None:
    class Doubting(Known):
        def landmarks(self, image_HW3: np.ndarray) -> Estimate:
            found = super().landmarks(np.full_like(image_HW3, 200))
            wrong = int(image_HW3[0, 0, 0]) == 201
            order = EXCHANGED if wrong else np.arange(33)
            return found._replace(point_K3=found.point_K3[order], visibility_K=np.arange(33)[order] / 33)

    film([number / 30 for number in range(12)], [200] * 5 + [201] * 3 + [200] * 4)
    track = track_body(Path("a.mkv"), Doubting())
    assert np.ptp(track.point_TK3, axis=0).max() == 0 and np.ptp(track.visibility_TK, axis=0).max() == 0
    assert track.notes[-1] == "left and right are exchanged for a moment, in 3 of 12 frames: they are put back"


def test_it_is_told_if_others_are_there(film) -> None:
    film([0.1 * number for number in range(12)], [100] * 12)
    alone, among = Known(), Known(others=True)
    assert track_body(Path("a.mkv"), alone).notes == () and alone.looks == 3
    assert "several people are seen in 3 of 3 pictures" in track_body(Path("a.mkv"), among).notes[0]


def test_who_is_small_is_told_to_be(film) -> None:
    film([0.0, 0.1, 0.2], [200, 200, 200])
    (note,) = track_body(Path("a.mkv"), Known()).notes
    assert note.startswith("the person is 2 pixels tall: limbs may be far off")


def test_no_film_of_one_picture_or_of_years(film) -> None:
    film([0.0], [10])
    with pytest.raises(UserError, match="one frame"):
        track_body(Path("a.mkv"), Known())
    film([0.0, 0.01, 0.02, 1e6], [10, 20, 30, 40])
    with pytest.raises(UserError, match="spread over 1e.06 s"):
        track_body(Path("a.mkv"), Known())


def test_values_at_a_rate_are_those_of_the_line() -> None:
    time_T = np.array([0.0, 0.04, 0.1, 0.11, 0.3])
    value_TX = np.stack([2 * time_T, 1 - time_T], axis=1)
    found_SX = at_rate(time_T, value_TX, 50.0)
    time_S = np.arange(16) / 50
    assert len(found_SX) == 16
    assert found_SX == pytest.approx(np.stack([2 * time_S, 1 - time_S], axis=1))
    gap_TX = value_TX.copy()
    gap_TX[1] = np.nan
    assert np.isnan(at_rate(time_T, gap_TX, 50.0)[:, 0]).tolist() == [False, True, True, True, True] + 11 * [False]
