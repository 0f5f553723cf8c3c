"""Folders with a file of SMPL parameters a frame are motions, as those who write them lay them out."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mrhubo import UserError
from mrhubo.body.rest_directions import from_family
from mrhubo.motion import Motion, ReadOptions, read_folder, read_motion
from tests.motion.readers.estimator_files import made_up, matrices, padded

RATE = ReadOptions(rate=30.0)
PELVIS = np.array([0.0, -0.22, 0.03])
People = dict[int, np.ndarray]


def easymocap(folder: Path, people: People, places: People, frames: range, width: int = 72) -> None:
    """The body turns about the model's origin, and pelvises are at the places."""
    for t in frames:
        written = []
        for person, pose in people.items():
            turn = pose[t, :1].astype(float)
            offset = Rotation.from_rotvec(turn[0]).apply(PELVIS if width < 87 else [0.0, -0.35, 0.01])
            row = np.pad(pose[t].reshape(-1), (0, width - 66))
            row[:3] = 0
            written.append(
                {
                    "id": person,
                    "Rh": turn.round(6).tolist(),
                    "Th": [(places[person][t] - offset).round(6).tolist()],
                    "poses": [row.astype(float).round(6).tolist()],
                    "shapes": [[0.5] * 10],
                }
            )
        (folder / f"{t:06}.json").write_text(json.dumps(written, indent=4))


def smplerx(folder: Path, people: People, places: People, frames: range) -> None:
    """A file a person, whose number is now one and now another's."""
    for t in frames:
        for number, person in enumerate(list(people)[:: 1 if t % 2 else -1]):
            pose = people[person]
            content = {
                "global_orient": pose[t, :1],
                "body_pose": pose[t, 1:],
                "left_hand_pose": np.zeros((15, 3)),
                "jaw_pose": np.zeros((1, 3)),
                "betas": np.full((1, 10), 0.5),
                "expression": np.zeros((1, 10)),
                "transl": places[person][t : t + 1],
            }
            np.savez(folder / f"{t + 1:05}_{number}.npz", **content)


def frankmocap(folder: Path, people: People, places: People, frames: range) -> None:
    for t in frames:
        order = list(people)[:: 1 if t % 2 else -1]
        content = {
            "demo_type": "body",
            "smpl_type": "smpl",
            "image_path": f"/video/{t:05}.jpg",
            "body_bbox_list": [np.array([100.0 * places[p][t, 0], 50.0, 60.0, 200.0]) for p in order],
            "pred_output_list": [
                {
                    "pred_body_pose": padded(people[p][t : t + 1], 24),
                    "pred_rotmat": matrices(padded(people[p][t : t + 1], 24).reshape(1, 24, 3)),
                    "pred_betas": np.full((1, 10), 0.5),
                    "pred_camera": np.ones(3),
                }
                for p in order
            ],
        }
        (folder / f"{t:05}_prediction_result.pkl").write_bytes(pickle.dumps(content))


def smplifyx(folder: Path, people: People, places: People, frames: range) -> None:
    """A folder a frame, with a file a person, whose number is now one and now another's."""
    for t in frames:
        inner = folder / f"s001_frame_{t + 1:05}__00.00.00.{33 * t:03}"
        inner.mkdir()
        for number, person in enumerate(list(people)[:: 1 if t % 2 else -1]):
            pose = people[person][t : t + 1]
            content = {
                "camera_translation": np.zeros((1, 3)),
                "betas": np.full((1, 10), 0.5),
                "global_orient": pose[:, 0],
                "body_pose": pose[:, 1:].reshape(1, 63),
                "jaw_pose": np.zeros((1, 3)),
                "left_hand_pose": np.zeros((1, 12)),
                "transl": places[person][t : t + 1],
            }
            (inner / f"{number:03}.pkl").write_bytes(pickle.dumps(content))


WRITERS: dict[str, tuple[Callable[..., None], str, bool]] = {
    "EasyMocap": (easymocap, "smpl", False),
    "SMPL parameters": (smplerx, "smplx", True),
    "FrankMocap": (frankmocap, "smpl", True),
}
"""What writes them, of which model they are, and whether a camera sees the people."""


def written(name: str, folder: Path, people: int, frames: range) -> tuple[Motion, list[np.ndarray], str]:
    """The motion that is read, the poses of the people, and the family."""
    write, family, camera = WRITERS[name]
    poses = {p: made_up(12, seed=p, camera=camera) for p in range(people)}
    places = {
        p: np.stack([np.linspace(0, 1, 12) + 4 * p, np.full(12, 0.9), np.full(12, 3.0)], 1) for p in range(people)
    }
    write(folder, poses, places, frames)
    return read_motion(folder, RATE), list(poses.values()), family


def assert_pose(motion: Motion, pose: np.ndarray, family: str, frames: list[int], atol: float = 1e-5) -> None:
    expected = from_family(matrices(pose)[frames, 1:], family)
    torch.testing.assert_close(
        motion.local_TJ33[torch.tensor(frames) - frames[0]], torch.from_numpy(expected), atol=atol, rtol=0
    )


@pytest.mark.parametrize("name", WRITERS)
def test_the_motion_of_one_person(name: str, tmp_path: Path) -> None:
    motion, (pose,), family = written(name, tmp_path, 1, range(12))
    assert_pose(motion, pose, family, list(range(12)))
    assert motion.family == family and motion.source.startswith(f"{name}, a file a frame")
    assert motion.betas == (0.5,) * 10 and motion.name == tmp_path.name
    if name != "FrankMocap":
        assert motion.root_position_T3 is not None
        way = motion.root_position_T3 - motion.root_position_T3[0]
        torch.testing.assert_close(way[:, 0], torch.linspace(0, 1, 12), atol=1e-5, rtol=0)
        torch.testing.assert_close(way[:, 1:], torch.zeros(12, 2), atol=1e-5, rtol=0)
    assert [found.name for found in read_folder(tmp_path, RATE)] == [tmp_path.name]


@pytest.mark.parametrize("name", WRITERS)
def test_each_of_two_people(name: str, tmp_path: Path) -> None:
    """Whatever place they have in a frame."""
    _, poses, family = written(name, tmp_path, 2, range(12))
    found = [read_motion(tmp_path, ReadOptions(rate=30.0, person=person)) for person in ("0", "1")]
    if name != "EasyMocap":  # they are numbered as they come, and the first frame has the second first
        found = found[::-1]
    for motion, pose in zip(found, poses, strict=True):
        assert_pose(motion, pose, family, list(range(12)))


@pytest.mark.parametrize("name", WRITERS)
def test_gaps_between_files_are_filled_without_confidence(name: str, tmp_path: Path) -> None:
    motion, (pose,), family = written(name, tmp_path, 1, range(12))
    for file in sorted(tmp_path.iterdir())[4:7]:
        file.unlink()
    motion = read_motion(tmp_path, RATE)
    known = [0, 1, 2, 3, 7, 8, 9, 10, 11]
    assert_pose(motion, pose, family, known)
    assert motion.confidence_TJ is not None and len(motion) == 12
    assert motion.confidence_TJ.amax(1).nonzero().flatten().tolist() == known


@pytest.mark.parametrize(("width", "family"), [(78, "smplh"), (87, "smplx")])
def test_poses_of_easymocap_that_end_with_coefficients(width: int, family: str, tmp_path: Path) -> None:
    pose = made_up(12)
    easymocap(tmp_path, {0: pose}, {0: np.tile([1.0, 0.9, 2.0], (12, 1))}, range(12), width)
    motion = read_motion(tmp_path, RATE)
    assert_pose(motion, pose, family, list(range(12)))
    assert motion.root_position_T3 is not None and motion.root_position_T3.std(0).max() < 1e-5


def test_people_whom_nothing_tells_apart_are_refused(tmp_path: Path) -> None:
    written("FrankMocap", tmp_path, 2, range(12))
    for file in tmp_path.iterdir():
        content = pickle.loads(file.read_bytes())
        file.write_bytes(pickle.dumps(content | {"body_bbox_list": []}))
    with pytest.raises(UserError, match="nothing tells who is who"):
        read_motion(tmp_path, RATE)


@pytest.mark.parametrize("name", WRITERS)
def test_a_single_frame_is_refused_with_what_to_do(name: str, tmp_path: Path) -> None:
    written(name, tmp_path, 1, range(12))
    with pytest.raises(UserError, match="single frame; name the folder|has no|no names"):
        read_motion(sorted(tmp_path.iterdir())[0], RATE)


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("content", [b"", b"\x80\x05cos\nsystem\n.", b"{}", b"[[1, 2], 3]", b"PK\x03\x04 and so on"])
def test_a_frame_that_is_none_is_said(name: str, content: bytes, tmp_path: Path) -> None:
    written(name, tmp_path, 1, range(12))
    file = sorted(tmp_path.iterdir())[5]
    file.write_bytes(content)
    with pytest.raises(UserError, match=file.name) as error:
        read_motion(tmp_path, RATE)
    assert "\n" not in str(error.value)


def test_kinds_of_numbers_may_not_change(tmp_path: Path) -> None:
    written("SMPL parameters", tmp_path, 1, range(12))
    file = sorted(tmp_path.iterdir())[5]
    np.savez(file, global_orient=np.eye(3), body_pose=np.tile(np.eye(3), (21, 1, 1)), jaw_pose=np.zeros(3))
    with pytest.raises(UserError, match="in different ways"):
        read_motion(tmp_path, RATE)


def test_nobody_in_any_frame_is_said(tmp_path: Path) -> None:
    for t in range(3):
        (tmp_path / f"{t}.pkl").write_bytes(pickle.dumps({"pred_output_list": [None], "smpl_type": "smpl"}))
    with pytest.raises(UserError, match="nobody is seen in its 3 frames"):
        read_motion(tmp_path, RATE)


def test_motions_of_three_frames_are_no_frames(tmp_path: Path) -> None:
    """Nine numbers of three roots are no matrix, and 189 of three poses are no matrices."""
    for number in range(3):
        np.savez(tmp_path / f"{number}.npz", global_orient=np.zeros((3, 3)), body_pose=np.zeros((3, 63)), fps=30.0)
    assert [len(motion) for motion in read_folder(tmp_path)] == [3, 3, 3]


@pytest.mark.parametrize("people", [1, 2])
def test_folders_of_frames_with_a_file_a_person(people: int, tmp_path: Path) -> None:
    """Two frames are missing, and people are in any order."""
    poses = {p: made_up(12, seed=p) for p in range(people)}
    places = {p: np.tile([4.0 * p, 0.9, 0.0], (12, 1)) for p in poses}
    smplifyx(tmp_path, poses, places, range(4))
    smplifyx(tmp_path, poses, places, range(6, 12))
    known = [t for t in range(12) if t not in (4, 5)]
    for number, person in enumerate(poses):
        asked = ReadOptions(rate=30.0, person=str(people - 1 - number) if people > 1 else None)
        motion = read_motion(tmp_path, asked)
        assert_pose(motion, poses[person], "smplx", known)
        assert motion.confidence_TJ is not None and len(motion) == 12 and motion.root_position_T3 is not None
        assert motion.root_position_T3.std(0).max() < 1e-4
    assert [found.name for found in read_folder(tmp_path, RATE)] == [tmp_path.name]


def test_folders_of_clips_are_no_frames(tmp_path: Path) -> None:
    for clip in ("subject_1", "subject_2"):
        (tmp_path / clip).mkdir()
        np.savez(tmp_path / clip / "walk.npz", poses=padded(made_up(5), 24), fps=30.0)
    with pytest.raises(UserError, match="is a folder"):
        read_motion(tmp_path, RATE)


def test_files_of_whoever_is_in_a_frame(tmp_path: Path) -> None:
    """As Human3R writes them: rows of people without names, and of nobody in the first frame."""
    poses = {p: made_up(24, seed=p, camera=True) for p in (0, 1)}
    for t in range(24):
        here = [p for p in (0, 1)[:: 1 if t % 2 else -1] if t > 2 * p] if t else []
        np.savez(
            tmp_path / f"{t:06}.npz",
            scores=np.ones(len(here)),
            msk=np.array(None),
            shape=np.zeros((len(here), 10)),
            rotvec=np.array([np.pad(poses[p][t], ((0, 31), (0, 0))) for p in here]).reshape(-1, 53, 3),
            transl=np.array([[3.0 * p, 0.0, 5.0] for p in here]).reshape(-1, 3),
        )
    assert_pose(read_motion(tmp_path, RATE), poses[0], "smplx", list(range(1, 24)))
    assert_pose(read_motion(tmp_path, ReadOptions(rate=30.0, person="1")), poses[1], "smplx", list(range(3, 24)))
