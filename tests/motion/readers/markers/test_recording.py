"""Recordings of Qualisys Track Manager in MATLAB's files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import mrhubo
from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES
from mrhubo.motion import NoMotion
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.marker_writer import c3d, qualisys
from tests.motion.readers.markers.bodies import BONES, Z_UP, moving_body
from tests.motion.readers.markers.test_convert import limbs_off, marked
from tests.motion.readers.markers.test_convert import read as read_file


def skeleton(name: str = "Ann", unseen: slice = slice(0)) -> dict[str, Any]:
    """One that is solved, in millimetres with z up."""
    place_TJ3 = 1000 * moving_body("boxing")[0] @ Z_UP.T
    places = np.stack([place_TJ3[:, JOINT_NAMES.index(joint)] for joint in BONES.values()], axis=1)
    places[unseen] = np.nan
    return {
        "SkeletonName": name,
        "NrOfSegments": len(BONES),
        "SegmentLabels": np.array([list(BONES)], dtype=object),
        "PositionData": places.transpose(2, 1, 0),
        "RotationData": np.ones((4, len(BONES), len(places))),
    }


def markers(prefix: str = "") -> dict[str, Any]:
    point_TK3, labels = marked()
    point_TK3[5:9, labels.index("LFIN")] = np.nan
    seen = np.concatenate([point_TK3, np.full((*point_TK3.shape[:2], 1), 0.4)], axis=-1)
    return {
        "Labeled": {
            "Count": len(labels),
            "Labels": np.array([[prefix + label for label in labels]], dtype=object),
            "Data": seen.transpose(1, 2, 0),
        },
        "Unidentified": {"Count": 0, "Data": np.zeros((0, 4, len(seen)))},
    }


def recording(**content: Any) -> dict[str, Any]:
    content = content or {"Skeletons": skeleton()}
    return {"File": "C:\\takes\\box_1.qtm", "StartFrame": 1, "Frames": 60, "FrameRate": 150, **content}


def read(tmp_path: Path, options: ReadOptions | None = None, **content: Any) -> mrhubo.Motion:
    path = tmp_path / "box_1.mat"
    savemat(path, {"box_1": recording(**content)}, do_compression=True)
    return mrhubo.read_motion(path, options)


def test_a_skeleton(tmp_path: Path) -> None:
    motion = read(tmp_path, Skeletons=skeleton(), Trajectories=markers())
    assert motion.frame_rate == 150 and motion.source.startswith("keypoints skeleton 'Ann', by their names, milli")
    assert limbs_off(motion) < 2.0
    root_T3, wanted_T3 = motion.arrays.root_position_T3, moving_body("boxing")[0][:, 0]
    assert root_T3 is not None
    np.testing.assert_allclose(root_T3[:, 1] - root_T3[0, 1], wanted_T3[:, 1] - wanted_T3[0, 1], atol=0.01)


def test_one_of_two_skeletons(tmp_path: Path) -> None:
    both = np.array([skeleton("Ann", slice(0, 20)), skeleton("Ben")], dtype=object)
    motion = read(tmp_path, Skeletons=both)
    assert len(motion) == 60 and "'Ben' is seen longest and was taken" in motion.notes[0]
    sure_TJ = read(tmp_path, ReadOptions(person="Ann"), Skeletons=both).arrays.confidence_TJ
    assert sure_TJ is not None and not sure_TJ[:20].any() and sure_TJ[20:, 15:].all()
    with pytest.raises(UserError, match="no person 'Cid'"):
        read(tmp_path, ReadOptions(person="Cid"), Skeletons=both)


@pytest.mark.parametrize("prefix", ["", "Ann_"])
def test_markers_are_those_of_other_files(prefix: str, tmp_path: Path) -> None:
    told = markers(prefix)
    motion = read(tmp_path, Trajectories=told)
    assert motion.frame_rate == 150 and motion.source.startswith("recording of Qualisys Track Manager, 30 of 30 points")
    assert limbs_off(motion) < 4.0
    point_TK3 = told["Labeled"]["Data"][:, :3].transpose(2, 0, 1)
    labels = told["Labeled"]["Labels"][0].tolist()
    for content in (c3d(point_TK3, labels), qualisys(point_TK3, labels)):
        other = read_file(content, tmp_path, name="box.any")
        np.testing.assert_allclose(motion.arrays.local_TJ33, other.arrays.local_TJ33, atol=1e-3)


def test_people_have_their_names_before_a_low_line(tmp_path: Path) -> None:
    ann, ben = markers("Ann_")["Labeled"], markers("Ben_K_")["Labeled"]
    ben["Data"][:, :3, 30:] = np.nan
    both = {
        "Labels": np.concatenate([ann["Labels"], ben["Labels"]], axis=1),
        "Data": np.concatenate([ann["Data"], ben["Data"]]),
    }
    assert len(read(tmp_path, Trajectories={"Labeled": ann})) == 60
    motion = read(tmp_path, Trajectories={"Labeled": both})
    assert len(motion) == 60 and limbs_off(motion) < 4.0


def test_what_cannot_be_read_is_told(tmp_path: Path) -> None:
    nobody = {"Unidentified": {"Count": 1, "Data": np.zeros((1, 4, 60))}}
    with pytest.raises(NoMotion, match=r"box_1\.mat: is a recording of Qualisys Track Manager without skeletons and"):
        read(tmp_path, Trajectories=nobody)
    balls = {"Labeled": {"Labels": np.array(["ball", "bat"], dtype=object), "Data": np.ones((2, 4, 60))}}
    with pytest.raises(
        NoMotion, match="whose points are no markers or joints of a whole body .*: ball, bat; shoulders"
    ):
        read(tmp_path, Trajectories=balls)
    turning = skeleton()
    turning["PositionData"] = np.random.default_rng(0).normal(0, 100, turning["PositionData"].shape)
    with pytest.raises(NoMotion, match="'Ann' has limbs that do not keep their lengths.* global coordinates"):
        read(tmp_path, Skeletons=turning)
    two = np.array([{"FrameRate": 100, "Skeletons": skeleton(name)} for name in ("Ann", "Ben")], dtype=object)
    savemat(tmp_path / "both.mat", {"QTMmeasurements": two})
    motion = mrhubo.read_motion(tmp_path / "both.mat")
    assert motion.frame_rate == 100 and "there are 2 recordings in the file; the first is taken" in motion.notes[0]
