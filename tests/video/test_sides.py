"""Left and right of a body, which an estimator exchanges for some frames."""

from __future__ import annotations

import numpy as np

from mrhubo.video.sides import EXCHANGED, exchanged_points

BODY_K3 = np.random.default_rng(0).uniform(-0.1, 0.1, (33, 3))
BODY_K3[[11, 12, 23, 24]] = [[0.2, 0.5, 0], [-0.2, 0.5, 0], [0.1, 0, 0], [-0.1, 0, 0]]
UPPER, LOWER = slice(0, 23), slice(23, 33)


def turning(frames: int, speed: float = 0.0) -> np.ndarray:
    """Points (T, 33, 3) of a body that turns about the upright axis by an angle a frame [rad]."""
    angle_T = speed * np.arange(frames)
    cos_T, sin_T, zero_T = np.cos(angle_T), np.sin(angle_T), np.zeros(frames)
    turn_T33 = np.array([[cos_T, zero_T, sin_T], [zero_T, zero_T + 1, zero_T], [-sin_T, zero_T, cos_T]])
    return np.einsum("kc,rct->tkr", BODY_K3, turn_T33)


def put_back(point_TK3: np.ndarray, rate: float = 30.0, who_T: np.ndarray | None = None) -> np.ndarray:
    who_T = np.zeros(len(point_TK3), int) if who_T is None else who_T
    wrong_TK = exchanged_points(np.arange(len(point_TK3)) / rate, point_TK3, who_T)
    return np.where(wrong_TK[..., None], point_TK3[:, EXCHANGED], point_TK3)


def test_each_point_has_one_on_the_other_side() -> None:
    assert (EXCHANGED[EXCHANGED] == np.arange(33)).all() and EXCHANGED[0] == 0
    assert EXCHANGED[[11, 14, 27, 32, 2, 8, 10]].tolist() == [12, 13, 28, 31, 5, 7, 9]


def test_sides_that_are_exchanged_for_some_frames_are_put_back() -> None:
    true_TK3 = turning(60, 0.05)
    seen_TK3 = true_TK3.copy()
    for frames in (slice(7, 8), slice(9, 10), slice(26, 36), slice(37, 44)):
        seen_TK3[frames] = true_TK3[frames][:, EXCHANGED]
    seen_TK3[44:46, UPPER] = true_TK3[44:46][:, EXCHANGED][:, UPPER]  # the upper body alone
    seen_TK3[50:52, LOWER] = true_TK3[50:52][:, EXCHANGED][:, LOWER]
    assert (put_back(seen_TK3) == true_TK3).all()


def test_who_turns_quickly_or_once_is_left_alone() -> None:
    for point_TK3 in (turning(60, 1.2), np.concatenate([turning(40), turning(40)[:, EXCHANGED]])):
        assert (put_back(point_TK3) == point_TK3).all()
    long_TK3 = turning(200)
    long_TK3[80:120] = long_TK3[80:120][:, EXCHANGED]
    assert (put_back(long_TK3) == long_TK3).all(), "too long for a moment"
    slow_TK3 = turning(30)
    slow_TK3[10:12] = slow_TK3[10:12][:, EXCHANGED]
    assert (put_back(slow_TK3, rate=10.0) == slow_TK3).all(), "frames too far apart to know"


def test_other_people_and_gaps_say_nothing() -> None:
    seen_TK3 = turning(30)
    seen_TK3[10:15] = seen_TK3[10:15][:, EXCHANGED]
    assert (put_back(seen_TK3, who_T=np.repeat([0, 1, 0], [10, 5, 15])) == seen_TK3).all()
    seen_TK3[[8, 9, 15, 16]] = np.nan
    who_T = np.where(np.isfinite(seen_TK3[:, 0, 0]), 0, -1)
    assert np.array_equal(put_back(seen_TK3, who_T=who_T), seen_TK3, equal_nan=True)
    assert not exchanged_points(np.arange(3.0), np.full((3, 33, 3), np.nan), np.full(3, -1)).any()
