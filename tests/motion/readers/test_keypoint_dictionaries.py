"""Dictionaries of clips of points, by subject and action."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES, REST_K3
from mrhubo.motion import ReadOptions, read_motion

REST = REST_K3[:22].astype(np.float64)


def clip(frames: int, bent: str) -> np.ndarray:
    """Somebody at rest whose forearm points up."""
    points = np.tile(REST + [0, 1, 0], (frames, 1, 1))
    points[:, JOINT_NAMES.index(f"{bent}_wrist")] = points[0, JOINT_NAMES.index(f"{bent}_elbow")] + [0, 0.26, 0]
    return points


CLIPS = {"S1": {"Walking": clip(9, "left"), "Eating 1": clip(5, "right")}, "S5": {"Walking": clip(7, "right")}}
"""As VideoPose3D keeps Human3.6M's, which have 17 or 32 points."""


def bent(path: Path, person: str | None = None) -> str:
    local_TJ33 = read_motion(path, ReadOptions(rate=50, person=person)).arrays.local_TJ33
    return ("left", "right")[int(np.argmin([np.trace(local_TJ33[0, joint - 1]) for joint in (18, 19)]))]


@pytest.mark.parametrize("form", ["npz", "pkl", "flat"])
def test_each_clip_goes_by_its_name(form: str, tmp_path: Path) -> None:
    path, before = tmp_path / "a", ""
    if form == "npz":
        before = "positions_3d/"
        with path.open("wb") as file:
            np.savez(file, positions_3d=np.array(CLIPS, dtype=object))
    else:
        content: dict[str, Any] = CLIPS if form == "pkl" else {
            f"{subject}/{action}": points for subject, clips in CLIPS.items() for action, points in clips.items()
        }  # fmt: skip
        path.write_bytes(pickle.dumps(content))
    assert bent(path) == "left"
    assert f"'{before}S5/Walking' (7 frames)" in " ".join(read_motion(path, ReadOptions(rate=50)).notes)
    assert bent(path, f"{before}S1/Eating 1") == bent(path, f"{before}S5/Walking") == "right"
    with pytest.raises(UserError, match="there is no person 'S9'"):
        bent(path, "S9")


def test_what_is_no_clip_makes_a_dictionary_of_none(tmp_path: Path) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(CLIPS | {"S6": {"weights": np.zeros((3, 3))}}))
    with pytest.raises(UserError, match="no human motion"):
        read_motion(tmp_path / "a.pkl", ReadOptions(rate=50))
