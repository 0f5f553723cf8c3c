"""Folders with a file of points a frame, however those are laid out."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mrhubo import UserError
from mrhubo.body.joints import KEYPOINT_NAMES, REST_K3
from mrhubo.motion import ReadOptions, read_folder, read_motion
from mrhubo.motion.readers.keypoint_sets import SETS

FRAMES = 24
REST = dict(zip(KEYPOINT_NAMES, REST_K3, strict=False))
RATE = ReadOptions(rate=30.0)


def places(bent: str, shift: float) -> np.ndarray:
    """COCO's points (T, K, 3) of somebody at rest whose forearm points up."""
    head = {"nose": [0, 0.04, 0.11], "left_ear": [0.07, 0.05, 0], "right_ear": [-0.07, 0.05, 0]}
    rows = np.stack([REST.get(name, REST["head"] + head.get(name, np.zeros(3))) for name in SETS["COCO"]])
    elbow, wrist = (SETS["COCO"].index(f"{bent}_{name}") for name in ("elbow", "wrist"))
    rows[wrist] = rows[elbow] + [0, 0.26, 0]
    return np.tile(rows + [shift, 1.0, 0], (FRAMES, 1, 1))


ONE, OTHER = places("left", 0.0), places("right", 3.0)
Write = Callable[[Path, int], object]


def dumped(path: Path, content: object) -> None:
    path.write_text(json.dumps(content))


ALONE: dict[str, Write] = {
    "array": lambda folder, t: np.save(folder / f"{t:05}.npy", ONE[t]),
    "named array": lambda folder, t: np.savez(folder / f"{t:05}.npz", keypoints_3d=ONE[t], score=0.9),
    "pickle": lambda folder, t: (folder / f"frame_{t}.pkl").write_bytes(pickle.dumps({"joints": ONE[t]})),
    "list": lambda folder, t: dumped(folder / f"{t}.json", ONE[t].tolist()),
    "landmarks": lambda folder, t: dumped(
        folder / f"{t:03}.json",
        {"poseWorldLandmarks": [{"x": x, "y": y, "z": z, "visibility": 0.9} for x, y, z in ONE[t].tolist()]},
    ),
    "names beside": lambda folder, t: dumped(
        folder / f"{t:03}.json", {"names": SETS["COCO"][::-1], "keypoints": ONE[t, ::-1].tolist()}
    ),
}
BOTH: dict[str, Write] = {
    "array": lambda folder, t: np.save(folder / f"{t:05}.npy", np.stack([ONE[t], OTHER[t]])),
    "by name": lambda folder, t: np.save(
        folder / f"{t:05}.npy",
        {"0": np.pad(ONE[t], ((0, 0), (0, 1)), constant_values=1), "1": np.pad(OTHER[t], ((0, 0), (0, 1)), constant_values=1)},
        allow_pickle=True,
    ),
    "list": lambda folder, t: dumped(
        folder / f"{t:03}.json", [{"keypoints": one[t].tolist(), "keypoint_scores": [0.9] * 17} for one in (ONE, OTHER)]
    ),
}  # fmt: skip


def bent(folder: Path, person: str | None = None) -> str:
    motion = read_motion(folder, ReadOptions(rate=30.0, person=person))
    assert len(motion) == FRAMES
    turns = [np.trace(motion.arrays.local_TJ33[0, joint - 1]) for joint in (18, 19)]
    return ("left", "right")[int(np.argmin(turns))]


@pytest.mark.parametrize("form", ALONE)
def test_one_person(form: str, tmp_path: Path) -> None:
    for t in range(FRAMES):
        ALONE[form](tmp_path, t)
    assert bent(tmp_path) == "left" and [found.name for found in read_folder(tmp_path, RATE)] == [tmp_path.name]


@pytest.mark.parametrize("form", BOTH)
def test_each_of_two_people(form: str, tmp_path: Path) -> None:
    for t in range(FRAMES):
        BOTH[form](tmp_path, t)
    assert bent(tmp_path, "0") == "left" and bent(tmp_path, "1") == "right"


def test_a_few_files_are_motions_of_their_own(tmp_path: Path) -> None:
    for number in range(4):
        np.savez(tmp_path / f"clip_{number}.npz", keypoints=ONE[:5], fps=30.0)
    assert [len(motion) for motion in read_folder(tmp_path)] == [5] * 4


def test_a_file_that_is_none_is_said(tmp_path: Path) -> None:
    for t in range(FRAMES):
        np.save(tmp_path / f"{t:05}.npy", ONE[t] if t != 7 else np.zeros(3))
    with pytest.raises(UserError, match=r"00007\.npy"):
        read_motion(tmp_path, RATE)


def test_a_line_of_json_a_frame(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    path.write_text(
        "\n".join(json.dumps({"frame": t, "keypoints": row.tolist()}) for t, row in enumerate(ONE)) + "\n\n"
    )
    assert bent(path) == "left"
    path.write_text(path.read_text().replace("]]}", "]}", 1))
    with pytest.raises(UserError, match="is no JSON"):
        read_motion(path, RATE)
