"""Skeletons of other names: SOMA's (Kimodo, GEM-X, SOMA-X), and the points of SAM 3D Body; and arrays of bare rows.

The files are made of poses of our own skeleton, which have to come back.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mrhubo.body.rest_directions import from_family
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, SIDES, Skeleton
from mrhubo.errors import UserError
from mrhubo.motion import Motion, ReadOptions, read_motion
from mrhubo.motion.orientations import rest_points
from mrhubo.motion.readers.sam3d import _PLACES
from mrhubo.motion.readers.soma import _ALL, _FEW_FINGERS, _OURS, _names
from tests.motion.damage import damaged_by, read_or_refused
from tests.motion.readers.estimator_files import made_up, matrices, padded

RATE = ReadOptions(rate=30)
FRAMES = 5
POSE = made_up(FRAMES)
LOCAL = torch.from_numpy(matrices(POSE[:, 1:]))
ROOT = torch.from_numpy(matrices(POSE[:, 0]))
THIRTY = _names(_FEW_FINGERS, ("Jaw", "LeftEye", "RightEye"), ())


def world_points(local_TJ33: torch.Tensor) -> dict[str, np.ndarray]:
    """Points (T, 3) of our skeleton in the world, the pelvis at a place of its own, by name."""
    points, rotation = Skeleton().keypoints_and_rotations(local_TJ33)
    head = rotation[:, JOINT_NAMES.index("head")]
    found = dict(zip(KEYPOINT_NAMES, points.unbind(1), strict=True))
    rest = rest_points()
    for name in ("nose", "left_ear", "right_ear"):
        found[name] = found["head"] + head @ torch.from_numpy(rest[name] - rest["head"])[0].float()
    place = torch.tensor([1.0, 0.9, -2.0])
    return {name: ((ROOT @ p[..., None])[..., 0] + place).numpy() for name, p in found.items()}


def soma_rows(names: tuple[str, ...]) -> np.ndarray:
    """Local rotations (T, K, 3) of SOMA's joints, axis-angle; the neck's is at its second joint."""
    rows = np.zeros((FRAMES, len(names), 3))
    for joint, name in _OURS.items():
        rows[:, names.index(name)] = POSE[:, JOINT_NAMES.index(joint)]
    return rows


def kimodo(path: Path, names: tuple[str, ...] = _ALL, bent: bool = False) -> None:
    points, places = world_points(LOCAL), np.zeros((FRAMES, len(names), 3))
    for joint, name in _OURS.items():
        places[:, names.index(name)] = points[joint]
    if bent:
        places[:, names.index("LeftHand")] = places[:, names.index("LeftForeArm")] + (0.0, 0.26, 0.0)
    content = {
        "local_rot_mats": matrices(soma_rows(names)),
        "global_rot_mats": np.zeros((FRAMES, len(names), 3, 3)),
        "posed_joints": places,
        "root_positions": places[:, 0],
        "foot_contacts": np.zeros((FRAMES, 4)),
    }
    with path.open("wb") as file:
        np.savez(file, **content)


def gem(path: Path) -> None:
    rows = torch.from_numpy(soma_rows(_ALL)).float()
    params = {
        "body_pose": rows[:, 1:].flatten(1),
        "global_orient": rows[:, 0],
        "identity_coeffs": torch.zeros(FRAMES, 45),
        "scale_params": torch.zeros(FRAMES, 69),
        "transl": torch.tensor([1.0, 0.9, -2.0]).expand(FRAMES, 3).clone(),
    }
    incam = params | {"global_orient": torch.zeros(FRAMES, 3)}
    torch.save({"body_params_incam": incam, "body_params_global": params, "K_fullimg": torch.eye(3)}, path)


def soma_x(path: Path, **more: Any) -> None:
    content = {
        "poses": soma_rows(_ALL),
        "transl": np.tile((100.0, 90.0, -200.0), (FRAMES, 1)),
        "joint_names": np.array(_ALL),
        "identity_model_type": np.array("soma"),
        "identity_coeffs": np.zeros((1, 128)),
        "rotation_repr": np.array("rotvec"),
        "absolute_pose": np.array(False),
        "unit": np.array("centimeters"),
    }
    with path.open("wb") as file:
        np.savez(file, **(content | more))


@pytest.mark.parametrize(
    ("write", "source"),
    [
        (kimodo, "Kimodo"),
        (lambda path: kimodo(path, THIRTY), "Kimodo"),
        (gem, "GEM-X"),
        (soma_x, "SOMA-X"),
        (lambda path: soma_x(path, poses=matrices(soma_rows(_ALL))), "SOMA-X"),
    ],
)
def test_poses_of_somas_skeleton_come_back(tmp_path: Path, write: Callable[[Path], None], source: str) -> None:
    write(tmp_path / "clip")
    motion = read_motion(tmp_path / "clip", RATE)
    assert torch.allclose(motion.local_TJ33, LOCAL, atol=2e-5) and motion.source.startswith(source)
    assert motion.root_rotation_T33 is not None and torch.allclose(motion.root_rotation_T33, ROOT, atol=1e-5)
    assert motion.root_position_T3 is not None
    np.testing.assert_allclose(motion.root_position_T3, np.tile((1.0, 0.9, -2.0), (FRAMES, 1)), atol=1e-5)
    assert motion.family == "" and not motion.notes
    with pytest.raises(UserError, match="--rate"):
        read_motion(tmp_path / "clip")


def test_limbs_point_as_the_places_of_joints_say(tmp_path: Path) -> None:
    kimodo(tmp_path / "clip.npz", bent=True)
    motion = read_motion(tmp_path / "clip.npz", RATE)
    points = Skeleton().keypoints(motion.local_TJ33)
    forearm = points[:, JOINT_NAMES.index("left_wrist")] - points[:, JOINT_NAMES.index("left_elbow")]
    up = torch.tensor([0.0, 1.0, 0.0]).expand(FRAMES, 3)
    assert motion.root_rotation_T33 is not None
    np.testing.assert_allclose((motion.root_rotation_T33 @ forearm[..., None])[..., 0] / 0.26, up, atol=1e-5)


def test_smplx_skeleton_of_kimodo(tmp_path: Path) -> None:
    np.savez(tmp_path / "clip.npz", local_rot_mats=matrices(POSE), root_positions=np.zeros((FRAMES, 3)))
    motion = read_motion(tmp_path / "clip.npz", RATE)
    assert motion.family == "smplx" and np.allclose(
        motion.arrays.local_TJ33, from_family(LOCAL.numpy(), "smplx"), atol=1e-5
    )


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"absolute_pose": np.array(True)}, "its rotations are absolute"),
        ({"joint_names": np.array([name.replace("LeftArm", "L") for name in _ALL])}, "has no joint LeftArm"),
        ({"poses": np.full((FRAMES, 77, 3), np.nan)}, "'poses' holds NaN"),
    ],
)
def test_what_is_no_motion_of_somas_skeleton_is_refused(tmp_path: Path, more: dict[str, np.ndarray], said: str) -> None:
    soma_x(tmp_path / "clip.npz", **more)
    with pytest.raises(UserError, match=said):
        read_motion(tmp_path / "clip.npz", RATE)


MHR70 = {
    "nose": 0, "left_eye": 1, "right_ear": 4, "left_shoulder": 5, "right_elbow": 8, "left_hip": 9, "right_knee": 12,
    "left_ankle": 13, "left_heel": 17, "right_heel": 20, "right_thumb": 24, "right_index": 28, "right_middle": 32,
    "right_pinky": 40, "right_wrist": 41, "left_thumb": 45, "left_index": 49, "left_middle": 53, "left_pinky": 61,
    "left_wrist": 62, "neck": 69,
}  # fmt: skip
OLECRANON, CUBITAL_FOSSA = {"left": 63, "right": 64}, {"left": 65, "right": 66}
"""As sam_3d_body/metadata/mhr70.py counts them."""


def test_names_have_their_places() -> None:
    assert {name: _PLACES[name] for name in MHR70} == {name: (place,) for name, place in MHR70.items()}
    assert _PLACES["left_toe"] == (15, 16) and _PLACES["right_toe"] == (18, 19)
    places = {"LeftShoulder": 11, "LeftHand": 14, "RightShoulder": 39, "RightArm": 40, "LeftLeg": 67, "RightToeEnd": 76}
    assert len(_ALL) == 77 and {name: _ALL.index(name) for name in places} == places
    places = {"Head": 6, "LeftShoulder": 10, "LeftHandMiddleEnd": 15, "RightArm": 17, "LeftLeg": 22, "RightToeBase": 29}
    assert len(THIRTY) == 30 and {name: THIRTY.index(name) for name in places} == places


def seventy_points(local_TJ33: torch.Tensor) -> np.ndarray:
    """SAM 3D Body's points (T, 70, 3) as a camera sees them, y down, about the pelvis."""
    ours, rotation = world_points(local_TJ33), Skeleton().global_rotations(local_TJ33)
    points = np.zeros((FRAMES, 70, 3))
    for name, places in _PLACES.items():
        points[:, list(places)] = ours[name][:, None]
    for side in SIDES:
        forward = ROOT @ rotation[:, JOINT_NAMES.index(f"{side}_shoulder")] @ torch.tensor([0.0, 0.0, 0.03])
        points[:, OLECRANON[side]] = ours[f"{side}_elbow"] - forward.numpy()
        points[:, CUBITAL_FOSSA[side]] = ours[f"{side}_elbow"] + forward.numpy()
    return (points - ours["pelvis"][:, None]) * (1, -1, -1)


def bent_arms() -> torch.Tensor:
    """Poses (T, 21, 3, 3) of a body whose limbs are hinges: what points cannot tell is as a body has it."""
    pose = np.zeros((FRAMES, 22, 3))
    turns = np.linspace(0.1, 0.9, FRAMES)
    for side, sign in (("left", 1), ("right", -1)):
        pose[:, JOINT_NAMES.index(f"{side}_shoulder")] = np.stack((0.5 * turns, sign * -turns, sign * -0.7 * turns), -1)
        pose[:, JOINT_NAMES.index(f"{side}_elbow"), 1] = -sign * 1.5 * turns
        pose[:, JOINT_NAMES.index(f"{side}_knee"), 0] = turns
    pose[-1, [JOINT_NAMES.index(f"{side}_elbow") for side in SIDES]] = 0  # straight arms
    pose[:, JOINT_NAMES.index("right_elbow")] = 0
    return torch.from_numpy(matrices(pose[:, 1:]))


def check_points(motion: Motion) -> None:
    found, _ = Skeleton().keypoints_and_rotations(motion.local_TJ33)
    rotation, expected = Skeleton().global_rotations(motion.local_TJ33), Skeleton().global_rotations(bent_arms())
    given = Skeleton().keypoints(bent_arms())
    for side in SIDES:
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle")):
            names = [KEYPOINT_NAMES.index(f"{side}_{name}") for name in (start, end)]
            limbs = [p[:, names[1]] - p[:, names[0]] for p in (found, given)]
            torch.testing.assert_close(*limbs, atol=2e-4, rtol=0)
        for joint in ("shoulder", "elbow", "wrist"):  # straight or bent, the elbow's two sides tell its turn
            place = JOINT_NAMES.index(f"{side}_{joint}")
            torch.testing.assert_close(rotation[:, place], expected[:, place], atol=1e-3, rtol=0)
    assert motion.root_rotation_T33 is not None
    torch.testing.assert_close(motion.root_rotation_T33, ROOT, atol=1e-3, rtol=0)


def test_points_of_sam_3d_body(tmp_path: Path) -> None:
    points, place = seventy_points(bent_arms()), np.tile((0.2, 0.1, 3.0), (FRAMES, 1))
    np.savez(
        tmp_path / "clip.npz",
        pred_keypoints_3d=points,
        pred_cam_t=place,
        pred_global_rots=np.zeros((FRAMES, 127, 3, 3)),
    )
    motion = read_motion(tmp_path / "clip.npz", RATE)
    check_points(motion)
    assert motion.source.startswith("SAM 3D Body") and "y down" in motion.source


def test_answers_of_sam_3d_body_in_lists(tmp_path: Path) -> None:
    """Of two people, the second is seen in every other frame, and comes first there."""
    points = seventy_points(bent_arms()).astype(np.float32)
    answers = [
        ([{"pred_keypoints_3d": p + 1, "pred_cam_t": np.full(3, 4.0)}] if t % 2 else [])
        + [{"pred_keypoints_3d": p, "pred_cam_t": np.zeros(3), "mask": None}]
        for t, p in enumerate(points)
    ]
    joblib.dump(answers, tmp_path / "clip.pkl", compress=3)
    motion = read_motion(tmp_path / "clip.pkl", RATE)
    check_points(motion)
    assert "'0' (5 frames), '1' (2 frames)" in motion.notes[1]
    other = read_motion(tmp_path / "clip.pkl", ReadOptions(rate=30, person="1"))
    assert other.confidence_TJ is not None and other.confidence_TJ[:, 0].tolist() == [0, 1, 0, 1, 0]


@pytest.mark.parametrize("bad", [np.full((FRAMES, 70, 3), np.nan), np.full((FRAMES, 70, 3), np.inf)])
def test_points_that_are_none(tmp_path: Path, bad: np.ndarray) -> None:
    np.savez(tmp_path / "clip.npz", pred_keypoints_3d=bad)
    with pytest.raises(UserError, match=r"clip\.npz: .*pred_keypoints_3d"):
        read_motion(tmp_path / "clip.npz", RATE)


def motion_x(pose: np.ndarray) -> np.ndarray:
    rows = np.zeros((len(pose), 322), np.float32)
    rows[:, :66], rows[:, 309:312], rows[:, 312:] = pose.reshape(len(pose), 66), (1, 2, 3), 0.1
    return rows


def test_rows_of_motion_x(tmp_path: Path) -> None:
    np.save(tmp_path / "000001.npy", motion_x(POSE))
    motion = read_motion(tmp_path / "000001.npy")
    assert motion.frame_rate == 30.0 and "Motion-X says" in motion.notes[0]
    assert read_motion(tmp_path / "000001.npy", ReadOptions(rate=20)).frame_rate == 20.0
    assert motion.family == "smplx" and np.allclose(
        motion.arrays.local_TJ33, from_family(LOCAL.numpy(), "smplx"), atol=1e-5
    )
    assert motion.root_rotation_T33 is not None and torch.allclose(motion.root_rotation_T33, ROOT, atol=1e-5)
    assert motion.root_position_T3 is not None and motion.root_position_T3[0].tolist() == [1, 2, 3]
    assert motion.betas == pytest.approx((0.1,) * 10)


@pytest.mark.parametrize("width", [69, 73, 79])
def test_rows_of_phuma(tmp_path: Path, width: int) -> None:
    rows = np.concatenate((np.ones((FRAMES, 3)), POSE.reshape(FRAMES, 66), np.full((FRAMES, width - 69), 0.5)), axis=1)
    np.save(tmp_path / "kick.npy", rows)
    with pytest.raises(UserError, match="--rate"):
        read_motion(tmp_path / "kick.npy")
    motion = read_motion(tmp_path / "kick.npy", RATE)
    assert motion.family == "smplx" and np.allclose(
        motion.arrays.local_TJ33, from_family(LOCAL.numpy(), "smplx"), atol=1e-5
    )
    assert motion.root_position_T3 is not None and motion.root_position_T3[0].tolist() == [1, 1, 1]
    assert (motion.betas is not None) == (width == 79)


@pytest.mark.parametrize("shape", [(5, 66), (5, 72), (5, 156), (0, 69), (69,), (2, 5, 69), (5, 22, 3, 3)])
def test_bare_arrays_that_could_be_anything_are_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    np.save(tmp_path / "a.npy", np.zeros(shape))
    with pytest.raises(UserError, match=r"a\.npy: is a single NumPy array .*expected"):
        read_motion(tmp_path / "a.npy", RATE)


WRITERS: dict[str, Callable[[Path], Any]] = {
    "kimodo": kimodo,
    "gem": gem,
    "soma_x": soma_x,
    "sam3d": lambda path: path.write_bytes(pickle.dumps([[{"pred_keypoints_3d": p}] for p in seventy_points(LOCAL)])),
    "sam3d_npz": lambda path: np.savez(path.open("wb"), pred_keypoints_3d=seventy_points(LOCAL)),
    "motion_x": lambda path: np.save(path.open("wb"), motion_x(POSE)),
    "phuma": lambda path: np.save(path.open("wb"), padded(POSE, 23)),
}


@pytest.mark.parametrize("name", WRITERS)
def test_damaged_files_are_read_or_refused_by_name(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / "good")
    soma_x(tmp_path / "other")
    for seed in range(15):
        good, other = (tmp_path / "good").read_bytes(), (tmp_path / "other").read_bytes()
        (tmp_path / "damaged").write_bytes(damaged_by(seed, good, other))
        read_or_refused(tmp_path / "damaged")
    assert Rotation.from_matrix(LOCAL[0].numpy()).magnitude().max() > 0.1  # the good file is of somebody who moves
