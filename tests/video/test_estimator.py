"""The estimator with its true models, on a figure that we draw: how its parts fit together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.errors import UserError
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.video import PoseEstimator
from mrhubo.video.models import DETECTOR
from mrhubo.view import Camera, human_figure, render
from tests.video.films import needs_models

LIMBS = [(f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"))]  # fmt: skip
PLACES = {name: place for place, name in enumerate(SETS["MediaPipe"])}


@pytest.fixture(scope="module")
def estimator() -> PoseEstimator:
    needs_models()
    return PoseEstimator("lite")


@pytest.fixture(scope="module")
def scene(root: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A picture (H, W, 3) of a figure that lifts a hand, and its keypoints [m], as the camera sees them: y up."""
    local_J33 = torch.eye(3).repeat(21, 1, 1)
    for joint, angle in ((15, -1.1), (16, 1.25), (17, -0.6)):
        turn = torch.tensor([[0.0, -angle, 0.0], [angle, 0.0, 0.0], [0.0, 0.0, 0.0]])
        local_J33[joint] = torch.matrix_exp(turn)
    figure = human_figure(local_J33)
    camera = Camera.framing(figure, (320, 320), azimuth_deg=0, elevation_deg=0, margin=0.12)
    image = np.asarray(render(figure, (320, 320), camera, background=(0.5, 0.55, 0.5), supersample=1))
    points_K3 = Skeleton().keypoints(local_J33[None])[0].numpy()
    return image, dict(zip(KEYPOINT_NAMES, points_K3, strict=True))


def degrees_off(point_K3: np.ndarray, true: dict[str, np.ndarray]) -> np.ndarray:
    """Between limbs that are found and true ones."""
    found, wanted = [], []
    for start, end in LIMBS:
        found.append(point_K3[PLACES[end]] - point_K3[PLACES[start]])
        wanted.append(true[end] - true[start])
    found, wanted = (np.stack(rows) / np.linalg.norm(rows, axis=1, keepdims=True) for rows in (found, wanted))
    return np.degrees(np.arccos(np.clip((found * wanted).sum(1), -1, 1)))


def test_limbs_are_found_where_they_are(estimator: PoseEstimator, scene) -> None:
    image_HW3, true = scene
    estimator.reset()
    first, again = estimator.landmarks(image_HW3), estimator.landmarks(image_HW3)
    for found in (first, again):
        assert (
            found.presence > 0.9 and found.visibility_K[[PLACES[name] for pair in LIMBS for name in pair]].min() > 0.5
        )
        off = degrees_off(found.point_K3, true)
        assert np.median(off) < 15 and off.max() < 45, off
    assert first.pixel_K2[PLACES["nose"]] == pytest.approx(again.pixel_K2[PLACES["nose"]], abs=6)
    assert first.pixel_K2[PLACES["left_shoulder"]][0] > first.pixel_K2[PLACES["right_shoulder"]][0], "it faces us"


def test_a_turned_camera_turns_the_points(estimator: PoseEstimator, scene) -> None:
    """Somebody upside down is found as somebody upright is, and turned."""
    image_HW3, true = scene
    estimator.reset()
    found = estimator.landmarks(np.rot90(image_HW3, 2))
    assert found.presence > 0.9
    assert np.median(degrees_off(found.point_K3 * [-1, -1, 1], true)) < 15
    height, width = image_HW3.shape[:2]
    estimator.reset()
    upright = estimator.landmarks(image_HW3)
    assert [width, height] - found.pixel_K2[:17] == pytest.approx(upright.pixel_K2[:17], abs=12)


def test_whoever_is_lost_is_found_again(estimator: PoseEstimator, scene) -> None:
    image_HW3, true = scene
    estimator.reset()
    assert estimator.landmarks(image_HW3).presence > 0.9
    nobody = estimator.landmarks(np.full_like(image_HW3, 128))
    assert nobody.presence < 0.5 and np.isnan(nobody.point_K3).all() and (nobody.visibility_K == 0).all()
    wide_HW3 = np.full((320, 960, 3), 128, np.uint8)
    wide_HW3[:, :320] = image_HW3
    moved_HW3 = wide_HW3[:, ::-1][:, :, :].copy()
    moved_HW3[:, 640:] = image_HW3
    moved_HW3[:, :640] = 128
    assert estimator.landmarks(wide_HW3).presence > 0.9
    found = estimator.landmarks(moved_HW3)
    assert found.presence > 0.5 and found.pixel_K2[0, 0] > 640, "looked for again in the same picture"
    assert np.median(degrees_off(found.point_K3, true)) < 15


@pytest.mark.parametrize("place", [(40, 60), (100, 560)])
def test_somebody_small_is_found(estimator: PoseEstimator, scene, place: tuple[int, int]) -> None:
    image_HW3, true = scene
    down, right = place
    wide_HW3 = np.full((480, 854, 3), (128, 140, 128), np.uint8)
    wide_HW3[down : down + 160, right : right + 160] = image_HW3.reshape(160, 2, 160, 2, 3).mean((1, 3))
    estimator.reset()
    found = estimator.landmarks(wide_HW3)
    assert found.presence > 0.9, "a person of a sixth of the longer side"
    assert np.median(degrees_off(found.point_K3, true)) < 15
    hip_2 = (found.pixel_K2[23] + found.pixel_K2[24]) / 2
    assert (np.abs(hip_2 - [right + 80, down + 80]) < 20).all()


def test_nobody_is_looked_for_in_parts_now_and_then(estimator: PoseEstimator, monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[int] = []
    monkeypatch.setattr(estimator._detector, "find_small", lambda image: looks.append(1) or [])
    estimator.reset()
    for _ in range(21):
        assert np.isnan(estimator.landmarks(np.full((64, 96, 3), 128, np.uint8)).point_K3).all()
    assert len(looks) == 3


def test_of_a_long_picture_no_parts_are_looked_through(
    estimator: PoseEstimator, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[int] = []
    monkeypatch.setattr(estimator._detector, "_look", lambda image, square: looks.append(1) or [])
    for width, height in ((8192, 1), (1, 8192), (4096, 300), (1, 1)):
        assert estimator._detector.find_small(np.zeros((height, width, 3), np.uint8)) == []
    assert len(looks) <= 1
    assert estimator._detector.find_small(np.zeros((1080, 1920, 3), np.uint8)) == [] and 20 < len(looks) < 30


def test_others_are_seen(estimator: PoseEstimator, scene) -> None:
    image_HW3, _ = scene
    estimator.reset()
    assert not estimator.sees_others(image_HW3), "nobody is followed"
    estimator.landmarks(image_HW3)
    assert not estimator.sees_others(image_HW3)
    both_HW3 = np.concatenate([image_HW3, image_HW3], axis=1)
    estimator.reset()
    estimator.landmarks(both_HW3)
    assert estimator.sees_others(both_HW3)


def test_pictures_and_models_are_checked(estimator: PoseEstimator, tmp_path: Path) -> None:
    for image in (np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3)), np.zeros((0, 4, 3), np.uint8)):
        with pytest.raises(ValueError, match="a picture is"):
            estimator.landmarks(image)
    with pytest.raises(UserError, match="'larg' does not exist.*full.*heavy.*lite"):
        PoseEstimator("larg")
    with pytest.raises(UserError, match=f"{DETECTOR}: there is no such file"):
        PoseEstimator("lite", folder=tmp_path)
    (tmp_path / DETECTOR).write_bytes(b"\x1c\0\0\0TFL3" + bytes(100))
    with pytest.raises(UserError, match=f"{DETECTOR}: is no model of TensorFlow Lite, or damaged"):
        PoseEstimator("lite", folder=tmp_path)
