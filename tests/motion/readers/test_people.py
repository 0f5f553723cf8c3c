"""People and clips in one file are all found, whatever else lies beside them."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.motion import Motion, ReadOptions, read_motion
from tests.motion.readers.estimator_files import made_up, padded


def body(frames: int, **more: Any) -> dict[str, Any]:
    return {"pose": padded(made_up(frames), 24), **more}


def vibe(frames: int) -> dict[str, Any]:
    return body(frames, pred_cam=np.zeros((frames, 3)), frame_ids=np.arange(frames))


def read(path: Path, content: Any, person: str | None = None) -> Motion:
    path.write_bytes(pickle.dumps(content))
    return read_motion(path, ReadOptions(rate=30, person=person))


@pytest.mark.parametrize(
    "odd",
    [
        {"webcam_dance": body(3)},
        {"global_games": body(3), "my-world": body(3)},
        {"cam_1": body(3), "cam_2": body(4)},
        {"camera": {"fx": np.array(500.0)}},
        {"meta": {"fps": None, "bodies": [1, 2]}},
        {"someone": {"pose": np.zeros(72)}},
        {"someone's webcam": {"pose": np.zeros(72)}},
        {"nobody": {"pose": np.zeros((0, 72))}},
        {"empty": {}, "none": None, "text": "x", "fps": 30},
        {"deeper": {"gt": body(9)}},
    ],
)
def test_an_odd_entry_hides_nobody(tmp_path: Path, odd: dict[str, Any]) -> None:
    for content in ({**odd, "walk": body(4), "run": body(6)}, {"walk": body(4), **odd, "run": body(6)}):
        motion = read(tmp_path / "a", content)
        said = " ".join(motion.notes)
        assert len(motion) == 6 and "'run' (6 frames)" in said and "'walk' (4 frames)" in said
        assert ("left out, as" in said) == bool({"someone", "someone's webcam", "deeper", "empty"} & set(odd))
        assert len(read(tmp_path / "a", content, "walk")) == 4
        with pytest.raises(UserError, match="no person 'Bob'; there are 'run'"):
            read(tmp_path / "a", content, "Bob")


@pytest.mark.parametrize("beside", [{}, {"camera": {"fx": 1.0}}, {"fps": 30}, {2: vibe(3), "meta": {"fps": 30}}])
def test_tracks_are_known_beside_what_goes_for_all(tmp_path: Path, beside: dict[Any, Any]) -> None:
    for content in ({1: vibe(5), **beside}, {"results": {1: vibe(5), **beside}}, {**beside, 1: vibe(5)}):
        motion = read(tmp_path / "a", content)
        assert motion.source.startswith("VIBE") and len(motion) == 5
        assert len(read(tmp_path / "a", content, "1")) == 5


def test_one_person_in_the_world_and_as_a_camera_sees_them_is_one(tmp_path: Path) -> None:
    """GVHMR's files have the network's answers beside, with as many parameters again."""
    parts = {"smpl_params_incam": body(4), "smpl_params_global": body(5)}
    motion = read(tmp_path / "a", {"net_outputs": {"decode": body(6), **parts}, **parts})
    assert len(motion) == 5 and motion.source.startswith("GVHMR, 'smpl_params_global")
    for names in (
        ("cam", "world"),
        ("smplx_cam", "smplx_world"),
        ("smplx-camera", "smplx"),
        ("paramsIncam", "paramsGlobal"),
    ):
        content = {name: body(n + 4) for n, name in enumerate(names)}
        assert len(read(tmp_path / "a", {1: {"frames": np.arange(5), **content}, 2: {"smplx_world": body(2)}})) == 5
        assert len(read(tmp_path / "a", content)) == 5


def test_people_one_deeper_are_all_found(tmp_path: Path) -> None:
    content = {"results": {1: body(3), 2: body(5)}}
    motion = read(tmp_path / "a", content)
    assert len(motion) == 5 and "'2' (5 frames), '1' (3 frames)" in motion.notes[0]
    assert len(read(tmp_path / "a", content, "1")) == 3


def test_who_is_asked_for_is_left_out_only_where_there_is_one(tmp_path: Path) -> None:
    assert "there is one only" in read(tmp_path / "a", body(3), "Bob").notes[0]


def test_people_of_whom_some_have_no_points(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(4, 17, 3))
    for bad in (None, np.array(3.0), "x"):
        content = {"a": {"keypoints": bad}, "b": {"keypoints": points}, "c": {"keypoints": points[:2]}}
        with pytest.raises(UserError, match=r"no person 'Bob'; there are 'b' \(4 frames\), 'c' \(2 frames\)$"):
            read(tmp_path / "a", content, "Bob")
