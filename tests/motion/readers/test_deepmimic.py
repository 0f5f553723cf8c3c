"""DeepMimic's humanoid: its rows go through its own skeleton here, joint after joint, and limbs point the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

import mrhubo
from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES, OFFSETS_J3, PARENTS, hinge_axis
from mrhubo.motion.readers.options import ReadOptions

FRAMES = 24
TO_OURS = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
TREE = {
    "chest": ("root", (0.0, 0.236151, 0.0)),
    "neck": ("chest", (0.0, 0.223894, 0.0)),
    "right_hip": ("root", (0.0, 0.0, 0.084887)),
    "right_knee": ("right_hip", (0.0, -0.421546, 0.0)),
    "right_ankle": ("right_knee", (0.0, -0.40987, 0.0)),
    "right_shoulder": ("chest", (-0.02405, 0.2435, 0.18311)),
    "right_elbow": ("right_shoulder", (0.0, -0.274788, 0.0)),
    "left_hip": ("root", (0.0, 0.0, -0.084887)),
    "left_knee": ("left_hip", (0.0, -0.421546, 0.0)),
    "left_ankle": ("left_knee", (0.0, -0.40987, 0.0)),
    "left_shoulder": ("chest", (-0.02405, 0.2435, -0.18311)),
    "left_elbow": ("left_shoulder", (0.0, -0.274788, 0.0)),
}
"""Joints in the order of a row: what each hangs on, and where [m]."""
WRIST = (0.0, -0.258947, 0.0)
TURNED = {
    "pelvis": "root",
    "spine3": "chest",
    "head": "neck",
    "left_ankle": "left_ankle",
    "right_ankle": "right_ankle",
}


def rows(frames: int = FRAMES, step: float = 1 / 30) -> np.ndarray:
    """Somebody who walks on and turns, and moves all joints."""
    generator, phase_T1 = np.random.default_rng(0), np.linspace(0, 3, frames)[:, None]

    def wave(size: int, reach: float) -> np.ndarray:
        way = generator.uniform(-reach, reach, size)
        return way * np.sin(generator.uniform(0.5, 1.5, size) * phase_T1 + generator.uniform(0, 6, size))

    def quaternion(rotvec_T3: np.ndarray) -> np.ndarray:
        return np.roll(Rotation.from_rotvec(rotvec_T3).as_quat(), 1, axis=1)

    parts = [np.full((frames, 1), step), np.array([0.2, 0.9, 0.1]) + phase_T1 * [0.5, 0.0, 0.1]]
    parts.append(quaternion(wave(3, 0.4) + [0.0, 1.0, 0.0]))
    for name in TREE:
        bends = -1.0 if name.endswith("knee") else 1.0
        if name.endswith(("knee", "elbow")):
            parts.append(bends * np.abs(0.8 + wave(1, 0.7)))
        else:
            parts.append(quaternion(wave(3, 0.6)))
    return np.concatenate(parts, axis=1).round(7)


def write(path: Path, rows_TX: np.ndarray, **more: object) -> Path:
    """As DeepMimic has it, a line a frame."""
    lines = ",\n".join("[ " + ",   ".join(f"{number:.10f}" for number in row) + "]" for row in rows_TX)
    start = "".join(f"{json.dumps(key)}: {json.dumps(value)},\n" for key, value in more.items())
    path.write_text(f'{{\n"Loop": "wrap",\n{start}"Frames":\n[\n{lines}\n]\n}}\n'.replace(" nan", " NaN"))
    return path


def skeleton(rows_TX: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, Rotation]]:
    """Places and turns of the humanoid's joints, in its world."""

    def turn(quaternion_T4: np.ndarray) -> Rotation:
        return Rotation.from_quat(np.roll(quaternion_T4, -1, axis=1))

    places, turns, at = {"root": rows_TX[:, 1:4]}, {"root": turn(rows_TX[:, 4:8])}, 8
    for name, (parent, offset) in TREE.items():
        places[name] = places[parent] + turns[parent].apply(offset)
        if name.endswith(("knee", "elbow")):
            turns[name] = turns[parent] * Rotation.from_rotvec(rows_TX[:, at, None] * [0.0, 0.0, 1.0])
            at += 1
        else:
            turns[name] = turns[parent] * turn(rows_TX[:, at : at + 4])
            at += 4
    assert at == rows_TX.shape[1] == 44
    for side in ("left", "right"):
        places[f"{side}_wrist"] = places[f"{side}_elbow"] + turns[f"{side}_elbow"].apply(WRIST)
    return places, turns


def ours(motion: mrhubo.Motion) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Places and turns of our joints."""
    arrays = motion.arrays
    assert arrays.root_rotation_T33 is not None and arrays.root_position_T3 is not None
    turns, places = [arrays.root_rotation_T33.astype(float)], [arrays.root_position_T3.astype(float)]
    for joint, offset_3 in enumerate(OFFSETS_J3.astype(float), start=1):
        places.append(places[PARENTS[joint]] + turns[PARENTS[joint]] @ offset_3)
        turns.append(turns[PARENTS[joint]] @ arrays.local_TJ33[:, joint - 1])
    return dict(zip(JOINT_NAMES, places, strict=True)), dict(zip(JOINT_NAMES, turns, strict=True))


def test_limbs_trunk_head_and_feet_are_as_the_humanoids(tmp_path: Path) -> None:
    rows_TX = rows()
    motion = mrhubo.read_motion(write(tmp_path / "humanoid3d_walk.txt", rows_TX, RightJoints=[3, 4]))
    assert motion.name == "humanoid3d_walk" and motion.frame_rate == 30 and motion.notes == ()
    assert motion.source.startswith("DeepMimic") and motion.confidence_TJ is None
    (places, turns), (theirs, turned) = ours(motion), skeleton(rows_TX)
    for side in ("left", "right"):
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle")):
            limb_T3 = places[f"{side}_{end}"] - places[f"{side}_{start}"]
            true_T3 = (theirs[f"{side}_{end}"] - theirs[f"{side}_{start}"]) @ TO_OURS.T
            cosine_T = (limb_T3 * true_T3).sum(1) / np.linalg.norm(limb_T3, axis=1) / np.linalg.norm(true_T3, axis=1)
            assert cosine_T.min() > np.cos(1e-3), (side, start)
    for joint, their_joint in TURNED.items():
        true_T33 = TO_OURS @ turned[their_joint].as_matrix() @ TO_OURS.T
        assert np.abs(turns[joint] - true_T33).max() < 1e-3, joint
    middle_T3 = (theirs["left_hip"] + theirs["right_hip"]) / 2 @ TO_OURS.T
    np.testing.assert_allclose((places["left_hip"] + places["right_hip"]) / 2, middle_T3, atol=1e-3)


def test_elbows_and_knees_bend_by_the_files_angles_and_straight_ones_about_its_axes(tmp_path: Path) -> None:
    rows_TX = rows()
    rows_TX[:, [20, 34]] *= 0.01
    rows_TX[:, [29, 43]] *= 0.01
    motion = mrhubo.read_motion(write(tmp_path / "a.txt", rows_TX))
    for name, column, sign in (
        ("right_knee", 20, -1), ("right_elbow", 29, 1), ("left_knee", 34, -1), ("left_elbow", 43, 1),
    ):  # fmt: skip
        turn_T3 = Rotation.from_matrix(motion.arrays.local_TJ33[:, JOINT_NAMES.index(name) - 1]).as_rotvec()
        np.testing.assert_allclose(turn_T3, sign * rows_TX[:, [column]] * hinge_axis(name), atol=2e-3, err_msg=name)


@pytest.mark.parametrize(("step", "rate"), [(0.016666, 60), (0.0166659999, 60), (0.0333333, 30), (0.0625, 16)])
def test_the_rate_is_that_of_the_durations_of_which_the_last_says_nothing(
    tmp_path: Path, step: float, rate: float
) -> None:
    rows_TX = rows(step=step)
    rows_TX[:, 0] = step
    rows_TX[-1, 0] = 0
    motion = mrhubo.read_motion(write(tmp_path / "a.txt", rows_TX), ReadOptions(rate=25))
    assert motion.frame_rate == rate and len(motion) == FRAMES
    assert "25" in motion.notes[0]


def test_frames_that_last_differently_long_are_interpolated(tmp_path: Path) -> None:
    whole_TX = rows(61, 1 / 60)
    kept = [0, 1, 2, *range(5, 30), *range(32, 61)]
    rows_TX = whole_TX[kept]
    rows_TX[:, 0] = np.append(np.diff(kept), 0) / 60
    rows_TX[7:, 4:8] *= -1  # the same rotation
    motion = mrhubo.read_motion(write(tmp_path / "a.txt", rows_TX))
    assert motion.frame_rate == 60 and len(motion) == 61
    assert "interpolated" in motion.notes[0] and "17 to 50 ms" in motion.notes[0]
    _, turns = ours(motion)
    keys = Rotation.from_quat(np.roll(rows_TX[:, 4:8], -1, axis=1))
    true_T33 = TO_OURS @ Slerp(np.array(kept, float), keys)(np.arange(61)).as_matrix() @ TO_OURS.T
    assert np.abs(turns["pelvis"] - true_T33).max() < 1e-3


def test_other_characters_and_what_is_no_motion_are_refused_in_a_sentence(tmp_path: Path) -> None:
    def refused(rows_TX: np.ndarray, sentence: str) -> None:
        with pytest.raises(UserError, match=sentence) as caught:
            mrhubo.read_motion(write(tmp_path / "a.txt", rows_TX))
        assert "\n" not in str(caught.value)

    good_TX = rows()
    refused(good_TX[:, :20], "rows of 20 numbers.*have 44")
    for column, number, sentence in (
        (30, 5.0, "numbers 31 to 34 .* left hip"),
        (1, 1e9, "places beyond"),
        (20, 80.0, "degrees"),
        (2, np.nan, "NaN"),
        (0, -1.0, "frame 0 .* lasts -1 s"),
        (0, 0.0, "last 0 s; say what it is, by --rate"),
        (0, 1e-5, "frames per second; expected"),
    ):
        bad_TX = good_TX.copy()
        bad_TX[:, column] = number
        refused(bad_TX, sentence)
    bad_TX = good_TX.copy()
    bad_TX[5, 0] = 1e9
    refused(bad_TX, "that is no motion")
    (tmp_path / "b.txt").write_text('{"Loop": "none", "Frames": [["walk", 2, 3]]}')
    with pytest.raises(UserError, match="rows of 3 numbers"):
        mrhubo.read_motion(tmp_path / "b.txt")
    value = {"Frames": [["a"] * 44]}
    (tmp_path / "b.txt").write_text(json.dumps(value))
    with pytest.raises(UserError, match="no number"):
        mrhubo.read_motion(tmp_path / "b.txt")
