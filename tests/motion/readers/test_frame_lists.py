"""Lists of frames, of detections and of people, wherever they are in a file."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.body.joints import REST_K3
from mrhubo.body.rest_directions import from_family
from mrhubo.motion import Motion, ReadOptions, read_motion
from mrhubo.motion.readers.content import NoMotion
from tests.motion.readers.estimator_files import made_up, matrices, padded

FRAMES = 12
POSES = {name: made_up(FRAMES, seed=seed) for seed, name in enumerate(("4", "9"))}
PLACES = {"4": np.zeros(3), "9": np.array([3.0, 0.0, 0.0])}


def of(name: str, t: int, **more: Any) -> dict[str, Any]:
    """Parameters of somebody in a frame."""
    body, place = POSES[name][t, 1:].reshape(63).tolist(), PLACES[name] + [0, 0, t / 30]
    return {"global_orient": POSES[name][t, 0].tolist(), "body_pose": body, "transl": place.tolist(), **more}


def read(path: Path, content: Any, person: str | None = None, rate: float | None = 30) -> Motion:
    if path.suffix == ".json":
        path.write_text(json.dumps(content))
    else:
        path.write_bytes(pickle.dumps(content))
    return read_motion(path, ReadOptions(rate=rate, person=person))


def is_it(motion: Motion, name: str, frames: list[int] | None = None) -> bool:
    frames = list(range(FRAMES)) if frames is None else frames
    expected = from_family(matrices(POSES[name][frames, 1:]), motion.family)
    kept = np.array(frames) - frames[0]
    return len(motion) == kept[-1] + 1 and np.allclose(motion.arrays.local_TJ33[kept], expected, atol=1e-5)


@given(
    order=st.permutations([(t, name) for t in range(FRAMES) for name in POSES]),
    key=st.sampled_from(("frame_id", "frame", "img_path")),
    named=st.booleans(),
    ending=st.sampled_from((".pkl", ".json")),
)
def test_entries_that_tell_their_frames_are_people_in_them(
    order: list[tuple[int, str]], key: str, named: bool, ending: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """In any order, with a gap, called or not."""
    path = tmp_path_factory.mktemp("list") / f"a{ending}"
    entries = [
        of(name, t, **{key: f"video/{t:05}.jpg" if key == "img_path" else t}, **({"track_id": int(name)} if named else {}))
        for t, name in order
        if t not in (3, 4)
    ]  # fmt: skip
    frames = [t for t in range(FRAMES) if t not in (3, 4)]
    people = [name for t, name in order if t == 0]  # those without a name are numbered as they come
    for number, name in enumerate(people):
        motion = read(path, entries, name if named else str(number))
        assert is_it(motion, name, frames)
        sure = motion.arrays.confidence_TJ
        assert sure is not None and np.flatnonzero(sure.max(axis=1) == 0).tolist() == [3, 4]


@pytest.mark.parametrize("ending", [".pkl", ".json"])
@pytest.mark.parametrize("key", ["frames", "results", "data"])
def test_frames_under_a_key(key: str, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{ending}"
    for people in (None, "people", "instances"):
        frames = [of("4", t) if people is None else {people: [of("4", t)]} for t in range(FRAMES)]
        motion = read(path, {"fps": 25, key: frames}, rate=None)
        assert is_it(motion, "4") and motion.frame_rate == 25


@pytest.mark.parametrize("ending", [".pkl", ".json"])
@pytest.mark.parametrize("key", [None, "tracks", "people"])
@pytest.mark.parametrize("called", ["track_id", None])
def test_lists_of_people(called: str | None, key: str | None, ending: str, tmp_path: Path) -> None:
    people = []
    for name in POSES:
        pose = padded(POSES[name], 24)
        one = {"poses": pose.tolist() if ending == ".json" else pose, "frame_ids": list(range(FRAMES))}
        people.append(one | ({called: int(name)} if called else {}))
    content = people if key is None else {"fps": 25, key: people}
    for number, name in enumerate(POSES):
        motion = read(tmp_path / f"a{ending}", content, name if called else str(number), 30 if key is None else None)
        assert is_it(motion, name) and motion.frame_rate == (30 if key is None else 25)


def test_a_list_of_somebody_in_one_frame_is_no_track(tmp_path: Path) -> None:
    with pytest.raises(Exception, match="single frame"):
        read(tmp_path / "a.pkl", [{"poses": padded(POSES["4"][:1], 24), "id": 0}])


def clips(frames: int, step: int = 1) -> dict[str, Any]:
    """Clips as NeuralAnnot has them: by action, take and number of the frame."""

    def clip(seed: int, frames: int) -> dict[str, Any]:
        row_TX = padded(made_up(frames, seed), 24)
        return {
            str(step * t): {"pose": row.tolist(), "shape": [0.1] * 10, "trans": [seed, 0.9, t / 50]}
            for t, row in enumerate(row_TX)
        }

    return {"2": {"1": clip(1, frames), "2": clip(2, frames + 3)}, "3": {"1": clip(3, frames)}}


@pytest.mark.parametrize("step", [1, 5])
def test_clips_of_frames_by_numbers(step: int, tmp_path: Path) -> None:
    for person, seed in ((None, 2), ("2/1", 1), ("3/1", 3)):
        motion = read(tmp_path / "a.json", clips(24, step), person)
        place_T3 = motion.arrays.root_position_T3
        assert place_T3 is not None and round(float(place_T3[0, 0])) == seed
        assert len(motion) == 24 + 3 * (seed == 2) and motion.family == "smpl"
    motion = read(tmp_path / "a.json", clips(24, step)["2"], "1")
    assert len(motion) == 24


def test_people_of_different_pictures_are_no_motion(tmp_path: Path) -> None:
    generator = np.random.default_rng(0)
    people = {
        str(n): {"smpl_param": {"pose": generator.normal(0, 1.5, 72).tolist(), "trans": [0, 0, 3]}} for n in range(40)
    }
    with pytest.raises(NoMotion, match="different pictures"):
        read(tmp_path / "a.json", people)


@pytest.mark.parametrize("extra", [{}, {"joints3D": [np.zeros((FRAMES, 24, 3)), np.zeros((FRAMES - 3, 24, 3))]}])
def test_lists_with_an_array_a_clip(extra: dict[str, Any], tmp_path: Path) -> None:
    rows = [padded(POSES["4"], 24), padded(POSES["9"], 24)[:-3]]
    for person, name, frames in ((None, "4", FRAMES), ("1", "9", FRAMES - 3)):
        motion = read(tmp_path / "a.pkl", {"poses": rows, "y": [1, 2], **extra}, person)
        assert is_it(motion, name, list(range(frames)))


def test_what_alphapose_writes(tmp_path: Path) -> None:
    """Points in a picture, and beside them those of HybrIK in space, one a line of the list."""
    rest = REST_K3[:22].astype(np.float64) * [1, -1, -1] / 2.2
    picture = {"category_id": 1, "keypoints": [5.0, 6.0, 0.9] * 17, "score": 2.5}
    rows = [
        {"image_id": f"{t}.jpg", **picture, "pred_xyz_jts": rest.reshape(-1).tolist(), "idx": 1} for t in range(FRAMES)
    ]
    motion = read(tmp_path / "a.json", rows)
    assert len(motion) == FRAMES and "SMPL's body" in motion.source
    root_T33 = motion.arrays.root_rotation_T33
    assert root_T33 is not None and np.allclose(root_T33[:, 1, 1], 1, atol=0.01)
