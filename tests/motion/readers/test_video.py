"""Motions from videos: what an estimator tells of a body becomes that body's motion."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.errors import UserError
from mrhubo.motion import Motion, ReadOptions, motion_files, read_motion
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.video import read_video
from mrhubo.video import estimator as estimators
from mrhubo.video import track
from mrhubo.video.estimator import Estimate
from mrhubo.video.frames import Frame
from mrhubo.video.smoothing import smoothed
from tests.video.films import needs_models, numbered, write_video

LIMBS = [(f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"))]  # fmt: skip
FILM = Path("walk.mp4")


def points_of(motion: Motion) -> dict[str, np.ndarray]:
    """Keypoints (T, 3) [m] with the root's rotation."""
    points_TK3 = Skeleton().keypoints(motion.local_TJ33)
    if motion.root_rotation_T33 is not None:
        points_TK3 = points_TK3 @ motion.root_rotation_T33.mT
    return dict(zip(KEYPOINT_NAMES, points_TK3.numpy().transpose(1, 0, 2), strict=True))


def degrees_off(found: dict[str, np.ndarray], true: dict[str, np.ndarray]) -> np.ndarray:
    """Angles (T, L) between limbs."""
    units = []
    for points in (found, true):
        limb_TL3 = np.stack([points[end] - points[start] for start, end in LIMBS], axis=1)
        units.append(limb_TL3 / np.linalg.norm(limb_TL3, axis=-1, keepdims=True))
    return np.degrees(np.arccos(np.clip((units[0] * units[1]).sum(-1), -1, 1)))


@pytest.fixture
def walk() -> Motion:
    """Somebody who moves arms and legs at random, slowly, and turns."""
    generator = torch.Generator().manual_seed(3)
    turns_J33 = torch.linalg.matrix_exp(0.25 * torch.randn(21, 3, 3, generator=generator).triu(1))
    skew_TJ33 = torch.linspace(0, 1, 12)[:, None, None, None] * (turns_J33 - turns_J33.mT)
    root_T33 = torch.linalg.matrix_exp(
        torch.linspace(0, 0.8, 12)[:, None, None] * torch.tensor([[0.0, 0, 1], [0, 0, 0], [-1, 0, 0]])
    )
    return Motion("walk", torch.linalg.matrix_exp(skew_TJ33), 25.0, root_rotation_T33=root_T33)


@pytest.fixture
def place_T2() -> np.ndarray:
    """Where in the picture each frame's person is [pixels]."""
    return np.zeros((12, 2))


@pytest.fixture
def seen(walk: Motion, place_T2: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> dict[str, np.ndarray]:
    """The points of the walk, which whoever reads a film is told; a hand is hidden for three frames, and for two more
    nobody is there.
    """
    true = points_of(walk)
    head = true["left_eye"] + true["right_eye"]
    forward = np.cross(true["left_eye"] - true["right_eye"], [0.0, -1.0, 0.0])
    point_TK3 = np.stack([true.get(name, head / 2) for name in SETS["MediaPipe"]], axis=1)
    point_TK3[:, 0] = head / 2 - 0.5 * forward
    visibility_TK = np.full(point_TK3.shape[:2], 0.9)
    visibility_TK[4:7, SETS["MediaPipe"].index("left_wrist")] = 0.1
    point_TK3[9:11], visibility_TK[9:11] = np.nan, 0.0

    class Told:
        def __init__(self, model: str) -> None:
            self.frame, self.model = -1, model

        def reset(self) -> None:
            pass

        def landmarks(self, image_HW3: np.ndarray) -> Estimate:
            self.frame += 1
            pixel_K2 = 100 * point_TK3[self.frame, :, :2] + place_T2[self.frame]
            return Estimate(point_TK3[self.frame], visibility_TK[self.frame], 1.0, pixel_K2)

        def sees_others(self, image_HW3: np.ndarray) -> bool:
            return False

    monkeypatch.setattr(estimators, "PoseEstimator", Told)
    monkeypatch.setattr(track, "frames", lambda path: (Frame(t / 25, np.zeros((2, 2, 3), np.uint8)) for t in range(12)))
    return true


def test_limbs_point_as_the_estimator_says(walk: Motion, seen: dict[str, np.ndarray]) -> None:
    motion = read_video(FILM, ReadOptions())
    assert motion.name == "walk" and motion.frame_rate == pytest.approx(25) and len(motion) == 12
    known_T = np.isin(np.arange(12), [9, 10], invert=True)
    told = {name: np.where(known_T[:, None], point_T3, np.nan)[:, None] for name, point_T3 in seen.items()}
    calm = {name: smoothed(point_T13, 25.0)[:, 0] for name, point_T13 in told.items()}
    off_TL = degrees_off(points_of(motion), calm)
    hidden_TL = np.zeros(off_TL.shape, bool)
    hidden_TL[4:7, LIMBS.index(("left_elbow", "left_wrist"))] = True
    assert off_TL[known_T][~hidden_TL[known_T]].max() < 0.5
    assert degrees_off(points_of(motion), seen).max() < 8, "what is not seen goes on the way between what is"


def test_what_is_not_seen_is_told(seen: dict[str, np.ndarray]) -> None:
    motion = read_video(FILM, ReadOptions(rate=30))
    said = "\n".join(motion.notes)
    assert (
        "nobody is found in 2 of 12 frames" in said and "left elbow to left wrist is not seen in 5 of 12 frames" in said
    )
    assert "where the person goes is not known" in said and motion.root_position_T3 is None
    assert "30 that was given is left out: the file says 25" in said
    assert "full" in motion.source and "heavy" in read_video(FILM, ReadOptions(pose_model="heavy")).source
    sure_TJ = motion.arrays.confidence_TJ
    assert sure_TJ is not None and (sure_TJ[9:11] == 0).all() and sure_TJ[0] == pytest.approx(0.9)


def test_of_people_who_are_followed_one_after_the_other_one_is_taken(
    seen: dict[str, np.ndarray], place_T2: np.ndarray
) -> None:
    whole = read_video(FILM, ReadOptions(person="someone"))
    assert "'someone' that was asked for is left out" in "\n".join(whole.notes)
    place_T2[7:, 0] = 3000
    motion = read_video(FILM, ReadOptions())
    part, all_of_it = ({name: x_T3[:4] for name, x_T3 in points_of(each).items()} for each in (motion, whole))
    assert len(motion) == 7 and degrees_off(part, all_of_it).max() < 0.1
    said = "\n".join(motion.notes)
    assert "'0' is seen longest and was taken; there are '0' (7 frames), '1' (3 frames)" in said
    assert "'0' is seen from 0 to 0.24 s of the film" in said
    other = read_video(FILM, ReadOptions(person="1"))
    assert len(other) == 5 and "'1' is seen from 0.28 to 0.44 s of the film" in other.notes
    with pytest.raises(UserError, match="there is no person '2'; there are '0'"):
        read_video(FILM, ReadOptions(person="2"))


def test_videos_are_read_by_name_and_not_among_a_folders_motions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    film = write_video(tmp_path / "film.mp4", numbered(2))
    with pytest.raises(UserError, match="holds no motion file"):
        motion_files(tmp_path)
    monkeypatch.setenv("MRHUBO_POSE_MODELS", str(tmp_path / "none"))
    with pytest.raises(UserError, match="mrhubo models"):
        read_motion(film)
    monkeypatch.setitem(sys.modules, "ai_edge_litert.interpreter", None)
    monkeypatch.setattr(estimators, "find_models", lambda: film.parent)
    with pytest.raises(UserError, match=r"pip install 'mrhubo\[video\]'"):
        read_motion(film)


def test_a_film_of_a_figure_is_read(tmp_path: Path) -> None:
    """With the true models; benchmarks/camera.py measures how well."""
    needs_models()
    from mrhubo.view import Camera, human_figure, render

    local_TJ33 = torch.eye(3).repeat(3, 21, 1, 1)
    for t, lifted in enumerate((-0.9, -0.6, -0.3)):
        for joint, angle in ((15, lifted), (16, -lifted)):
            local_TJ33[t, joint] = torch.matrix_exp(torch.tensor([[0.0, -angle, 0], [angle, 0, 0], [0, 0, 0]]))
    figures = [human_figure(local_J33) for local_J33 in local_TJ33]
    camera = Camera.framing(figures, (256, 256), azimuth_deg=0, elevation_deg=0, margin=0.12)
    images = [np.asarray(render(f, (256, 256), camera, (0.5, 0.55, 0.5), supersample=1)) for f in figures]
    motion = read_motion(write_video(tmp_path / "film.mp4", images), ReadOptions(pose_model="lite"))
    assert len(motion) == 3 and motion.frame_rate == pytest.approx(25)
    off_TL = degrees_off(points_of(motion), points_of(Motion("true", local_TJ33, 25.0)))
    assert np.median(off_TL) < 15, off_TL
