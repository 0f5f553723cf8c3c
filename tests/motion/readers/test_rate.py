"""A frame rate that a file leaves open is told by the user; one that it tells, in whatever way, is taken."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrhubo.body.joints import KEYPOINT_NAMES, REST_K3
from mrhubo.errors import UserError
from mrhubo.files.tree import tree_of
from mrhubo.motion import Motion, ReadOptions, read_motion
from mrhubo.motion.readers.rate import number_told

OPEN: dict[str, Any] = {
    "none": None,
    "nothing": "",
    "zero": 0,
    "negative": -30.0,
    "nan": np.nan,
    "infinite": np.inf,
    "empty": np.zeros(0),
    "words": "thirty",
    "several": [30, 60],
    "flag": np.array(True),
    "huge": 10**400,
    "tree": {"a": 1},
}
TOLD: dict[str, Any] = {
    "text": "29.97",
    "number": 29.97,
    "scalar": np.float64(29.97),
    "rows": np.full((4, 1), 29.97),
    "list": [29.97],
}
POSES = np.zeros((5, 72))
POINTS = np.tile(REST_K3, (5, 1, 1)) + np.linspace(0, 0.1, 5)[:, None, None]


def write(kind: str, path: Path, **more: Any) -> None:
    """A motion with whatever else, as each reader is given it."""
    if kind == "pickle":
        path.write_bytes(pickle.dumps({"poses": POSES, **more}))
    elif kind == "points":
        path.write_bytes(pickle.dumps({"keypoints": POINTS, "names": list(KEYPOINT_NAMES), **more}))
    elif kind == "json":
        content = {"keypoints": POINTS.tolist(), "names": KEYPOINT_NAMES, **more}
        path.write_text(json.dumps(content, default=lambda value: value.tolist()))
    else:
        arrays = {"poses": POSES} if kind == "amass" else {"keypoints": POINTS, "names": np.array(KEYPOINT_NAMES)}
        np.savez(path.open("wb"), **arrays, **more)


@pytest.mark.parametrize("case", ["none", "zero", "nan", "words"])
@pytest.mark.parametrize("kind", ["pickle", "points", "json", "amass", "npz"])
def test_a_rate_that_the_file_leaves_open_is_the_users(tmp_path: Path, kind: str, case: str) -> None:
    write(kind, tmp_path / "a", fps=OPEN[case])
    with pytest.raises(UserError, match=r"a: .*frame rate.*--rate 30"):
        read_motion(tmp_path / "a")
    motion = read_motion(tmp_path / "a", ReadOptions(rate=25))
    assert motion.frame_rate == 25 and any("'fps' tells no frame rate" in note for note in motion.notes)


@pytest.mark.parametrize("case", ["text", "scalar"])
@pytest.mark.parametrize("kind", ["pickle", "points", "json", "amass", "npz"])
def test_a_rate_that_the_file_tells_goes_before_the_users(tmp_path: Path, kind: str, case: str) -> None:
    write(kind, tmp_path / "a", mocap_framerate=None, fps=TOLD[case])
    assert read_motion(tmp_path / "a").frame_rate == 29.97
    motion = read_motion(tmp_path / "a", ReadOptions(rate=25))
    assert motion.frame_rate == 29.97 and any("25" in note for note in motion.notes)


def test_a_rate_that_nobody_believes_gives_way_to_the_users(tmp_path: Path) -> None:
    write("pickle", tmp_path / "a", fps=5000)
    with pytest.raises(UserError, match="'fps' is 5000 frames per second; expected 1 to 1000; .*--rate 30"):
        read_motion(tmp_path / "a")
    motion = read_motion(tmp_path / "a", ReadOptions(rate=25))
    assert motion.frame_rate == 25 and "25 are taken, as given" in motion.notes[0]


def test_each_clip_has_its_own_rate_and_what_goes_for_all_is_found_beside_them(tmp_path: Path) -> None:
    def read(person: str, **content: Any) -> Motion:
        (tmp_path / "a").write_bytes(pickle.dumps(content))
        return read_motion(tmp_path / "a", ReadOptions(person=person))

    walk, run = {"poses": POSES}, {"poses": POSES, "fps": 60}
    assert read("run", walk={**walk, "fps": 30}, run=run).frame_rate == 60
    assert read("walk", walk=walk, run=run, meta={"fps": 24}).frame_rate == 24
    with pytest.raises(UserError, match="--rate"):
        read("walk", walk=walk, run=run)
    (tmp_path / "a").write_bytes(pickle.dumps({"x": {"keypoints": POINTS, "names": KEYPOINT_NAMES}, "fps": 24}))
    assert read_motion(tmp_path / "a").frame_rate == 24


@pytest.mark.parametrize("confidence", [None, "", 0.9])
@pytest.mark.parametrize("kind", ["points", "npz"])
def test_a_confidence_that_is_none_is_left_out(tmp_path: Path, kind: str, confidence: Any) -> None:
    write(kind, tmp_path / "a", fps=30, confidence=confidence, scores=np.full(len(KEYPOINT_NAMES), 0.75))
    motion = read_motion(tmp_path / "a")
    assert motion.confidence_TJ is not None and float(motion.confidence_TJ.max()) == 0.75


@pytest.mark.parametrize("value", [*OPEN.values(), [[1], [2, 3]], "1e999", True])
def test_what_tells_no_number(value: Any) -> None:
    assert number_told(tree_of(value, Path("a"), "")) is None


@pytest.mark.parametrize("value", TOLD.values())
def test_what_tells_a_number(value: Any) -> None:
    assert number_told(tree_of(value, Path("a"), "")) == 29.97


@pytest.mark.parametrize("kind", ["npz", "pickle", "points", "json"])
@pytest.mark.parametrize("unit", [1.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("rate", [15.0, 29.97002997002997, 60.0, 120.0])
def test_evenly_spaced_times_tell_the_rate(kind: str, unit: float, rate: float, tmp_path: Path) -> None:
    """In seconds, milli-, micro- or nanoseconds, from wherever a clock began."""
    time = np.arange(len(POSES)) / rate * unit + (0 if unit == 1 else 1e4 * unit)
    written = time if unit < 1e6 else np.round(time).astype(np.int64)
    write(kind, tmp_path / "a", timestamps=written.tolist() if kind == "json" else written)
    assert read_motion(tmp_path / "a").frame_rate == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(
    "times",
    [[0, 1, 2, 3, 4], [0, 5, 10, 15, 20], [0.0, 0.1, 0.4, 0.5, 0.6], [4, 3, 2, 1, 0], [0.0] * 5, "now", [0.0, np.nan, 1, 2, 3]],
)  # fmt: skip
def test_numbers_of_frames_and_uneven_times_tell_none(times: Any, tmp_path: Path) -> None:
    write("pickle", tmp_path / "a", timestamps=times)
    with pytest.raises(UserError, match="--rate"):
        read_motion(tmp_path / "a")
    write("pickle", tmp_path / "a", timestamps=times, video_fps=25)
    assert read_motion(tmp_path / "a").frame_rate == 25


@pytest.mark.parametrize(
    ("told", "rate"),
    [
        ({"sample_rate": 60}, 60),
        ({"dt": 0.02}, 50),
        ({"sample_rate": 44_100, "dt": 0.02}, 50),  # a sound's
        ({"sample_rate": 100, "fps": 25}, 25),
        ({"dt": 33, "sampling_rate": 16_000}, None),
    ],
)
def test_other_words_for_a_rate_are_believed_if_they_may_be_one(
    told: dict[str, float], rate: float | None, tmp_path: Path
) -> None:
    path = tmp_path / "a.npz"
    write("npz", path, **told)
    if rate is None:
        with pytest.raises(UserError, match="--rate"):
            read_motion(path)
    else:
        assert read_motion(path).frame_rate == rate
