"""TRC files of cameras without markers tell what the same points do in an array."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from mrhubo import UserError
from mrhubo.body.joints import KEYPOINT_NAMES, REST_K3
from mrhubo.motion import Motion, ReadOptions, read_motion
from tests.motion.damage import Step, accidents, damaged, read_or_refused

REST = dict(zip(KEYPOINT_NAMES, REST_K3, strict=True))
_SIDES = {"R": "right", "L": "left"}
_PARTS = ("Hip", "Knee", "Ankle", "BigToe", "SmallToe", "Heel", "Shoulder", "Elbow", "Wrist")
HALPE = ("Hip", *(f"{side}{part}" for side in "RL" for part in _PARTS[:6]), "Neck", "Head", "Nose",
         *(f"{side}{part}" for side in "RL" for part in _PARTS[6:]))  # fmt: skip
"""Pose2Sim's names of Halpe's points, in its order."""
FRAMES = 12


def places(names: Sequence[str] = HALPE) -> np.ndarray:
    """Points (T, K, 3) [m] of somebody who raises both forearms and walks off."""
    found = []
    for name in names:
        side, part = _SIDES.get(name[0], ""), name[1:].lower()
        if name == "Hip":
            place = (REST["left_hip"] + REST["right_hip"]) / 2
        elif name in ("Neck", "Head", "Nose"):
            beyond = {"Neck": [0, 0, 0], "Head": [0, 0.18, 0.01], "Nose": [0, 0.04, 0.11]}[name]
            place = REST["neck" if name == "Neck" else "head"] + beyond
        elif part in ("bigtoe", "smalltoe"):
            place = REST[f"{side}_toe"] + [0.02 * (part == "bigtoe"), 0, 0]
        else:
            place = REST[f"{side}_{part}"]
        found.append(np.tile(place + np.array([0, 1.0, 0]), (FRAMES, 1)))
        time_T = np.arange(FRAMES) / 30
        if part == "wrist":
            elbow = REST[f"{side}_elbow"] + [0, 1.0, 0]
            found[-1] = elbow + 0.26 * np.stack([0 * time_T, np.sin(3 * time_T), np.cos(3 * time_T)], 1)
        found[-1] = found[-1] + np.stack([0 * time_T, 0 * time_T, time_T], 1)
    return np.stack(found, axis=1)


def trc(
    point_TK3: np.ndarray, names: Sequence[str] = HALPE, unit: str = "m", rate: str = "30", first: int = 1,
    keeps_empty: bool = True, end: str = "\n", comma: bool = False,
) -> str:  # fmt: skip
    """As Pose2Sim writes it; not known where NaN."""
    rows = []
    for frame, point_K3 in enumerate(point_TK3):
        words = ["" if np.isnan(x) else f"{x:.6f}" for x in point_K3.reshape(-1)]
        row = "\t".join([str(first + frame), f"{frame / 30:.5f}", *words])
        rows.append((row if keeps_empty else row.rstrip("\t")).replace(*".," if comma else ".."))
    header = [
        "PathFileType\t4\t(X/Y/Z)\tdemo.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{len(rows)}\t{len(names)}\t{unit}\t{rate}\t{first}\t{len(rows)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{n}" for n in range(1, len(names) + 1) for axis in "XYZ"),
    ]
    return end.join([*header, *rows, ""])


def read(path: Path, text: str) -> Motion:
    path.write_bytes(text.encode())
    return read_motion(path)


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Motion:
    path = tmp_path_factory.mktemp("whole") / "a.npz"
    names = ["head_top" if name == "Head" else name for name in HALPE]
    np.savez(path, keypoints=places(), names=names, fps=30.0)
    return read_motion(path)


@pytest.mark.parametrize(
    "style",
    [
        {},
        {"first": 241},
        {"keeps_empty": False, "end": "\r\n"},
        {"comma": True},
        {"end": "\n\n"},
    ],
)
def test_it_is_the_motion_of_the_same_points(style: dict, expected: Motion, tmp_path: Path) -> None:
    motion = read(tmp_path / "a.trc", trc(places(), **style))
    assert motion.frame_rate == 30 and len(motion) == FRAMES
    np.testing.assert_allclose(motion.arrays.local_TJ33, expected.arrays.local_TJ33, atol=1e-4)
    root_T3, expected_T3 = motion.arrays.root_position_T3, expected.arrays.root_position_T3
    assert root_T3 is not None and expected_T3 is not None
    np.testing.assert_allclose(root_T3, expected_T3, atol=1e-4)
    assert np.ptp(root_T3[:, 2]) > 0.3


def test_millimetres_and_other_axes_are_found_by_the_body(expected: Motion, tmp_path: Path) -> None:
    turned = places()[..., [0, 2, 1]] * [1, -1, 1]
    motion = read(tmp_path / "a.trc", trc(1000 * turned, unit="mm"))
    np.testing.assert_allclose(motion.arrays.local_TJ33, expected.arrays.local_TJ33, atol=1e-3)


def test_empty_places_are_points_that_nobody_sees(expected: Motion, tmp_path: Path) -> None:
    point_TK3, missing = places(), HALPE.index("LWrist")
    assert missing == len(HALPE) - 1  # at the end of its lines, where programs leave empty columns out
    point_TK3[4:6, missing] = np.nan
    motion = read(tmp_path / "a.trc", trc(point_TK3, keeps_empty=False))
    sure_TJ, elbow = motion.arrays.confidence_TJ, 17
    assert sure_TJ is not None and np.flatnonzero(sure_TJ[:, elbow] < 0.5).tolist() == [4, 5]
    np.testing.assert_allclose(motion.arrays.local_TJ33[:4], expected.arrays.local_TJ33[:4], atol=1e-4)


def test_lines_that_are_missing_are_frames_in_which_nobody_is_seen(tmp_path: Path) -> None:
    lines = trc(places()).splitlines()
    motion = read(tmp_path / "a.trc", "\n".join(lines[:8] + lines[10:]))
    sure_TJ = motion.arrays.confidence_TJ
    assert len(motion) == FRAMES and sure_TJ is not None
    assert np.flatnonzero(sure_TJ.max(axis=1) == 0).tolist() == [3, 4]


def test_the_rate_is_asked_for_where_it_is_not_told(tmp_path: Path) -> None:
    path = tmp_path / "a.trc"
    for rate in ("", "0", "nan", "x"):
        with pytest.raises(UserError, match="--rate"):
            read(path, trc(places(), rate=rate))
    assert read_motion(path, ReadOptions(rate=25.0)).frame_rate == 25


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (trc(places()[:, :3], ("r.ASIS", "l.ASIS", "C7")), "no joints: C7, l.ASIS, r.ASIS; .*MoSh"),
        ("PathFileType\t4\n", "ends within its header"),
        (trc(places()[:0]), "a header and no frames"),
        (trc(places()).replace("\t0.", "\tx.", 1), "frame 0 holds 'x.* under 'Time', no number"),
        (trc(places()) + "13\t0.4" + "\t1" * 90, "frame 12 has 92 columns, and the header 68"),
        (trc(places()).replace("\n2\t", "\n1\t"), "same number"),
        (trc(places()).replace("\n12\t", "\n1200\t"), "12 frames, numbered from 0 to 1,199"),
    ],
)
def test_what_is_wrong_is_said(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=words):
        read(tmp_path / "a.trc", text)


@given(steps=accidents)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_read_or_refused_in_a_sentence(steps: list[Step], tmp_path: Path) -> None:
    (tmp_path / "a.trc").write_bytes(damaged(trc(places()[:3]).encode(), steps))
    read_or_refused(tmp_path / "a.trc")
