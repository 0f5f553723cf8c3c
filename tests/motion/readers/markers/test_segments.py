"""Bodies of segments in C3D files, as Theia3D writes them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import angles_between, axis_angle_to_matrix
from mrhubo.motion import NoMotion
from mrhubo.motion.readers.markers.c3d_file import read_c3d_file
from mrhubo.motion.readers.markers.segments import joints_of
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.damage import Step, accidents, damaged, read_or_refused
from tests.motion.marker_writer import Manner, Segmented, c3d
from tests.motion.readers.markers.bodies import Z_UP, moving_body
from tests.motion.readers.markers.test_convert import limbs_off, marked, read, world_turns

_NO_POINTS = np.empty((60, 0, 3))
_FLOATING = Manner(analog=0, rate=85.0)
_LIMBS = {
    "thigh": ("hip", "knee"), "shank": ("knee", "ankle"), "uarm": ("shoulder", "elbow"), "larm": ("elbow", "wrist"),
}  # fmt: skip


def axes(z_T3: np.ndarray, right_T3: np.ndarray) -> np.ndarray:
    """Axes (T, 3, 3) of a segment whose z goes there, and whose x is the other as far as it can be."""
    x_T3 = normalize(right_T3 - z_T3 * (right_T3 * z_T3).sum(-1, keepdims=True))
    return np.stack((x_T3, np.cross(z_T3, x_T3), z_T3), axis=-1)


def theia(name: str = "boxing", unit: float = 1000.0, world_33: np.ndarray = Z_UP) -> Segmented:
    """The segments of somebody, by the definitions of their axes: z up the limb, x the axis of elbow and knee, of a
    hand to the right where palms are turned forward.
    """
    place_TJ3, world_TJ33 = moving_body(name)
    at = {joint: place_TJ3[:, number] for number, joint in enumerate(JOINT_NAMES)}
    turn = {joint: world_TJ33[:, number] for number, joint in enumerate(JOINT_NAMES)}
    found = {"worldbody": (np.tile(np.eye(3), (60, 1, 1)), np.zeros((60, 3)))}
    for segment, joint in (("pelvis", "pelvis"), ("torso", "spine3"), ("head", "head")):
        found[segment] = axes(turn[joint][..., 1], -turn[joint][..., 0]), at[joint] + turn[joint] @ [0, 0.05, 0.02]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for segment, (start, end) in _LIMBS.items():
            up_T3, own = normalize(at[f"{side}_{start}"] - at[f"{side}_{end}"]), turn[f"{side}_{start}"]
            right_T3 = -own[..., 0] if start in ("hip", "knee") else -sign * own[..., 1]
            found[f"{side[0]}_{segment}"] = axes(up_T3, right_T3), at[f"{side}_{start}"]
        foot, hand = turn[f"{side}_ankle"], turn[f"{side}_wrist"]
        found[f"{side[0]}_foot"] = axes(foot[..., 1], -foot[..., 0]), at[f"{side}_ankle"]
        found[f"{side[0]}_toes"] = axes(foot[..., 1], -foot[..., 0]), at[f"{side}_foot"]
        # Of a hand that is held out with its palm down, x, the thumb's side of the right and the other of the left,
        # goes forward and backward.
        found[f"{side[0]}_hand"] = axes(-sign * hand[..., 0], -sign * hand[..., 2]), at[f"{side}_wrist"]
    matrix_TS44 = np.zeros((60, len(found), 4, 4))
    matrix_TS44[..., 3, 3] = 1.0
    for number, (turn_T33, place_T3) in enumerate(found.values()):
        matrix_TS44[:, number, :3, :3], matrix_TS44[:, number, :3, 3] = (
            world_33 @ turn_T33,
            unit * place_T3 @ world_33.T,
        )
    return Segmented([f"{segment}_4X4" for segment in found], matrix_TS44)


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize(("ratio", "frames_told"), [(1, True), (1, False), (2, False)])
def test_matrices_names_and_rate_come_back(processor: int, ratio: int, frames_told: bool, tmp_path: Path) -> None:
    segmented = theia()
    matrix_TS44 = segmented.matrix_TS44.repeat(ratio, axis=0)
    matrix_TS44[3:5, 2] = np.nan
    path = tmp_path / "pose.c3d"
    told = replace(segmented, matrix_TS44=matrix_TS44, ratio=ratio, frames_told=frames_told)
    path.write_bytes(c3d(_NO_POINTS, [], Manner(processor, analog=0, rate=59.94), told))
    found = read_c3d_file(path).segments
    assert found is not None and found.names == tuple(segmented.names)
    assert found.rate == pytest.approx(59.94 * ratio, rel=1e-6)
    np.testing.assert_allclose(found.turn_TS33, matrix_TS44[..., :3, :3], atol=1e-6)
    np.testing.assert_allclose(found.place_TS3, matrix_TS44[..., :3, 3], atol=1e-3)


def test_frames_of_points_are_none_of_segments(tmp_path: Path) -> None:
    """Of a file without the count of those, whose ratio would make more frames of what follows."""
    path, segmented = tmp_path / "pose.c3d", theia()
    data = bytearray(c3d(*marked(), Manner(analog=300), replace(segmented, frames_told=False)))
    starts = [data.index(b"DATA_START") + len("DATA_START") + 4]
    header, rotation = int.from_bytes(data[16:18], "little"), int.from_bytes(data[starts[0] : starts[0] + 2], "little")
    points, turns = data[512 * (header - 1) : 512 * (rotation - 1)], data[512 * (rotation - 1) :]
    swapped = data[: 512 * (header - 1)] + turns + points
    ratio = swapped.index(b"RATIO") + len("RATIO") + 4
    swapped[ratio : ratio + 2] = (2).to_bytes(2, "little")
    swapped[starts[0] : starts[0] + 2] = data[16:18]
    swapped[16:18] = (header + len(turns) // 512).to_bytes(2, "little")
    path.write_bytes(bytes(swapped))
    found = read_c3d_file(path)
    assert found.segments is not None and len(found.segments.turn_TS33) == 60 and len(found.point_TK3) == 60
    np.testing.assert_allclose(found.point_TK3, marked()[0], atol=1e-3)


@pytest.mark.parametrize(
    ("unit", "world_33", "said"),
    [(1000.0, Z_UP, "millimetres, z up"), (1.0, np.eye(3), "metres, y up")],
)
def test_a_body_is_turned_as_its_segments(unit: float, world_33: np.ndarray, said: str, tmp_path: Path) -> None:
    motion = read(c3d(_NO_POINTS, [], _FLOATING, theia("boxing", unit, world_33)), tmp_path)
    assert motion.frame_rate == 85 and "turned as their axes are" in motion.source and said in motion.source
    assert not motion.notes and motion.arrays.confidence_TJ is None
    assert limbs_off(motion) < 0.1
    place_TJ3, world_TJ33 = moving_body("boxing")
    turns = world_turns(motion)
    for name in ("spine3", "head", "left_wrist", "right_wrist", "left_ankle", "right_ankle"):
        joint = JOINT_NAMES.index(name)
        turned = angles_between(turns[0].mT @ turns[joint], world_TJ33[:, 0].mT @ world_TJ33[:, joint])
        assert np.degrees(turned.max()) < 0.1, name
    root_T3 = motion.arrays.root_position_T3
    assert root_T3 is not None
    np.testing.assert_allclose(root_T3[:, 1], place_TJ3[:, 0, 1], atol=0.01)
    np.testing.assert_allclose(norm(root_T3 - root_T3[0]), norm(place_TJ3[:, 0] - place_TJ3[0, 0]), atol=0.01)


def test_a_straight_arm_bends_about_its_segments_axis(tmp_path: Path) -> None:
    """Nothing else tells how it is turned about itself."""
    straight = theia("straight_arms/side_circles")
    motion = read(c3d(_NO_POINTS, [], _FLOATING, straight), tmp_path)
    turns, (_, world_TJ33) = world_turns(motion), moving_body("straight_arms/side_circles")
    for name in ("left_shoulder", "right_shoulder"):
        joint = JOINT_NAMES.index(name)
        turned = angles_between(turns[9].mT @ turns[joint], world_TJ33[:, 9].mT @ world_TJ33[:, joint])
        assert np.degrees(turned.max()) < 1.0, name


def test_axes_of_another_convention_are_not_believed(tmp_path: Path) -> None:
    """Joints alone tell limbs then, and hands are in line with forearms."""
    segmented = theia()
    other_33 = axis_angle_to_matrix(np.array([0.0, 0.0, np.pi / 2])) @ axis_angle_to_matrix(np.array([np.pi / 2, 0, 0]))
    matrix_TS44 = segmented.matrix_TS44.copy()
    matrix_TS44[..., :3, :3] = matrix_TS44[..., :3, :3] @ other_33
    motion = read(c3d(_NO_POINTS, [], _FLOATING, replace(segmented, matrix_TS44=matrix_TS44)), tmp_path)
    assert "joints alone, as axes are not along limbs" in motion.source
    assert limbs_off(motion) < 12.0  # seen from a chest that shoulders and hips tell
    turns = world_turns(motion)
    for side in ("left", "right"):
        forearm, hand = (turns[JOINT_NAMES.index(f"{side}_{joint}")] for joint in ("elbow", "wrist"))
        assert angles_between(forearm, hand).max() < 1e-3


def test_segments_go_before_markers_beside_them(tmp_path: Path) -> None:
    both, alone = (read(c3d(*points, _FLOATING, theia()), tmp_path) for points in (marked(), (_NO_POINTS, [])))
    assert both.checksum == alone.checksum and "segments" in both.source
    other = replace(theia(), names=[f"body {number}" for number in range(len(theia().names))])
    assert "taken for markers" in read(c3d(*marked(), _FLOATING, other), tmp_path).source


def test_segments_that_are_not_known_are_filled_in(tmp_path: Path) -> None:
    segmented = theia()
    segmented.matrix_TS44[:8] = np.nan  # who comes into view later
    segmented.matrix_TS44[20:30, list(segmented.names).index("l_larm_4X4")] = np.nan
    motion = read(c3d(_NO_POINTS, [], _FLOATING, segmented), tmp_path)
    sure_TJ = motion.arrays.confidence_TJ
    assert sure_TJ is not None and np.isfinite(motion.arrays.local_TJ33).all()
    elbow = JOINT_NAMES.index("left_elbow") - 1
    np.testing.assert_array_equal(np.flatnonzero(sure_TJ[:, elbow] == 0), [*range(8), *range(20, 30)])


@pytest.mark.parametrize(
    ("names", "joints"),
    [
        (["l_uarm_4X4", "R_THIGH", "torso_4x4", "worldbody_4X4"], ["left_shoulder", "right_hip", "spine3"]),
        (
            ["LeftUpperArm", "Ann:RightThigh", "Thorax", "LeftToes"],
            ["left_shoulder", "right_hip", "spine3", "left_foot"],
        ),
        (["left forearm", "r_shank", "l_clavicle_4X4", "Prop"], ["left_elbow", "right_knee", "left_collar"]),
    ],
)
def test_names_of_segments(names: list[str], joints: list[str]) -> None:
    assert list(joints_of(names)) == joints


def test_what_is_refused_is_told(tmp_path: Path) -> None:
    good = theia()
    bodiless = replace(good, names=[f"body {number}" for number in range(len(good.names))])
    with pytest.raises(
        NoMotion, match="of segments of no body .*: body 0, body 1, .*; upper arms and thighs are needed"
    ):
        read(c3d(_NO_POINTS, [], _FLOATING, bodiless), tmp_path)
    with pytest.raises(UserError, match="without points"):
        whole = c3d(_NO_POINTS, [], _FLOATING, good)
        read(whole[: whole.index(b"DATA_START") + 512], tmp_path)
    unknown = replace(good, matrix_TS44=np.full_like(good.matrix_TS44, np.nan))
    with pytest.raises(UserError, match="seen in 0 of 60 frames"):
        read(c3d(_NO_POINTS, [], _FLOATING, unknown), tmp_path)
    far = replace(good, matrix_TS44=good.matrix_TS44 * 1e6)
    far.matrix_TS44[..., :3, :3] = good.matrix_TS44[..., :3, :3]
    with pytest.raises(UserError, match="holds numbers beyond"):
        read(c3d(_NO_POINTS, [], _FLOATING, far), tmp_path)
    with pytest.raises(UserError, match="say what it is, by --rate"):
        read(c3d(_NO_POINTS, [], Manner(analog=0, rate=0.0), good), tmp_path)
    assert (
        read(c3d(_NO_POINTS, [], Manner(analog=0, rate=0.0), good), tmp_path, ReadOptions(rate=50.0)).frame_rate == 50
    )


@given(steps=accidents, at=st.integers(0, 40))
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_refused_in_a_sentence(steps: list[Step], at: int, tmp_path: Path) -> None:
    path, good = tmp_path / "pose.c3d", c3d(_NO_POINTS, [], _FLOATING, theia())
    bad = bytearray(damaged(good, steps))
    if at and b"ROTATION" in bad:  # numbers of the group itself
        place = bad.index(b"ROTATION") + 8 * at
        bad[place : place + 2] = b"\xff\x7f"
    path.write_bytes(bytes(bad))
    read_or_refused(path)
