"""Names with words of a model, an estimator or a world in them tell what the usual ones do."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mrhubo.body.rest_directions import from_family
from mrhubo.errors import UserError
from mrhubo.motion import Motion, ReadOptions, read_motion
from mrhubo.motion.readers.key_words import model_named, usual_name
from tests.motion.readers.estimator_files import made_up, matrices, padded

RATE = ReadOptions(rate=30)
FRAMES = 6
POSE = made_up(FRAMES)
ROOT, BODY = POSE[:, 0], POSE[:, 1:].reshape(FRAMES, 63)
PLACE = np.linspace((0, 0.9, 0), (1, 0.9, 2), FRAMES).astype(np.float32)
CAMERA = (Rotation.from_euler("x", 170, degrees=True) * Rotation.from_rotvec(ROOT)).as_rotvec().astype(np.float32)


def written(path: Path, **arrays: np.ndarray) -> Motion:
    with path.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]
    return read_motion(path, RATE)


def is_whole(motion: Motion, family: str) -> bool:
    local = from_family(matrices(POSE[:, 1:]), family) if family else matrices(POSE[:, 1:])
    root, place = motion.arrays.root_rotation_T33, motion.arrays.root_position_T3
    assert root is not None and place is not None
    return (
        motion.family == family
        and np.allclose(motion.arrays.local_TJ33, local, atol=1e-5)
        and np.allclose(root, matrices(ROOT), atol=1e-5)
        and np.allclose(np.diff(place, axis=0), np.diff(PLACE, axis=0), atol=1e-5)
    )


@given(
    prefix=st.sampled_from(("smplx_", "SMPLX_", "pred_smplx_", "smplh_", "smpl_", "pred_", "est_")),
    root=st.sampled_from(("global_orient", "root_pose", "root_orient", "globalOrient")),
    place=st.sampled_from(("transl", "trans", "translation")),
    suffix=st.sampled_from(("", "_aa", "_world")),
)
def test_words_of_models_and_estimators_may_be_anywhere(
    prefix: str, root: str, place: str, suffix: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("words") / "clip.npz"
    names = (f"{prefix}body_pose{suffix}", f"{prefix}{root}{suffix}", f"{prefix}{place}")
    motion = written(path, **dict(zip(names, (BODY, ROOT, PLACE), strict=True)))
    assert is_whole(motion, model_named(prefix) if "smpl" in prefix.lower() else "smplx"), names


@given(
    pose=st.sampled_from(
        ("body_pose", "pose_body", "smpl_pose", "poses_body", "pose_aa", "pose", "thetas", "rotations")
    ),
    root=st.sampled_from(("global_orient", "root_orient", "poses_root", "root_rotation", "global_rot", "pose_root")),
    place=st.sampled_from(("transl", "trans", "root_translation", "root_position", "global_transl")),
)
def test_roots_are_read_whatever_the_pose_is_called(
    pose: str, root: str, place: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("roots") / "clip.npz"
    motion = written(path, **{pose: BODY, root: ROOT, place: PLACE})
    assert is_whole(motion, motion.family), (pose, root, place)


def test_what_is_in_the_world_goes_before_what_a_camera_sees(tmp_path: Path) -> None:
    for body in ({"body_pose": BODY}, {"body_pose_cam": BODY, "body_pose_world": BODY}):
        for plain in ("global_orient_cam", "global_orient"):
            arrays = {plain: CAMERA, "trans": PLACE * 0, "global_orient_world": ROOT, "transl_world": PLACE}
            assert is_whole(written(tmp_path / "clip.npz", **body, **arrays), "smplx"), (body.keys(), plain)


def test_own_names_go_before_unusual_ones(tmp_path: Path) -> None:
    arrays = {"body_pose": BODY, "global_orient": ROOT, "transl": PLACE, "cam_trans": PLACE * 0}
    assert is_whole(written(tmp_path / "clip.npz", **arrays, pred_body_pose=BODY * 0), "smplx")


def test_poses_in_the_world_are_of_the_model_that_has_so_many_joints(tmp_path: Path) -> None:
    """BEDLAM calls poses of SMPL-X in the world as WHAM calls those of SMPL."""
    motion = written(tmp_path / "clip.npz", pose_world=padded(POSE, 55), trans_world=PLACE, pose_cam=padded(POSE, 55))
    assert is_whole(motion, "smplx")


def test_names_of_single_frames(tmp_path: Path) -> None:
    for frame in range(FRAMES):
        person = {"smplx_root_pose": ROOT[frame], "smplx_body_pose": BODY[frame], "cam_trans": PLACE[frame]}
        (tmp_path / f"{frame:03}.pkl").write_bytes(pickle.dumps(person))
    assert is_whole(read_motion(tmp_path, RATE), "smplx")


@pytest.mark.parametrize("joints", [22, 24])
@pytest.mark.parametrize("key", ["dof", "dof_pos"])
def test_robots_whose_links_turn_like_as_many_joints_are_no_people(key: str, joints: int, tmp_path: Path) -> None:
    robot = {"pose_aa": padded(POSE, joints), "root_trans_offset": PLACE, key: np.zeros((FRAMES, 19)), "fps": 30}
    for content in (robot, {"0-walk": robot}):
        path = tmp_path / "h1.pkl"
        path.write_bytes(pickle.dumps(content))
        with pytest.raises(UserError, match="a robot's joints"):
            read_motion(path)


@pytest.mark.parametrize("sign", [".", "/"])
def test_dictionaries_in_dictionaries_may_stand_in_names(sign: str, tmp_path: Path) -> None:
    """As GEM's results do in an .npz file: the world goes before the camera, and each has its own root."""
    outer = {"body_params_incam": (CAMERA, PLACE * 0), "body_params_global": (ROOT, PLACE)}
    arrays = {
        f"{name}{sign}{key}": array
        for name, (turn, place) in outer.items()
        for key, array in {"global_orient": turn, "body_pose": BODY, "transl": place}.items()
    }
    assert is_whole(written(tmp_path / "clip.npz", **arrays, K_fullimg=np.eye(3)), "smplx")


def test_words() -> None:
    assert usual_name("smplxBodyPose") == usual_name("pred_body_pose_cam") == "body_pose"
    assert usual_name("pose_6d") == "pose_6d"  # another form of rotations
    assert model_named("results[smplx_params]") == "smplx" and not model_named("smpl_params")
