"""Planted points carry the root; in flight it follows the path; what adds up is taken out."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.reference.standing.path import carry


def steps(stretch: float, count: int = 10, frames: int = 30) -> tuple[np.ndarray, ...]:
    """A root that goes 1 cm a frame, on one point after the other, whose legs are longer by a factor."""
    frame_T = np.arange(count * frames)
    phase_T = frame_T // frames
    within_T = frame_T % frames - (frames - 1) / 2
    on_path_TP1 = (0.01 * frame_T - stretch * 0.01 * within_T)[:, None, None]
    share_T = np.clip(np.minimum(frame_T % frames + 1, frames - frame_T % frames) / 6, 0, 1)
    return on_path_TP1, share_T[:, None], phase_T[:, None], 0.01 * frame_T


def test_one_foot_holds_still_and_the_way_stays_the_persons() -> None:
    on_path, weight, phase, path_T = steps(1.04)
    off_T1, place_K1 = carry(on_path, weight, phase, 60.0)
    foot_T = on_path[:, 0, 0] + off_T1[:, 0]
    held = weight[:, 0] == 1
    speed_X = 60 * np.abs(np.diff(foot_T))[held[1:] & held[:-1]]
    assert np.median(speed_X) < 0.005 and speed_X.max() < 0.03, "[m/s]; legs give way where one foot takes over"
    assert np.abs(foot_T - place_K1[phase[:, 0], 0])[held].max() < 0.005
    assert abs(off_T1).max() < 0.04 * path_T[-1], "4% longer steps would have led 12 cm too far"


def test_legs_like_the_persons_leave_the_path_alone() -> None:
    on_path, weight, phase, _ = steps(1.0)
    off_T1, place_K1 = carry(on_path, weight, phase, 60.0)
    np.testing.assert_allclose(off_T1, 0, atol=1e-9)
    np.testing.assert_allclose(place_K1[:, 0], 0.3 * np.arange(10) + 0.145, atol=1e-9)


def test_nothing_planted_is_the_path_and_known_places_draw_the_root() -> None:
    on_path = np.random.default_rng(0).normal(size=(20, 2, 2))
    off_T2, place_K2 = carry(on_path, np.zeros((20, 2)), np.full((20, 2), -1), 60.0)
    assert (off_T2 == 0).all() and place_K2.shape == (0, 2)
    off_T1, _ = carry(np.zeros((50, 1, 1)), np.ones((50, 1)), np.zeros((50, 1), int), 60.0, np.array([[0.3]]))
    np.testing.assert_allclose(off_T1, 0.3, rtol=0.02)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_a_frame_or_two(frames: int) -> None:
    off_T1, place_K1 = carry(np.full((frames, 1, 1), 0.2), np.ones((frames, 1)), np.zeros((frames, 1), int), 60.0)
    assert off_T1 == pytest.approx(0) and place_K1 == pytest.approx(0.2)
