"""Cameras by OpenCV, which reads films by the same calls."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.video.camera import Camera
from tests.video.films import write_video


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Any]:
    """Which cameras OpenCV is asked for; each is a film of four pictures, whose upper left quarter is red."""
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
    images = [np.full((64, 96, 3), 40 * number, np.uint8) for number in range(4)]
    for image_HW3 in images:
        image_HW3[:32, :48] = 230, 20, 20
    film, open_film, found = write_video(tmp_path / "film.mp4", images), cv2.VideoCapture, []

    def opened(device: Any) -> Any:
        found.append(device)
        return open_film(str(film))

    monkeypatch.setattr(cv2, "VideoCapture", opened)
    return found


def test_pictures_come_with_their_moments_until_the_camera_is_gone(asked: list[Any]) -> None:
    camera = Camera("0")
    assert camera.size == (96, 64) and asked == [0]
    moments = iter(range(100))
    pictures = camera.frames(lambda: float(next(moments)))
    found = [next(pictures) for _ in range(3)]  # opening it took one
    assert [picture.time for picture in found] == [1.0, 2.0, 3.0]
    for number, (_, image_HW3) in enumerate(found, 1):
        assert image_HW3.shape == (64, 96, 3) and image_HW3.dtype == np.uint8
        assert np.abs(image_HW3[8:24, 8:40].mean((0, 1)) - [230, 20, 20]).max() < 12, "red comes first"
        assert abs(image_HW3[40:, 56:].mean() - 40 * number) < 8
    with pytest.raises(UserError, match="camera 0: is gone"):
        next(pictures)
    camera.close()
    camera.close()


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ((True, None), "camera 0: gives no picture"),
        ((True, np.zeros((0, 0, 3), np.uint8)), "camera 0: gives no picture"),
        (OSError(19, "No such device"), "camera 0: gives no picture"),
        ((True, np.zeros((4, 4, 3), np.float32)), "camera 0: gives pictures of float32; only those of uint8 are read"),
    ],
)
def test_what_is_no_picture_is_told(given: Any, sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
    device = Mock()
    device.read.side_effect = [given]
    monkeypatch.setattr(cv2, "VideoCapture", lambda number: device)
    with pytest.raises(UserError, match=sentence):
        Camera("0")
    assert device.release.called


def test_grey_pictures_are_read_as_grey_ones_in_colour(monkeypatch: pytest.MonkeyPatch) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
    device = Mock()
    device.read.return_value = True, np.full((4, 6), 90, np.uint8)
    monkeypatch.setattr(cv2, "VideoCapture", lambda number: device)
    image_HW3 = next(Camera("0").frames()).image_HW3
    assert image_HW3.shape == (4, 6, 3) and (image_HW3 == 90).all()


def test_a_picture_that_does_not_come_is_left_out(asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    camera = Camera("0")
    answers = iter([None, np.zeros((2, 2, 3), np.uint8), None, None, np.ones((2, 2, 3), np.uint8), *[None] * 1000])
    monkeypatch.setattr(camera, "_read", lambda: next(answers))
    pictures = camera.frames()
    assert [float(next(pictures).image_HW3.mean()) for _ in range(2)] == [0.0, 1.0]
    begun = time.monotonic()
    with pytest.raises(UserError, match="camera 0: is gone"):
        next(pictures)
    assert 0.4 < time.monotonic() - begun < 60.0


@pytest.mark.parametrize("device", ["", "film.mp4", "http://127.0.0.1/", "/dev/video999", "-1", "1234", "0 1", "²"])
def test_what_is_no_camera_is_not_opened(device: str, asked: list[Any]) -> None:
    with pytest.raises(UserError, match="is no camera; they have the numbers 0, 1"):
        Camera(device)
    assert asked == []


def test_a_character_device_is_opened_by_its_path(asked: list[Any]) -> None:
    Camera("/dev/null").close()
    assert asked == ["/dev/null"]
