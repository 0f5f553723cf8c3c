"""Motions of simulators' characters: limbs point, and trunk, head and feet are turned, as their own skeletons' do."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import mrhubo
from mrhubo import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix, matrix_to_axis_angle
from mrhubo.motion import read_folder
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.readers.simulated_files import (
    FRAMES,
    Figure,
    humanoid,
    mimickit,
    moves,
    packed_protomotions,
    pose,
    poselib,
    protomotions,
    smpl,
    write_mimickit,
    write_poselib,
    write_protomotions,
)
from tests.motion.readers.test_deepmimic import ours

TO_OURS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
T_POSE, HANGING = humanoid((0, 1, 0)), humanoid((0, 0, -1))
OF_HUMANOID = {
    "shoulder": "{0}_upper_arm", "elbow": "{0}_lower_arm", "wrist": "{0}_hand",
    "hip": "{0}_thigh", "knee": "{0}_shin", "ankle": "{0}_foot",
}  # fmt: skip
OF_SMPL = {
    "shoulder": "{1}_Shoulder", "elbow": "{1}_Elbow", "wrist": "{1}_Wrist",
    "hip": "{1}_Hip", "knee": "{1}_Knee", "ankle": "{1}_Ankle",
}  # fmt: skip
LIMBS = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))


def limb_angles(motion: mrhubo.Motion, figure: Figure, seed: int = 0) -> np.ndarray:
    """Between limbs and the figure's own (T, 8) [rad]; the world may be turned about what is up."""
    names = OF_SMPL if "Pelvis" in figure.names else OF_HUMANOID
    turn_TN3, root_T3 = moves(figure, seed, len(motion))
    places, turns = pose(figure, turn_TN3, root_T3)
    mine, mine_turned = ours(motion)
    angles = []
    for side in ("left", "right"):
        for start, end in LIMBS:
            theirs = [names[joint].format(side, side[0].upper()) for joint in (start, end)]
            true_T3 = (places[theirs[1]] - places[theirs[0]])[:, None] @ turns[:, 0] @ TO_OURS.T
            limb_T3 = (mine[f"{side}_{end}"] - mine[f"{side}_{start}"])[:, None] @ mine_turned["pelvis"]
            cosine_T = (true_T3 * limb_T3).sum((1, 2)) / np.linalg.norm(true_T3, axis=(1, 2))
            angles.append(np.arccos(np.clip(cosine_T / np.linalg.norm(limb_T3, axis=(1, 2)), -1, 1)))
    return np.stack(angles, axis=1)


def save(value: Any, path: Path) -> Path:
    """As NumPy, PyTorch and pickle keep dictionaries."""
    if path.suffix == ".npy":
        np.save(path, value, allow_pickle=True)
    elif path.suffix == ".pkl":
        path.write_bytes(pickle.dumps(value))
    else:
        torch.save(value, path)
    return path


def in_other_order(figure: Figure) -> Figure:
    """The same, with nonsense for names and some children before their parents."""
    order = [0, *reversed(range(1, len(figure.names)))]
    number = {place: i for i, place in enumerate(order)}
    parents = tuple(number.get(figure.parents[place], -1) for place in order)
    return Figure(tuple(f"joint {place}" for place in order), parents, figure.offset_N3[order])


@pytest.mark.parametrize("is_local", [True, False])
@pytest.mark.parametrize("figure", [T_POSE, HANGING, smpl()], ids=["arms to the sides", "hanging", "SMPL"])
def test_poselibs_limbs_trunk_head_and_feet_are_the_figures(tmp_path: Path, figure: Figure, is_local: bool) -> None:
    path = tmp_path / "amp_humanoid_walk.npy"
    write_poselib(path, figure, is_local=is_local)
    motion = mrhubo.read_motion(path)
    assert (motion.name, motion.frame_rate, len(motion), motion.notes) == ("amp_humanoid_walk", 60, FRAMES, ())
    assert motion.source.startswith("poselib's motion") and "z up" in motion.source
    assert limb_angles(motion, figure).max() < 2e-3
    turn_TN3, root_T3 = moves(figure)
    _, turns = pose(figure, turn_TN3, root_T3)
    places, turned = ours(motion)
    names = {"spine3": "Chest", "head": "Head", "left_ankle": "L_Ankle", "right_ankle": "R_Ankle"}
    if figure.names[0] == "pelvis":
        names = {"spine3": "torso", "head": "head", "left_ankle": "left_foot", "right_ankle": "right_foot"}
    for joint, name in names.items():
        theirs_T33 = TO_OURS @ turns[:, 0].mT @ turns[:, figure.names.index(name)] @ TO_OURS.T
        assert np.abs(turned["pelvis"].mT @ turned[joint] - theirs_T33).max() < 2e-3, joint
    gone = np.linalg.norm(np.diff(places["pelvis"][[0, -1]], axis=0))
    assert gone == pytest.approx(np.linalg.norm(root_T3[-1] - root_T3[0]), abs=0.1)  # hips turn about it


def test_poselibs_joints_may_have_any_names_and_order(tmp_path: Path) -> None:
    figure, (turn_TN3, root_T3) = T_POSE, moves(T_POSE)
    order = [0, *reversed(range(1, len(figure.names)))]
    value = poselib(in_other_order(figure), turn_TN3[:, order], root_T3)
    motion = mrhubo.read_motion(save(value, tmp_path / "walk.npy"))
    assert limb_angles(motion, figure).max() < 2e-3


@pytest.mark.parametrize("suffix", [".pkl", ".pt"])
def test_poselibs_motion_may_be_in_other_containers_and_dictionaries(tmp_path: Path, suffix: str) -> None:
    value = {"walk": dict(poselib(HANGING, *moves(HANGING)))}
    motion = mrhubo.read_motion(save(value, tmp_path / f"walk{suffix}"))
    assert limb_angles(motion, HANGING).max() < 2e-3


def test_poselibs_states_tell_no_rate(tmp_path: Path) -> None:
    value = poselib(T_POSE, *moves(T_POSE))
    del value["fps"]
    path = save(value, tmp_path / "walk.npy")
    with pytest.raises(UserError, match="--rate"):
        mrhubo.read_motion(path)
    assert mrhubo.read_motion(path, ReadOptions(rate=25)).frame_rate == 25


def _put(key: str, change: Callable[[np.ndarray], Any]) -> Callable[[dict[str, Any]], None]:
    def alter(value: dict[str, Any]) -> None:
        holder = value if key in value else value["skeleton_tree"]
        holder[key] = change(holder[key]["arr"] if isinstance(holder[key], dict) else holder[key])

    return alter


@pytest.mark.parametrize(
    ("alter", "said"),
    [
        (_put("rotation", lambda x: x[0]), "single pose"),
        (_put("rotation", lambda x: x[:, :9]), "expected \\(frames, 15, 4\\)"),
        (_put("rotation", lambda x: x[:0]), "expected \\(frames, 15, 4\\)"),
        (_put("rotation", lambda x: x * 0), "quaternions that are 0"),
        (_put("rotation", lambda x: x * np.nan), "NaN"),
        (_put("root_translation", lambda x: x[:, :2]), "'root_translation' has shape"),
        (_put("root_translation", lambda x: x + np.inf), "infinite"),
        (_put("local_translation", lambda x: x * np.nan), "nowhere"),
        (_put("local_translation", lambda x: x[:4]), "'local_translation' of shape"),
        (_put("parent_indices", lambda x: x + 40), "parents that there are not"),
        (_put("parent_indices", lambda x: np.where(x == 1, 3, np.where(x == 3, 3, x))), "in a circle"),
        (_put("node_names", lambda x: []), "0 names"),
    ],
)
def test_bad_poselib_motions_are_refused(tmp_path: Path, alter: Callable[[dict[str, Any]], None], said: str) -> None:
    value = poselib(T_POSE, *moves(T_POSE))
    alter(value)
    with pytest.raises(UserError, match=said):
        mrhubo.read_motion(save(value, tmp_path / "walk.npy"))


def test_poselibs_skeletons_of_no_human_are_refused(tmp_path: Path) -> None:
    legs = Figure(T_POSE.names[:1] + T_POSE.names[9:], (-1, 0, 1, 2, 0, 4, 5), T_POSE.offset_N3[[0, *range(9, 15)]])
    with pytest.raises(UserError, match=r"walk\.npy"):
        mrhubo.read_motion(save(poselib(legs, *moves(legs)), tmp_path / "walk.npy"))


def test_mimickits_humanoid_is_read(tmp_path: Path) -> None:
    path = tmp_path / "humanoid_walk.pkl"
    write_mimickit(path, T_POSE)
    motion = mrhubo.read_motion(path)
    assert (motion.frame_rate, len(motion), motion.notes) == (30, FRAMES, ())
    assert motion.source.startswith("motion of MimicKit's humanoid")
    assert limb_angles(motion, T_POSE).max() < 2e-3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda rows: rows[:, :29], "29 numbers"),
        (lambda rows: np.degrees(rows), "degrees"),
        (lambda rows: rows * np.nan, "NaN"),
    ],
)
def test_mimickits_other_characters_and_bad_rows_are_refused(
    tmp_path: Path, change: Callable[[np.ndarray], np.ndarray], said: str
) -> None:
    value = mimickit(T_POSE, *moves(T_POSE))
    value["frames"] = change(np.array(value["frames"])).tolist()
    with pytest.raises(UserError, match=said):
        mrhubo.read_motion(save(value, tmp_path / "walk.pkl"))


@pytest.mark.parametrize("writer", [mimickit, protomotions])
def test_smpls_humanoid_has_smpls_rotations(
    tmp_path: Path, writer: Callable[[Figure, np.ndarray, np.ndarray], dict[str, Any]]
) -> None:
    figure = smpl()
    turn_TN3, root_T3 = moves(figure)
    motion = mrhubo.read_motion(save(writer(figure, turn_TN3, root_T3), tmp_path / "walk.motion"))
    assert (motion.frame_rate, len(motion), motion.notes) == (30, FRAMES, ())
    assert "humanoid of SMPL" in motion.source and "z up" in motion.source
    assert limb_angles(motion, figure).max() < np.radians(3)  # the mean body's bones are not the figure's
    # As who writes them turns SMPL's parameters into theirs, backwards.
    pose_TJ3 = np.zeros((FRAMES, 24, 3))
    order = [0, 1, 4, 7, 10, 2, 5, 8, 11, 3, 6, 9, 12, 15, 13, 16, 18, 20, 22, 14, 17, 19, 21, 23]
    pose_TJ3[:, order] = turn_TN3 @ TO_OURS.T
    root = axis_angle_to_matrix(turn_TN3[:, 0]) @ TO_OURS.T
    pose_TJ3[:, 0] = matrix_to_axis_angle(root)
    same = {
        "poses": pose_TJ3.reshape(FRAMES, -1),
        "trans": root_T3,
        "mocap_framerate": 30,
        "surface_model_type": "smpl",
    }
    np.savez(tmp_path / "smpl.npz", **same)
    arrays, others = motion.arrays, mrhubo.read_motion(tmp_path / "smpl.npz").arrays
    np.testing.assert_allclose(arrays.local_TJ33, others.local_TJ33, atol=1e-5)
    assert arrays.root_rotation_T33 is not None and others.root_rotation_T33 is not None
    np.testing.assert_allclose(arrays.root_rotation_T33, others.root_rotation_T33, atol=1e-5)
    assert arrays.root_position_T3 is not None and others.root_position_T3 is not None
    np.testing.assert_allclose(arrays.root_position_T3, others.root_position_T3, atol=1e-5)


def test_of_protomotions_packed_motions_the_longest_is_read_or_the_one_that_is_asked_for(tmp_path: Path) -> None:
    path = save(packed_protomotions(smpl()), tmp_path / "motions.pt")
    longest = mrhubo.read_motion(path)
    assert len(longest) == FRAMES + 40 and longest.frame_rate == 30 and "'clip2'" in " ".join(longest.notes)
    assert limb_angles(longest, smpl(), seed=2).max() < np.radians(3)
    other = mrhubo.read_motion(path, ReadOptions(person="clip1"))
    assert len(other) == FRAMES + 20 and limb_angles(other, smpl(), seed=1).max() < np.radians(3)


def test_robots_with_as_many_bodies_are_no_humanoid_of_smpl(tmp_path: Path) -> None:
    value = protomotions(smpl(), *moves(smpl()))
    value["rigid_body_pos"] = value["rigid_body_pos"][:, list(reversed(range(24)))]
    with pytest.raises(UserError, match="robot"):
        mrhubo.read_motion(save(value, tmp_path / "walk.motion"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda starts: starts + 30, "do not fit"),
        (lambda starts: starts - 1, "do not fit"),
        (lambda starts: starts * float("nan"), "no lists of whole numbers"),
        (lambda starts: starts[:1], "no lists of the same length"),
    ],
)
def test_packed_motions_that_do_not_fit_are_refused(
    tmp_path: Path, change: Callable[[torch.Tensor], torch.Tensor], said: str
) -> None:
    value = packed_protomotions(smpl())
    value["length_starts"] = change(value["length_starts"])
    with pytest.raises(UserError, match=said):
        mrhubo.read_motion(save(value, tmp_path / "motions.pt"))


def test_packed_motions_without_names_go_by_their_numbers(tmp_path: Path) -> None:
    value = packed_protomotions(smpl())
    value["motion_files"] = ("same.npz",) * 3
    motion = mrhubo.read_motion(save(value, tmp_path / "motions.pt"), ReadOptions(person="0"))
    assert len(motion) == FRAMES


def test_a_folder_of_protomotions_files_is_read(tmp_path: Path) -> None:
    write_protomotions(tmp_path / "a.motion", smpl())
    write_protomotions(tmp_path / "b.motion", smpl(), seed=1)
    assert sorted(motion.name for motion in read_folder(tmp_path)) == ["a", "b"]
