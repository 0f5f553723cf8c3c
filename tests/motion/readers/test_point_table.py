"""Tables with a line a point tell what those with a line a frame do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from mrhubo import UserError
from mrhubo.body.joints import KEYPOINT_NAMES, REST_K3
from mrhubo.motion import Motion, ReadOptions, read_motion
from mrhubo.motion.readers.keypoint_sets import SETS
from tests.motion.damage import Step, accidents, damaged, read_or_refused

FRAMES = 9
NAMES = [name for name in SETS["MediaPipe"] if name != "-"]
REST = dict(zip(KEYPOINT_NAMES, REST_K3, strict=False))


def places(shift: float = 0.0) -> np.ndarray:
    """Points (T, K, 3) of MediaPipe of somebody at rest who raises both forearms."""
    rest = {"nose": REST["head"] + [0, 0.04, 0.11], "left_ear": REST["head"] + [0.07, 0.05, 0],
            "right_ear": REST["head"] + [-0.07, 0.05, 0]}  # fmt: skip
    rows = np.stack([(REST | rest).get(name, REST["head"]) for name in SETS["MediaPipe"]])
    point_TK3 = np.tile(rows + [shift, 1.0, 0], (FRAMES, 1, 1))
    for side in ("left", "right"):
        elbow, wrist = (SETS["MediaPipe"].index(f"{side}_{name}") for name in ("elbow", "wrist"))
        point_TK3[:, wrist] = point_TK3[:, elbow] + np.stack(
            [np.zeros(FRAMES), 0.26 * np.sin(np.arange(FRAMES) / 5), 0.26 * np.cos(np.arange(FRAMES) / 5)], 1
        )
    return point_TK3


def lines(point_TK3: np.ndarray, names: list[str] | None = None, before: str = "", frames: range | None = None) -> list:
    return [
        f"{t},{before}{k if names is None else names[k]},{x:.6f},{y:.6f},{z:.6f},0.9"
        for t, row in enumerate(point_TK3)
        if frames is None or t in frames
        for k, (x, y, z) in enumerate(row)
    ]


def written(path: Path, header: str, rows: list[str], person: str | None = None) -> Motion:
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_motion(path, ReadOptions(rate=30.0, person=person))


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    path = tmp_path_factory.mktemp("whole") / "a.npy"
    np.save(path, places())
    return read_motion(path, ReadOptions(rate=30.0)).arrays.local_TJ33


def is_it(motion: Motion, expected: np.ndarray) -> bool:
    return len(motion) == FRAMES and np.allclose(motion.arrays.local_TJ33, expected, atol=1e-4)


def test_points_by_number_or_name_in_any_order(expected: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = lines(places())
    shuffled = [rows[n] for n in np.random.default_rng(0).permutation(len(rows))]
    for each in (rows, shuffled):
        assert is_it(written(path, "frame,landmark_id,x,y,z,visibility", each), expected)
    called = [name if name != "-" else f"mouth{n}" for n, name in enumerate(SETS["MediaPipe"])]
    named = lines(places(), called)
    assert is_it(written(path, "Frame,keypoint,X [m],Y [m],Z [m],confidence", named), expected)
    german = [row.replace(",", ";").replace(".", ",") for row in named]
    assert is_it(written(path, "frame;name;x;y;z;score", german), expected)
    with pytest.raises(UserError, match="--rate"):
        read_motion(path)


def test_each_of_two_people(expected: np.ndarray, tmp_path: Path) -> None:
    rows = lines(places(), before="5,") + lines(places(2.0), before="3,", frames=range(4))
    header = "frame,person_id,landmark,x,y,z,visibility"
    motion = written(tmp_path / "a.csv", header, rows)
    assert is_it(motion, expected) and "'5' (9 frames), '3' (4 frames)" in motion.notes[0]
    assert len(written(tmp_path / "a.csv", header, rows, "3")) == 4


def test_gaps_stay_gaps(tmp_path: Path) -> None:
    rows = [row for row in lines(places()) if not row.startswith(("4,", "5,"))]
    motion = written(tmp_path / "a.csv", "frame,landmark_id,x,y,z,visibility", rows)
    sure = motion.arrays.confidence_TJ
    assert sure is not None and np.flatnonzero(sure.max(axis=1) == 0).tolist() == [4, 5]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: [], "a header and no points"),
        (lambda rows: [*rows, rows[0]], "'0' of frame 0 once more"),
        (lambda rows: [*rows[:3], "0,3,1,x,1,1", *rows[4:]], "line 5 holds 'x' for y"),
        (lambda rows: ["a,0,1,1,1,1", *rows], "line 2 holds 'a' for frame"),
        (lambda rows: ["0,0", *rows], "line 2 has 2 columns"),
    ],
)
def test_what_is_wrong_is_said(change, words: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=words):
        written(tmp_path / "a.csv", "frame,landmark_id,x,y,z,visibility", change(lines(places())))


@given(steps=accidents)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_tables_are_read_or_refused_in_a_sentence(steps: list[Step], tmp_path: Path) -> None:
    rows = lines(places()[:3])
    text = "\n".join(["frame,landmark_id,x,y,z,visibility", *rows])
    (tmp_path / "a.csv").write_bytes(damaged(text.encode(), steps))
    read_or_refused(tmp_path / "a.csv")
