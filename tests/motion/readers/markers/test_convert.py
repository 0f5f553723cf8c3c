"""Motions of bodies with markers, in C3D files and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

import mrhubo
from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES, OFFSETS_J3, PARENTS
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import angles_between
from mrhubo.motion import Motion, NoMotion
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.damage import Step, accidents, altered_words, damaged, read_or_refused
from tests.motion.marker_writer import Manner, c3d, label_of, markers_on, qualisys, vicon
from tests.motion.readers.markers.bodies import Z_UP, moving_body
from tests.motion.readers.test_trc_file import trc


def marked(
    markers: Mapping[str, np.ndarray] | None = None, unit: float = 1000.0, world_33: np.ndarray = Z_UP
) -> tuple[np.ndarray, list[str]]:
    """Points (T, K, 3) of somebody who boxes, and their labels; in millimetres with z up, unless said otherwise."""
    markers = markers_on(*moving_body("boxing")) if markers is None else markers
    return unit * np.stack(list(markers.values()), axis=1) @ world_33.T, [label_of(place) for place in markers]


def world_turns(motion: Motion) -> dict[int, np.ndarray]:
    """How the joints of a motion are turned in the world (T, 3, 3), by their places in `JOINT_NAMES`."""
    root_T33 = motion.arrays.root_rotation_T33
    assert root_T33 is not None
    turns = {0: root_T33.astype(float)}
    for joint in range(1, 22):
        turns[joint] = turns[PARENTS[joint]] @ motion.arrays.local_TJ33[:, joint - 1]
    return turns


def limbs_off(motion: Motion, name: str = "boxing") -> float:
    """By how much [deg] limbs point elsewhere than the body's, seen from the chest and the pelvis, at most."""
    place_TJ3, world_TJ33 = moving_body(name)
    turns = world_turns(motion)
    assert len(motion) == len(place_TJ3)
    worst = 0.0
    for side in ("left", "right"):
        for start, end, seen_from in (
            ("shoulder", "elbow", 9), ("elbow", "wrist", 9), ("hip", "knee", 0), ("knee", "ankle", 0),
        ):  # fmt: skip
            i, j = (JOINT_NAMES.index(f"{side}_{joint}") for joint in (start, end))
            here_T3 = turns[seen_from].mT @ turns[i] @ normalize(OFFSETS_J3[j - 1].astype(float))
            there_T3 = world_TJ33[:, seen_from].mT @ normalize(place_TJ3[:, j] - place_TJ3[:, i])[..., None]
            cosine_T = (here_T3 * there_T3[..., 0]).sum(-1)
            worst = max(worst, float(np.degrees(np.arccos(np.clip(cosine_T, -1, 1))).max()))
    return worst


def read(content: bytes | str, folder: Path, options: ReadOptions | None = None, name: str = "box.c3d") -> Motion:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return mrhubo.read_motion(path, options)


@pytest.mark.parametrize("how", [Manner(), Manner(85, rate=100.0), Manner(86, is_whole=True)], ids=str)
def test_a_body_in_c3d(how: Manner, tmp_path: Path) -> None:
    point_TK3, labels = marked()
    motion = read(c3d(point_TK3, labels, how), tmp_path)
    assert motion.frame_rate == how.rate and motion.source.startswith("C3D file, 30 of 30 points taken for markers")
    assert "millimetres, z up" in motion.source and motion.arrays.confidence_TJ is None
    assert len(motion.notes) == 1 and "worked out from markers on the skin" in motion.notes[0]
    assert limbs_off(motion) < 4.0
    root_T3 = motion.arrays.root_position_T3
    assert root_T3 is not None
    wanted_T3 = moving_body("boxing")[0][:, 0]
    np.testing.assert_allclose(root_T3[:, 1], wanted_T3[:, 1], atol=0.01)
    np.testing.assert_allclose(norm(root_T3 - root_T3[0]), norm(wanted_T3 - wanted_T3[0]), atol=0.01)


@pytest.mark.parametrize("both_sides", [False, True])
def test_hands_feet_and_head_are_turned_as_the_bodys(both_sides: bool, tmp_path: Path) -> None:
    place_TJ3, world_TJ33 = moving_body("boxing")
    motion = read(c3d(*marked(markers_on(place_TJ3, world_TJ33, both_sides))), tmp_path)
    turns = world_turns(motion)
    for name, most in (("head", 0.2), ("left_wrist", 4.0), ("right_wrist", 4.0), ("left_ankle", 4.0)):
        joint = JOINT_NAMES.index(name)
        turned = angles_between(  # seen from the pelvis: which way is forward in the world, the file does not tell
            turns[0].mT @ turns[joint], world_TJ33[:, 0].mT @ world_TJ33[:, joint]
        )
        assert np.degrees(turned.max()) < most, name


@pytest.mark.parametrize("write", [qualisys, vicon, lambda p, n: qualisys(p, n, False)], ids=["tsv", "csv", "bare"])
def test_tables_tell_the_same(write: Callable[[np.ndarray, list[str]], str], tmp_path: Path) -> None:
    point_TK3, labels = marked()
    point_TK3[10:14, labels.index("LFIN")] = np.nan
    point_TK3[0, 0] = point_TK3[30] = np.nan  # the first cell, and a whole line
    wanted = read(c3d(point_TK3, labels, Manner(rate=100.0)), tmp_path)
    motion = read(write(point_TK3, labels), tmp_path, name="box.txt")
    assert motion.frame_rate == 100
    np.testing.assert_allclose(motion.arrays.local_TJ33, wanted.arrays.local_TJ33, atol=1e-3)
    np.testing.assert_array_equal(motion.arrays.confidence_TJ, wanted.arrays.confidence_TJ)  # type: ignore[arg-type]
    assert motion.notes == wanted.notes


def test_trc_with_markers_tells_the_same(tmp_path: Path) -> None:
    point_TK3, labels = marked(world_33=np.eye(3))
    motion = read(trc(point_TK3, labels, "mm", "60"), tmp_path, name="box.trc")
    assert motion.frame_rate == 60 and motion.source.startswith("TRC file, 30 of 30 points")
    assert limbs_off(motion) < 4.0


def test_feet_that_stand_are_level_whatever_the_height_of_their_markers(tmp_path: Path) -> None:
    markers = markers_on(*moving_body("boxing"))
    for place, higher in (("left_toe", 0.03), ("right_toe", 0.02), ("right_heel", -0.01)):
        markers[place] = markers[place] + np.array([0, higher, 0])
    motion = read(c3d(*marked(markers), Manner(rate=30.0)), tmp_path)
    turns = world_turns(motion)
    up_T3 = [turns[JOINT_NAMES.index(f"{side}_ankle")][:, 1, 1] for side in ("left", "right")]
    assert np.degrees(np.arccos(np.clip(np.median(up_T3, axis=1), -1, 1))).max() < 2.0


def test_markers_that_are_hidden_are_unsure(tmp_path: Path) -> None:
    """A pelvis' marker is told by the others; an elbow's is not, and is filled in."""
    point_TK3, labels = marked()
    point_TK3[20:30, labels.index("LELB")] = np.nan
    point_TK3[40:50, labels.index("LPSI")] = np.nan
    motion = read(c3d(point_TK3, labels), tmp_path)
    sure_TJ = motion.arrays.confidence_TJ
    assert sure_TJ is not None
    shoulder, hip = (JOINT_NAMES.index(name) - 1 for name in ("left_shoulder", "left_hip"))
    np.testing.assert_array_equal(np.flatnonzero(sure_TJ[:, shoulder] == 0), range(20, 30))
    assert (sure_TJ[:, hip] == 1).all()


def test_who_is_asked_for_is_read(tmp_path: Path) -> None:
    point_TK3, labels = marked()
    both = np.concatenate([point_TK3, point_TK3[::-1]], axis=1)
    content = c3d(both, [f"{name}:{label}" for name in ("Ann", "Ben") for label in labels])
    first = read(content, tmp_path)
    assert "'Ann' (60 frames), 'Ben' (60 frames)" in first.notes[0]
    second = read(content, tmp_path, ReadOptions(person="Ben"))
    np.testing.assert_allclose(second.arrays.local_TJ33[::-1], first.arrays.local_TJ33, atol=0.02)
    with pytest.raises(UserError, match="no person 'Cid'"):
        read(content, tmp_path, ReadOptions(person="Cid"))


def test_joints_in_c3d_are_read_as_points(tmp_path: Path) -> None:
    """As cameras without markers find them."""
    place_TJ3, _ = moving_body("boxing")
    names = ["LShoulder", "RShoulder", "LElbow", "RElbow", "LWrist", "RWrist", "LHip", "RHip", "LKnee", "RKnee"]
    sides = {"L": "left", "R": "right"}
    joints = [JOINT_NAMES.index(f"{sides[name[0]]}_{name[1:].lower()}") for name in names]
    motion = read(c3d(1000 * place_TJ3[:, joints], names), tmp_path)
    assert "keypoints the C3D file, by their names" in motion.source


def test_a_rate_that_is_not_told_is_asked_for(tmp_path: Path) -> None:
    content = c3d(*marked(), Manner(rate=0.0))
    with pytest.raises(UserError, match="say what it is, by --rate"):
        read(content, tmp_path)
    assert read(content, tmp_path, ReadOptions(rate=50.0)).frame_rate == 50


def test_no_motion_of_legs_alone_or_of_no_labels(tmp_path: Path) -> None:
    point_TK3, labels = marked()
    legs = [i for i, label in enumerate(labels) if label[1:] in ("ASI", "PSI", "KNE", "ANK", "HEE", "TOE")]
    with pytest.raises(NoMotion, match="no markers or joints of a whole body that are known by their labels: LANK"):
        read(c3d(point_TK3[:, legs], [labels[i] for i in legs]), tmp_path)
    with pytest.raises(NoMotion, match=r"\*0, \*1.*SOMA"):
        read(c3d(point_TK3, [f"*{i}" for i in range(len(labels))]), tmp_path)
    with pytest.raises(NoMotion, match="without 'Trajectories'"):
        read(vicon(point_TK3, labels).replace("Trajectories", "Devices"), tmp_path, name="box.csv")
    with pytest.raises(NoMotion, match=r"without markers \(6D\)"):
        read(qualisys(point_TK3, labels).replace("\t3D", "\t6D"), tmp_path, name="box.tsv")


def test_markers_that_are_never_seen_are_told(tmp_path: Path) -> None:
    point_TK3, labels = marked()
    point_TK3[:, labels.index("RSHO")] = np.nan
    with pytest.raises(UserError, match="markers of right_shoulder are not seen in any frame"):
        read(c3d(point_TK3, labels), tmp_path)


def test_markers_that_are_hardly_ever_seen_together_are_no_motion(tmp_path: Path) -> None:
    point_TK3, labels = marked()
    point_TK3[1:, labels.index("RSHO")] = np.nan
    with pytest.raises(UserError, match="seen in 1 of 60 frames makes no motion"):
        read(c3d(point_TK3, labels), tmp_path)
    point_TK3[1:, labels.index("LSHO")], point_TK3[0, labels.index("LSHO")] = point_TK3[:-1, 0], np.nan
    with pytest.raises(UserError, match="shoulders and pelvis are not seen together in any frame"):
        read(c3d(point_TK3, labels), tmp_path)


def test_numbers_beyond_all_bounds_are_refused(tmp_path: Path) -> None:
    point_TK3, labels = marked()
    point_TK3[5, 3] = 1e9
    with pytest.raises(UserError, match="holds numbers beyond 1e"):
        read(c3d(point_TK3, labels), tmp_path)


@given(steps=accidents)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_refused_in_a_sentence(steps: list[Step], tmp_path: Path) -> None:
    point_TK3, labels = marked()
    for name, content in (
        ("box.c3d", c3d(point_TK3[:9], labels)),
        ("box.tsv", qualisys(point_TK3[:5], labels).encode()),
    ):
        (tmp_path / name).write_bytes(damaged(content, steps))
        read_or_refused(tmp_path / name, names=(name,))
    (tmp_path / "box.csv").write_bytes(altered_words(len(steps), vicon(point_TK3[:5], labels).encode()))
    read_or_refused(tmp_path / "box.csv", names=("box.csv",))
