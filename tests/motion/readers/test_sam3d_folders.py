"""Folders with a file of SAM 3D Body's answers a frame, or a file a person and frame."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrhubo import UserError
from mrhubo.motion import ReadOptions, read_folder, read_motion
from tests.motion.readers.test_soma_and_points import FRAMES, bent_arms, check_points, seventy_points

RATE = ReadOptions(rate=30.0)


def answers(second: bool) -> list[list[dict[str, Any]]]:
    """Of whoever is in each frame: a second person in every other frame, first in the list."""
    points = seventy_points(bent_arms()).astype(np.float32)
    skin = np.zeros((40, 3), np.float32)
    return [
        ([{"pred_keypoints_3d": p + 1, "pred_cam_t": np.full(3, 4.0), "mask": None}] if second and t % 2 else [])
        + [{"pred_keypoints_3d": p, "pred_cam_t": np.zeros(3), "pred_vertices": skin, "mask": None}]
        for t, p in enumerate(points)
    ]


def write(folder: Path, form: str, second: bool) -> None:
    for t, here in enumerate(answers(second)):
        if form == "data":
            np.savez(folder / f"frame_{t:05}.npz", data=np.array(here, dtype=object))
        elif form == "lists":
            (folder / f"{t:05}.pkl").write_bytes(pickle.dumps(here))
        else:
            for number, person in enumerate(here):
                arrays = {key: array for key, array in person.items() if array is not None}
                np.savez(folder / f"{t:05}_{number}.npz", **arrays)


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize("form", ["data", "lists", "files"])
def test_each_of_the_people(form: str, second: bool, tmp_path: Path) -> None:
    write(tmp_path, form, second)
    motion = read_motion(tmp_path, RATE)
    check_points(motion)
    assert len(motion) == FRAMES and motion.name == tmp_path.name
    assert [found.name for found in read_folder(tmp_path, RATE)] == [tmp_path.name]
    if second:
        other = read_motion(tmp_path, ReadOptions(rate=30, person="1"))
        assert other.confidence_TJ is not None and other.confidence_TJ[:, 0].tolist() == [0, 1, 0, 1, 0]
    with pytest.raises(UserError, match="--rate"):
        read_motion(tmp_path)


def test_a_frame_that_is_none_is_said(tmp_path: Path) -> None:
    write(tmp_path, "data", False)
    np.savez(tmp_path / "frame_00002.npz", data=np.zeros(3))
    with pytest.raises(UserError, match=r"frame_00002\.npz: has no answer"):
        read_motion(tmp_path, RATE)


def test_clips_are_no_frames(tmp_path: Path) -> None:
    for clip in ("1", "2"):
        np.savez(tmp_path / f"{clip}.npz", pred_keypoints_3d=seventy_points(bent_arms()), fps=30.0)
    assert [len(motion) for motion in read_folder(tmp_path)] == [FRAMES, FRAMES]
