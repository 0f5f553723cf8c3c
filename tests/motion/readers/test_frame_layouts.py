"""Files that go frame by frame under names of pictures: their numbers are those of the frames."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from pathlib import Path

import joblib
import numpy as np
import pytest
import torch

import mrhubo.rotation
from mrhubo import UserError
from mrhubo.body.rest_directions import from_family
from mrhubo.motion.load import read_motion
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.readers.estimator_files import made_up, matrices, padded

FRAMES = 9

RATE = ReadOptions(rate=30.0)
NUMBERS = [*range(3), *range(43, 46)]


def romp(path: Path, pose: np.ndarray, place_T3: np.ndarray, names: list[str]) -> None:
    rows = padded(pose, 24)
    frames = {name: {"smpl_thetas": rows[t : t + 1], "cam_trans": place_T3[t : t + 1]} for t, name in enumerate(names)}
    with path.open("wb") as file:
        np.savez(file, results=frames)  # type: ignore[arg-type]


def phalp(path: Path, pose: np.ndarray, _: np.ndarray, names: list[str], times: Sequence[int] = ()) -> None:
    turned = matrices(padded(pose, 24).reshape(len(pose), 24, 3))
    bodies = [{"global_orient": turn[:1], "body_pose": turn[1:], "betas": np.zeros(10)} for turn in turned]
    frames = {name: {"tid": [1], "tracked_time": [0], "smpl": [body]} for name, body in zip(names, bodies, strict=True)}
    for number, frame in zip(times, frames.values(), strict=False):
        frame["time"] = number
    path.write_bytes(pickle.dumps(frames))


def sam3d(path: Path, _: np.ndarray, place_T3: np.ndarray, names: list[str]) -> None:
    points = np.random.default_rng(0).normal(size=(70, 3))
    points[[5, 6], 1] -= 9  # shoulders above hips, as a camera sees them
    answers = {name: [{"pred_keypoints_3d": points + place}] for name, place in zip(names, place_T3, strict=True)}
    joblib.dump(answers, path)


def read(write, tmp_path: Path, names: list[str], order: list[int]) -> Motion:
    """Of six frames in some order, in which somebody goes a metre each along x."""
    place_T3 = np.arange(6.0)[:, None] * [1, 0, 0]
    write(tmp_path / "a", made_up(6, camera=True)[order], place_T3[order], names)
    return read_motion(tmp_path / "a", RATE)


@pytest.mark.parametrize("write", [romp, phalp, sam3d])
@pytest.mark.parametrize("form", ["{:08d}.jpg", "outputs/_DEMO/v2/img/{}.jpg"])
def test_gaps_between_names_of_pictures_are_filled_without_confidence(write, form: str, tmp_path: Path) -> None:
    """Whatever order a dictionary has."""
    order = [5, 3, 0, 1, 4, 2]
    motion = read(write, tmp_path, [form.format(120 + 2 * NUMBERS[place]) for place in order], order)
    whole = read(write, tmp_path, [form.format(number) for number in range(6)], list(range(6)))
    known = torch.tensor(NUMBERS)
    assert len(motion) == 46 and motion.confidence_TJ is not None
    assert torch.equal(motion.confidence_TJ.amax(1).nonzero().flatten(), known)
    for found, expected in (
        (motion.local_TJ33, whole.local_TJ33),
        (motion.root_rotation_T33, whole.root_rotation_T33),
        (motion.root_position_T3, whole.root_position_T3),
    ):
        if found is not None and expected is not None:
            torch.testing.assert_close(found[known], expected, atol=1e-5, rtol=0)
    if write is not phalp:
        assert motion.root_position_T3 is not None
        step_T = motion.root_position_T3.diff(dim=0)[:, 0]
        torch.testing.assert_close(step_T[:2], torch.ones(2), atol=1e-4, rtol=0)
        torch.testing.assert_close(step_T[2:43], torch.full((41,), 1 / 41), atol=1e-4, rtol=0)


def test_times_of_phalp_go_before_names(tmp_path: Path) -> None:
    pose, names = made_up(6, camera=True), [f"{number}.jpg" for number in range(6)]
    phalp(tmp_path / "a", pose, pose, names, NUMBERS)
    assert len(read_motion(tmp_path / "a", RATE)) == 46
    phalp(tmp_path / "a", pose, pose, names, NUMBERS[:5])  # the last frame has none
    assert len(read_motion(tmp_path / "a", RATE)) == 6


@pytest.mark.parametrize("write", [romp, phalp, sam3d])
def test_numbers_of_pictures_ask_for_no_memory(write, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="frames"):
        read(write, tmp_path, [f"{number}.jpg" for number in (0, 1, 2, 10**9, 10**9 + 1, 10**17)], list(range(6)))


def test_rows_go_by_the_numbers_of_their_frames(tmp_path: Path) -> None:
    """Of two people, in rows without order; whoever is away for forty frames is another afterwards."""
    for away, people in ((9, 2), (40, 4)):
        frame_N, person_N = np.meshgrid([*range(5), *range(4 + away, 9 + away)], range(2))
        order = np.random.default_rng(0).permutation(20)
        frame_N, person_N = frame_N.ravel()[order], person_N.ravel()[order]
        corner_N2 = np.stack([900.0 * person_N, np.full(20, 100.0)], axis=1)
        pose = np.zeros((20, 72), np.float32)
        pose[:, 5] = 0.01 * frame_N + person_N
        detections = np.column_stack([frame_N, corner_N2, corner_N2 + [100, 300]])
        np.savez(tmp_path / "a.npz", pose=pose, shape=np.zeros((20, 10)), detection_all=detections)
        motion = read_motion(tmp_path / "a.npz", RATE)
        assert motion.notes[1].count(" frames)") == people
        turn_T = torch.rad2deg(mrhubo.rotation.matrix_to_axis_angle(motion.local_TJ33[:, 0]).norm(dim=-1))
        torch.testing.assert_close(turn_T.diff(), torch.full((len(motion) - 1,), 0.573), atol=1e-2, rtol=0)


def test_phalp_may_see_nobody_in_the_first_frames(tmp_path: Path) -> None:
    """Its tracks are confirmed after some frames."""
    phalp(path := tmp_path / "a.pkl", made_up(6), np.zeros((6, 3)), [f"{number:06}.jpg" for number in range(6)])
    frames = pickle.loads(path.read_bytes())
    nobody = {"tid": [], "tracked_time": [], "smpl": []}
    path.write_bytes(
        pickle.dumps({"000000.jpg": nobody, **{f"{k + 1:06}.jpg": f for k, f in enumerate(frames.values())}})
    )
    assert len(read_motion(path, RATE)) in (6, 7)


@pytest.mark.parametrize("called", [("1", "2"), ("anna", "ben"), (7,), (1, 2)])
@pytest.mark.parametrize("deeper", [False, True])
def test_frames_that_have_people_by_name(called: tuple, deeper: bool, tmp_path: Path) -> None:
    poses = {name: made_up(FRAMES, seed=seed) for seed, name in enumerate(called)}
    frames = []
    for t in range(FRAMES):
        people = {}
        for name, pose in poses.items():
            one = {"global_orient": pose[t, 0], "body_pose": pose[t, 1:].reshape(63), "betas": np.zeros(10)}
            people[name] = {"smplx_params": one, "bbox": np.zeros(4)} if deeper else one
        frames.append(people)
    for content in (frames, {f"{t:06}.jpg": people for t, people in enumerate(frames)}):
        (tmp_path / "a.pkl").write_bytes(pickle.dumps(content))
        for name, pose in poses.items():
            motion = read_motion(tmp_path / "a.pkl", ReadOptions(rate=30, person=str(name)))
            np.testing.assert_allclose(motion.arrays.local_TJ33, from_family(matrices(pose[:, 1:]), "smplx"), atol=1e-5)


def test_one_body_in_two_models_or_worlds_is_one(tmp_path: Path) -> None:
    pose = made_up(FRAMES)
    for names in (("smpl_params", "smplx_params"), ("params_incam", "params_global")):
        frames = [
            {name: {"global_orient": pose[t, 0], "body_pose": pose[t, 1:].reshape(63)} for name in names}
            for t in range(FRAMES)
        ]
        (tmp_path / "a.pkl").write_bytes(pickle.dumps(frames))
        motion = read_motion(tmp_path / "a.pkl", ReadOptions(rate=30))
        assert len(motion) == FRAMES and not any("there are" in note for note in motion.notes)
