"""To which rest pose a file's rotations refer."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.body.rest_directions import FAMILIES, to_family
from mrhubo.body.skeleton import POSED_JOINT_NAMES, Skeleton
from mrhubo.fast.rotations import matrix_to_axis_angle
from mrhubo.motion import read_folder, read_motion, read_poses, reshare
from mrhubo.rotation import axis_angle_to_matrix

POSE_T63 = np.random.default_rng(0).normal(0, 0.4, (6, 63))
OWN = {"betas": np.zeros(16), "surface_model_type": np.array("smplx"), "description": np.array("walks")}


def save(path: Path, **content: np.ndarray) -> Path:
    np.savez(path, mocap_frame_rate=np.array(30.0), **content)  # type: ignore[arg-type]
    return path


@pytest.mark.parametrize(
    ("content", "family"),
    [
        ({"surface_model_type": np.array("smplx"), "betas": np.full(16, 0.3)}, "smplx"),
        ({"surface_model_type": np.array("SMPL-X locked head")}, "smplx"),
        ({"surface_model_type": np.array("smplh")}, "smplh"),
        ({"surface_model_type": np.array("SMPL+H")}, "smplh"),
        ({"surface_model_type": np.array("smpl")}, "smpl"),
        ({"pose_hand": np.zeros((6, 90))}, "smplh"),
        ({"pose_hand": np.zeros((6, 90)), "pose_jaw": np.zeros((6, 3))}, "smplx"),
        ({"pose_lhand": np.zeros((6, 15, 3)), "betas": np.full((1, 10), 0.3)}, "smplx"),
        ({"betas": np.full(16, 0.3)}, "smplh"),
        ({"betas": np.zeros(16)}, ""),
        ({"betas": np.full(10, 0.3)}, ""),
        ({"surface_model_type": np.array(["smplx", "smplh"])}, ""),
        ({"surface_model_type": np.array(3.0)}, ""),
        ({}, ""),
        (OWN, ""),
        (OWN | {"betas": np.full(16, 0.3)}, "smplx"),
        (OWN | {"pose_hand": np.zeros((6, 90))}, "smplx"),
        ({key: value for key, value in OWN.items() if key != "description"}, "smplx"),
        (OWN | {"betas": np.full(16, 0.3), "rest_directions": np.array("mrhubo")}, ""),
    ],
)
def test_what_a_file_says(tmp_path: Path, content: dict[str, np.ndarray], family: str) -> None:
    motion = read_motion(save(tmp_path / "a.npz", pose_body=POSE_T63, **content))
    assert motion.family == family
    given = axis_angle_to_matrix(torch.from_numpy(POSE_T63).unflatten(1, (21, 3))).float()
    assert torch.equal(motion.local_TJ33, given) == (not family)
    said = FAMILIES[family].name if family else "T-pose" if "description" not in content else "mrhubo"
    assert said in motion.source


def test_our_motions_refer_to_our_skeleton(root: Path) -> None:
    for motion in read_folder(root / "data" / "motions"):
        assert motion.family == "" and "mrhubo's own skeleton" in motion.source


def test_the_clips_of_the_evaluation_do_too(external_dir: Path) -> None:
    for folder in ("evaluation", "whole_body"):
        assert {motion.family for motion in read_folder(external_dir / "cmu" / folder)} == {""}


def test_with_the_body_model_the_rotations_are_the_files(tmp_path: Path) -> None:
    motion = read_motion(save(tmp_path / "a.npz", poses=np.pad(POSE_T63, ((0, 0), (3, 99)))))
    given = axis_angle_to_matrix(torch.from_numpy(POSE_T63).unflatten(1, (21, 3))).float()
    drooping = Skeleton().offsets_J3.clone()
    drooping[POSED_JOINT_NAMES.index("left_elbow")] = torch.tensor([0.25, -0.07, -0.04])
    found = motion.for_skeleton(Skeleton(drooping))
    torch.testing.assert_close(found.local_TJ33, given, atol=2e-6, rtol=0)
    torch.testing.assert_close(read_poses(motion, skeleton=Skeleton(drooping)).local_TJ33, found.local_TJ33)
    assert "given body model" in found.source and found.for_skeleton(Skeleton(drooping)) is found
    assert motion.for_skeleton(Skeleton()) is motion


def test_a_reshared_motion_in_a_drooping_file_is_read_back(root: Path, tmp_path: Path) -> None:
    motion = reshare(read_motion(root / "data" / "motions" / "wave.npz"), seed=1)
    numbers = matrix_to_axis_angle(to_family(motion.arrays.local_TJ33[::20], "smplx")).reshape(-1, 63)
    again = read_motion(save(tmp_path / "a.npz", poses=np.pad(numbers, ((0, 0), (3, 99)))))
    torch.testing.assert_close(again.local_TJ33, motion.local_TJ33[::20], atol=5e-6, rtol=0)
    assert (
        float((again.local_TJ33 - axis_angle_to_matrix(torch.from_numpy(numbers).unflatten(1, (21, 3)))).abs().max())
        > 0.1
    )


@pytest.mark.parametrize(
    ("name", "betas", "family"),
    [("smplx", 10, "smplx"), ("smplh_params", 10, "smplh"), ("smpl_params", 10, ""), ("person", 16, "smplh")],
)
def test_what_the_dictionary_is_called_and_how_long_the_shape_is(
    tmp_path: Path, name: str, betas: int, family: str
) -> None:
    person = {"body_pose": POSE_T63, "global_orient": np.zeros((6, 3)), "betas": np.full((1, betas), 0.3), "fps": 30}
    with (tmp_path / "a.pkl").open("wb") as file:
        pickle.dump({name: person}, file)
    assert read_motion(tmp_path / "a.pkl").family == family


def test_a_shape_a_frame_is_the_mean_of_them(tmp_path: Path) -> None:
    motion = read_motion(save(tmp_path / "a.npz", pose_body=POSE_T63, betas=np.tile([[0.1], [0.3]], (3, 10))))
    assert motion.betas == pytest.approx([0.2] * 10) and not motion.notes


@pytest.mark.parametrize(
    ("arrays", "family"),
    [
        ({"body_pose": np.zeros((4, 63)), "global_orient": np.zeros((4, 3))}, "smplx"),
        ({"body_pose": np.zeros((4, 63)), "betas": np.full(16, 0.1)}, "smplh"),
        ({"body_pose": np.zeros((4, 69)), "global_orient": np.zeros((4, 3))}, "smpl"),
        ({"smpl_body_pose": np.zeros((4, 63))}, ""),
        ({"poses_body": np.zeros((4, 63))}, ""),
    ],
)
def test_21_joints_by_the_names_of_the_package_smplx_are_those_of_smplx(
    arrays: dict[str, np.ndarray], family: str, tmp_path: Path
) -> None:
    """As most estimators that write them are of it; a note says so."""
    np.savez(tmp_path / "a.npz", fps=30.0, **arrays)
    motion = read_motion(tmp_path / "a.npz")
    assert motion.family == family and any("taken for SMPL-X" in note for note in motion.notes) == (family == "smplx")
