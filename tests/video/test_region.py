"""Squares of pictures, turned: what is cropped is where it is said to be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.video.region import Region


def blob(width: int, height: int, x: float, y: float, size: float) -> np.ndarray:
    """A picture with a white disc, whose edge is soft."""
    down_HW, right_HW = np.mgrid[:height, :width] + 0.5
    bright_HW = np.clip(size - np.hypot(right_HW - x, down_HW - y), 0, 1)
    return np.repeat((255 * bright_HW).astype(np.uint8)[..., None], 3, axis=2)


@settings(max_examples=30, deadline=None)
@given(st.floats(-np.pi, np.pi), st.floats(0.25, 0.75), st.floats(0.25, 0.75), st.floats(60, 1500))
def test_what_a_crop_shows_is_where_it_says(angle: float, across: float, down: float, size: float) -> None:
    region = Region(320.0, 200.0, size, angle)
    ((x, y),) = region.to_picture(np.array([[across, down]]))
    image_HW3 = blob(640, 400, x, y, size / 20)
    if not (0 < x < 640 and 0 < y < 400):
        return
    crop_HW = region.crop(image_HW3, 128)[..., 0]
    weight_HW = crop_HW / max(crop_HW.sum(), 1e-9)
    inside = min(x, 640 - x, y, 400 - y) > size / 20
    if inside:  # else the disc is cut, and so is its middle
        rows, columns = np.mgrid[:128, :128] + 0.5
        seen = (weight_HW * columns).sum() / 128, (weight_HW * rows).sum() / 128
        assert seen == pytest.approx((across, down), abs=0.012)


def test_the_whole_picture_lies_in_the_middle_and_black_around_it() -> None:
    image_HW3 = np.full((100, 200, 3), 200, np.uint8)
    crop_HW3 = Region.whole(200, 100).crop(image_HW3, 64)
    assert crop_HW3.dtype == np.float32 and crop_HW3.shape == (64, 64, 3)
    assert crop_HW3[18:46] == pytest.approx(200 / 255) and (crop_HW3[:15] == 0).all() and (crop_HW3[49:] == 0).all()
    assert (Region(-500.0, 50.0, 100.0).crop(image_HW3, 16) == 0).all()


def test_a_body_is_upright_in_its_region() -> None:
    for angle in (0.0, 0.7, np.pi / 2, -3.0):
        hips_2 = np.array([100.0, 120.0])
        above_2 = hips_2 + 40 * np.array([np.sin(angle), -np.cos(angle)])
        region = Region.around(hips_2, above_2)
        assert region is not None and region.size == pytest.approx(100)
        turned = region.to_picture(np.array([[0.5, 0.5], [0.5, 0.1]]))
        assert turned == pytest.approx(np.stack([hips_2, above_2]))
        assert region.turn(np.array([[0.0, -1.0, 5.0]])) == pytest.approx(np.array([[*(above_2 - hips_2) / 40, 5.0]]))


def test_no_region_around_nothing() -> None:
    assert Region.around(np.array([3.0, 4.0]), np.array([3.0, 4.2])) is None
    assert Region.around(np.array([np.nan, 4.0]), np.array([3.0, 40.0])) is None
    assert Region.around(np.array([3.0, 4.0]), np.array([np.inf, 40.0])) is None


def test_how_far_squares_are_apart_is_told_by_the_smaller_one() -> None:
    assert Region(10, 20, 50).apart(Region(40, 60, 100, 1.0)) == Region(40, 60, 100).apart(Region(10, 20, 50)) == 1.0
