"""Files of estimators are read as they are written, of whoever is in them, and hostile or damaged ones are refused."""

from __future__ import annotations

import copy
import os
import pickle
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mrhubo.body.joints import REST_K3
from mrhubo.body.rest_directions import from_family
from mrhubo.errors import UserError
from mrhubo.motion import Motion, ReadOptions, read_folder, read_motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.linking import link
from tests.files.test_safe_pickle import attacks
from tests.motion.damage import damaged_by, read_or_refused
from tests.motion.readers.estimator_files import (
    WRITERS,
    cliff,
    hmr2_pictures,
    made_up,
    matrices,
    multi_hmr,
    nlf_batch,
    padded,
    phalp,
    pymaf,
    romp,
    wham,
)

RATE = ReadOptions(rate=30)
FRAMES = 6


def expected(pose: np.ndarray, family: str) -> torch.Tensor:
    local = matrices(pose[:, 1:])
    return torch.from_numpy(from_family(local, family) if family else local)


def close(motion: Motion, pose: np.ndarray, family: str) -> bool:
    return torch.allclose(motion.local_TJ33, expected(pose, family), atol=1e-5)


@pytest.mark.parametrize("name", WRITERS)
def test_what_each_writes_is_read(tmp_path: Path, name: str) -> None:
    writer, pose = WRITERS[name], made_up(FRAMES, camera=WRITERS[name].camera)
    path = tmp_path / f"clip{writer.ending}"
    writer.write(path, {1: pose})
    motion = read_motion(path, RATE)
    assert close(motion, pose, writer.family) and motion.family == writer.family
    assert motion.source.startswith(writer.source) and motion.frame_rate == 30 and motion.name == "clip"
    assert motion.confidence_TJ is None and motion.root_rotation_T33 is not None
    upright = matrices(made_up(FRAMES)[:, 0])  # who is seen by a camera comes out upright, and turns the same way
    if writer.camera:
        upright = np.diag((1.0, -1.0, -1.0)) @ matrices(pose[:, 0])
    np.testing.assert_allclose(motion.root_rotation_T33, upright, atol=1e-5)
    assert (motion.root_position_T3 is None) == (writer.position is None)
    if motion.root_position_T3 is not None:
        assert float(motion.root_position_T3[-1, 0]) == pytest.approx(writer.position)
    if name not in ("phc", "interhuman", "egoallo", "finedance"):
        with pytest.raises(UserError, match="--rate"):
            read_motion(path)


@pytest.mark.parametrize("name", ["gvhmr", "genmo"])
@pytest.mark.parametrize("turn", [[90, 0, 0], [0, 0, 90], [180, 0, 0]])
def test_who_lies_or_stands_on_the_hands_is_not_set_upright(name: str, turn: list[float], tmp_path: Path) -> None:
    """Of estimators whose world has y up, whatever somebody does in it."""
    pose = made_up(FRAMES)
    root = Rotation.from_euler("xyz", turn, degrees=True) * Rotation.from_rotvec(pose[:, 0])
    pose[:, 0] = root.as_rotvec()
    path = tmp_path / "clip.pt"
    WRITERS[name].write(path, {1: pose})
    motion = read_motion(path, RATE)
    assert "y up;" in motion.source and motion.root_rotation_T33 is not None
    np.testing.assert_allclose(motion.root_rotation_T33, root.as_matrix(), atol=1e-5)


def test_people_may_be_the_second_axis(tmp_path: Path) -> None:
    people = [made_up(FRAMES, seed=seed) for seed in range(2)]
    poses = np.stack([padded(pose, 24) for pose in people], axis=1)  # (T, 2, 72)
    places = np.stack([np.ones((FRAMES, 3)), np.zeros((FRAMES, 3))], axis=1)
    np.savez(tmp_path / "a.npz", poses=poses, trans=places, betas=np.eye(2, 10))
    for person, pose in enumerate(people):
        motion = read_motion(tmp_path / "a.npz", ReadOptions(rate=30, person=str(person)))
        assert close(motion, pose, "smpl") and motion.root_position_T3 is not None
        assert float(motion.root_position_T3[0, 0]) == 1 - person
        assert motion.betas is not None and motion.betas[person] == 1


def test_features_of_humanml3d_tell_where_joints_are(tmp_path: Path) -> None:
    """Somebody at rest who walks forward and turns: the first number is half of the turn."""
    rest = REST_K3[:22].astype(np.float64)
    rows = np.zeros((9, 263))
    rows[:, 0], rows[:, 2], rows[:, 3] = 0.05, 0.1, 0.9
    rows[:, 4:67] = (rest[1:] - rest[0] + [0, 0.9, 0]).reshape(63)
    np.save(tmp_path / "walk.npy", rows)
    motion = read_motion(tmp_path / "walk.npy")
    assert motion.frame_rate == 20 and "HumanML3D" in motion.notes[0] and len(motion) == 9
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    turned = Rotation.from_matrix(motion.root_rotation_T33.numpy()).as_rotvec()
    np.testing.assert_allclose(turned[:, 1], -0.1 * np.arange(9), atol=1e-3)
    ways = np.diff(motion.root_position_T3.numpy(), axis=0)
    headings = motion.root_rotation_T33.numpy()[1:, :, 2]
    np.testing.assert_allclose(ways, 0.1 * headings, atol=2e-3)
    np.save(tmp_path / "walk.npy", np.random.default_rng(0).normal(size=(9, 263)))
    with pytest.raises(NoMotion, match="normalised"):
        read_motion(tmp_path / "walk.npy")


FOLLOWED = ("pymaf", "cliff", "multi_hmr", "hmr2_pictures", "nlf_batch")
"""Writers that do not say who is who."""


@pytest.mark.parametrize("name", [name for name, writer in WRITERS.items() if writer.many and name not in FOLLOWED])
def test_who_is_seen_longest_is_taken_and_the_others_by_name(tmp_path: Path, name: str) -> None:
    writer = WRITERS[name]
    lengths = (FRAMES, FRAMES) if name in ("slahmr", "egoallo") else (4, FRAMES)
    people = {n: made_up(length, seed=n, camera=writer.camera) for n, length in enumerate(lengths)}
    path = tmp_path / f"clip{writer.ending}"
    writer.write(path, people)
    taken, others = (0, 1) if name in ("slahmr", "egoallo") else (1, 0)
    names = [f"0-clip_{n}" if name == "phc" else str(n) for n in people]
    motion = read_motion(path, RATE)
    assert close(motion, people[taken], writer.family)
    assert f"'{names[0]}' ({lengths[0]} frames)" in motion.notes[0] and f"'{names[1]}'" in motion.notes[0]
    other = read_motion(path, ReadOptions(rate=30, person=names[others]))
    assert close(other, people[others], writer.family) and not other.notes
    with pytest.raises(
        UserError, match=rf"no person 'Bob'; there are '{names[taken]}' \(6 frames\), '{names[others]}'"
    ):
        read_motion(path, ReadOptions(rate=30, person="Bob"))


def test_trams_camera_beside_puts_the_root_into_the_world(tmp_path: Path) -> None:
    """Who walks along, and a camera that turns beside them, as its first picture saw the world."""
    generator, frames = np.random.default_rng(0), np.arange(FRAMES) + 5
    pose = made_up(FRAMES, camera=True)
    turn = Rotation.from_rotvec(0.2 * generator.standard_normal((FRAMES + 9, 3))).as_matrix()
    place = generator.standard_normal((FRAMES + 9, 3))
    (tmp_path / "hps").mkdir()
    path, camera = tmp_path / "hps" / "hps_track_0.npy", tmp_path / "camera.npy"
    WRITERS["tram"].write(path, {0: pose})
    alone = read_motion(path, RATE)
    assert "no camera.npy lies beside" in alone.notes[-1]

    def save(**content: np.ndarray) -> Motion:
        with camera.open("wb") as file:
            np.save(file, content)  # type: ignore[arg-type]
        return read_motion(path, RATE)

    found = save(pred_cam_R=turn.astype(np.float32), pred_cam_T=place)
    world, up = turn[frames] @ matrices(pose[:, 0]), np.diag((1.0, -1.0, -1.0))
    np.testing.assert_allclose(found.root_rotation_T33, up @ world, atol=1e-5)
    np.testing.assert_allclose(found.root_position_T3, (turn[frames].sum(axis=2) + place[frames]) @ up, atol=1e-5)
    assert torch.equal(found.local_TJ33, alone.local_TJ33) and "in the world" in found.notes[-1]
    for content, why in [
        ({"pred_cam_R": turn[:8], "pred_cam_T": place[:8]}, "has 8 frames, and the person is seen in others"),
        ({"pred_cam_R": 2 * turn, "pred_cam_T": place}, "no rotation"),
        ({"pred_cam_R": turn, "pred_cam_T": np.nan * place}, "NaN"),
        ({"pred_cam_R": turn}, "has no 'pred_cam_R'"),
    ]:
        left = save(**content)
        assert why in left.notes[-1] and torch.equal(left.root_rotation_T33, alone.root_rotation_T33)
    camera.write_bytes(b"no array")
    assert "the camera's way is left out" in read_motion(path, RATE).notes[-1]


def test_frames_in_which_nobody_is_seen_are_filled_in_without_confidence(tmp_path: Path) -> None:
    pose = np.zeros((4, 22, 3), np.float32)
    pose[:, 6] = np.linspace(0, 0.9, 4)[:, None] * (0, 1, 0)
    wham(tmp_path / "a.pkl", {0: pose}, {0: np.array([10, 11, 14, 16])})
    motion = read_motion(tmp_path / "a.pkl", RATE)
    assert len(motion) == 7 and motion.confidence_TJ is not None
    assert motion.confidence_TJ[:, 0].tolist() == [1, 1, 0, 0, 1, 0, 1] and "3 of 7 frames" in motion.notes[0]
    turn = Rotation.from_matrix(motion.local_TJ33[:, 5].double().numpy()).magnitude()
    np.testing.assert_allclose(turn, np.interp(range(7), [0, 1, 4, 6], np.linspace(0, 0.9, 4)), atol=1e-4)
    assert motion.root_position_T3 is not None
    np.testing.assert_allclose(
        motion.root_position_T3[:, 0], np.interp(range(7), [0, 1, 4, 6], [0, 0.1, 0.2, 0.3]), atol=1e-6
    )


def test_frames_that_are_out_of_order_or_twice_there_are_sorted(tmp_path: Path) -> None:
    pose = made_up(4)
    wham(tmp_path / "a.pkl", {0: pose}, {0: np.array([3, 1, 2, 1])})
    motion = read_motion(tmp_path / "a.pkl", RATE)
    assert close(motion, pose[[1, 2, 0]], "smpl") and motion.confidence_TJ is None


@pytest.mark.parametrize("frames", [np.array([0, 1_999_999]), np.array([0, 2**62]), np.array([0, np.nan])])
def test_numbers_of_frames_that_are_none(tmp_path: Path, frames: np.ndarray) -> None:
    wham(tmp_path / "a.pkl", {0: made_up(2)}, {0: frames})
    with pytest.raises(UserError, match="frames"):
        read_motion(tmp_path / "a.pkl", RATE)


def test_old_bodies_of_phalps_tracks_are_passed_over(tmp_path: Path) -> None:
    """A track that is lost for a while repeats its last body, with a `tracked_time` above zero."""
    people = {1: made_up(FRAMES, camera=True)}
    phalp(tmp_path / "a.pkl", people, compress=3)
    content = joblib.load(tmp_path / "a.pkl")
    for t, frame in enumerate(content.values()):
        if t in (2, 3):
            frame["tracked_time"] = [t - 1]
            frame["smpl"][0]["body_pose"] = matrices(np.ones((23, 3)))
    joblib.dump(content, tmp_path / "a.pkl")
    motion = read_motion(tmp_path / "a.pkl", RATE)
    assert motion.confidence_TJ is not None and motion.confidence_TJ[:, 0].tolist() == [1, 1, 0, 0, 1, 1]


@pytest.mark.parametrize(
    ("key", "odd"),
    [
        *(("time", number) for number in (np.nan, np.inf, 10**400, [1, 2])),
        *((key, [number]) for key in ("tid", "tracked_time") for number in (np.nan, np.array([0, 0]), None, 10**400)),
    ],
)
def test_numbers_of_phalps_that_are_none(tmp_path: Path, key: str, odd: object) -> None:
    phalp(tmp_path / "a.pkl", {1: made_up(FRAMES, camera=True)})
    content = joblib.load(tmp_path / "a.pkl")
    next(iter(content.values()))[key] = odd
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(content))
    with pytest.raises(UserError, match=rf"a\.pkl: '.*\[{key}\].*' (is|has|holds) "):
        read_motion(tmp_path / "a.pkl", RATE)


def test_phalps_tracks_are_called_by_whole_numbers(tmp_path: Path) -> None:
    people = {1234567: made_up(FRAMES, camera=True), 1234568: made_up(4, seed=1, camera=True)}
    phalp(tmp_path / "a.pkl", people)
    motion = read_motion(tmp_path / "a.pkl", RATE)
    assert "there are '1234567' (6 frames), '1234568' (4 frames)" in motion.notes[0]
    other = read_motion(tmp_path / "a.pkl", ReadOptions(rate=30, person="1234568"))
    assert close(other, people[1234568], "smpl")


@pytest.mark.parametrize(
    "write", [pymaf, cliff, multi_hmr, hmr2_pictures, nlf_batch, lambda path, people: romp(path, people, tracked=False)]
)
def test_people_whom_a_file_does_not_track_are_followed_by_where_they_are(tmp_path: Path, write) -> None:
    """They come in turns: in the first frame the second person first."""
    people = {0: made_up(FRAMES, camera=True), 1: made_up(4, seed=1, camera=True)}
    family = "smplx" if write in (pymaf, multi_hmr) else "smpl"
    write(tmp_path / "a", people)
    motion = read_motion(tmp_path / "a", RATE)
    assert close(motion, people[0], family) and "does not say who is who" in motion.notes[0]
    assert "'1' (6 frames), '0' (4 frames)" in motion.notes[1]
    assert close(read_motion(tmp_path / "a", ReadOptions(rate=30, person="0")), people[1], family)


def test_who_comes_back_soon_is_the_same_and_later_another() -> None:
    here, away, none = np.zeros((1, 3)), np.full((1, 3), 5.0), np.zeros((0, 3))
    assert link([here, none, here + 0.5, away, here], 1.0) == [[0], [], [0], [1], [0]]
    assert link([here, *[none] * 40, here], 1.0)[-1] == [1]
    assert link([np.stack((here, away))[:, 0], np.stack((away, here))[:, 0]], 1.0) == [[0, 1], [1, 0]]
    assert link([np.full((2, 3), np.nan), np.full((2, 3), np.nan)], 1.0) == [[0, 1], [2, 3]]
    with pytest.raises(UserError, match="101 people"):
        link([np.zeros((101, 3))], 1.0)


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("which", range(8))
def test_hostile_files_run_nothing(tmp_path: Path, name: str, which: int) -> None:
    """What runs when it is unpickled, in the place of each pose."""
    marker = tmp_path / "ran.npy"
    attack = attacks(marker)[which]
    keys = ("pose_world", "body_pose", "smpl_poses", "pose_aa", "poses_body", "smpl_thetas", "pred_rotmat", "pose")
    content = {key: attack for key in keys}
    path = tmp_path / f"clip{WRITERS[name].ending}"
    if path.suffix == ".pt":
        torch.save(content, path)
    elif path.suffix == ".npz":
        np.savez(path.open("wb"), results=content)  # type: ignore[arg-type]
    elif path.suffix == ".npy":
        np.save(path.open("wb"), content)  # type: ignore[arg-type]
    else:
        joblib.dump({1: content}, path)
    with pytest.raises(UserError, match="clip"):
        read_motion(path, RATE)
    assert not marker.exists() and os.listdir(tmp_path) == [path.name]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            {"weights": np.zeros(3), "bias": 1},
            "is a Python pickle of a dictionary with bias, weights, in which there is no human motion",
        ),
        ([1, 2, 3], "is a Python pickle of a list of 3, in which"),
        ({}, "in which there is no human motion"),
        ({"pose": np.zeros((3, 144))}, "of a dictionary with pose"),
        ({"pose_world": np.full((3, 72), np.nan)}, "'pose_world' is not finite in frame 0, number 3"),
        ({"smpl_poses": np.full((60, 72), 5.0)}, r"'smpl_poses' is no axis-angle in radians \(degrees\?\)"),
        ({"pred_rotmat": np.zeros((3, 24, 3, 3))}, "'pred_rotmat' is no rotation matrix in frame 0, joint 1"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, content: object, said: str) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(content))
    with pytest.raises(UserError, match=said) as caught:
        read_motion(tmp_path / "a.pkl", RATE)
    assert str(caught.value).startswith(str(tmp_path / "a.pkl"))


@pytest.mark.parametrize("protocol", range(6))
def test_pickles_of_any_age(tmp_path: Path, protocol: int) -> None:
    pose = made_up(FRAMES)
    (tmp_path / "a").write_bytes(pickle.dumps({"smpl_poses": padded(pose, 24)}, protocol))
    assert close(read_motion(tmp_path / "a", RATE), pose, "smpl")


def test_a_folder_passes_over_pickles_that_hold_no_motion(tmp_path: Path) -> None:
    wham(tmp_path / "wham_output.pkl", {0: made_up(3)})
    joblib.dump({0: {"bbox": np.zeros((3, 4))}}, tmp_path / "tracking_results.pth")
    np.save(tmp_path / "camera.npy", np.zeros((3, 7)))
    assert [motion.name for motion in read_folder(tmp_path, RATE)] == ["wham_output"]
    (tmp_path / "wham_output.pkl").unlink()
    with pytest.raises(NoMotion, match="camera"):
        read_folder(tmp_path, RATE)


FILES: dict[str, bytes] = {}


def good_file(name: str, folder: Path) -> bytes:
    if name not in FILES:
        path = folder / "good"
        WRITERS[name].write(path, {1: made_up(4, camera=WRITERS[name].camera)})
        FILES[name] = path.read_bytes()
    return FILES[name]


@pytest.mark.parametrize("name", WRITERS)
@settings(max_examples=10)
@given(data=st.data())
def test_damaged_files_are_read_or_refused_by_name(
    tmp_path_factory: pytest.TempPathFactory, name: str, data: st.DataObject
) -> None:
    folder = Path(os.fspath(tmp_path_factory.getbasetemp()))
    path = folder / "damaged"
    seed = data.draw(st.integers(0, 2**32))
    path.write_bytes(damaged_by(seed, good_file(name, folder), good_file("wham", folder)))
    read_or_refused(path)


ODD = [None, np.nan, -1, "x", 10**400, True, [], {}, [1, [2, 3]], [None], np.zeros(0), np.zeros((0, 72)), np.array(3.0),
       np.zeros((2, 2, 2)), np.zeros(4, complex), np.full((4, 72), np.nan)]  # fmt: skip
"""What may stand where something else is expected."""


def entries_of(value: Any) -> list[tuple[Any, Any]]:
    """All places in dictionaries and lists, each as what it is in and its key."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [place for key, child in pairs for place in ((value, key), *entries_of(child))]


@pytest.mark.parametrize(
    "name", [name for name, writer in WRITERS.items() if writer.ending in (".pkl", ".pk") or name in ("tram", "mdm")]
)
def test_odd_values_anywhere_are_read_or_refused_by_name(tmp_path: Path, name: str) -> None:
    WRITERS[name].write(tmp_path / "good", {1: made_up(3, camera=WRITERS[name].camera)})
    good = (
        np.load(tmp_path / "good", allow_pickle=True).item()
        if name in ("tram", "mdm")
        else joblib.load(tmp_path / "good")
    )
    generator = np.random.default_rng(0)
    for _ in range(25):
        content = copy.deepcopy(good)
        places = entries_of(content)
        inside, key = places[generator.integers(len(places))]
        inside[key] = ODD[generator.integers(len(ODD))]
        (tmp_path / "odd").write_bytes(pickle.dumps(content))
        read_or_refused(tmp_path / "odd")
