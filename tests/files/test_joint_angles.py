"""Joint angles come back from the files as they went in, with names, unit and time, and nothing half-written stays."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.files.joint_angles import write_joint_angles

NAMES = ("left, elbow", "head")
Q = np.array([[0.1, -1.5], [1 / 3, 2.0], [0.0, 1e-9]], dtype=np.float32)
MORE = {
    "confidence": np.array([0.5, 1.0, 0.25], np.float32),
    "hits": np.array([True, False, True]),
    "wide": Q[:, :, None],
}


def test_npz_needs_no_pickle(tmp_path: Path) -> None:
    write_joint_angles(tmp_path / "new" / "a.npz", Q, NAMES, 30.0, MORE)
    with np.load(tmp_path / "new" / "a.npz", allow_pickle=False) as file:
        found = dict(file)
    np.testing.assert_array_equal(found["q"], Q)
    assert found["joint_names"].tolist() == list(NAMES) and str(found["unit"]) == "rad"
    assert float(found["frame_rate"]) == 30.0
    for name, array in MORE.items():
        np.testing.assert_array_equal(found[name], array)
    write_joint_angles(tmp_path / "b.npz", Q, NAMES, None, {})
    with np.load(tmp_path / "b.npz", allow_pickle=False) as file:
        assert "frame_rate" not in file
    write_joint_angles(tmp_path / "c.npz", Q, NAMES, 30.0, MORE)
    assert (tmp_path / "c.npz").read_bytes() == (tmp_path / "new" / "a.npz").read_bytes()


@pytest.mark.parametrize("rate", [30.0, None])
def test_csv_has_a_header_and_a_row_a_frame(tmp_path: Path, rate: float | None) -> None:
    write_joint_angles(tmp_path / "a.csv", Q, NAMES, rate, MORE)
    with open(tmp_path / "a.csv", newline="") as handle:
        header, *rows = list(csv.reader(handle))
    assert header == ["frame" if rate is None else "time [s]", "left, elbow [rad]", "head [rad]", "confidence", "hits"]
    numbers = np.array(rows, dtype=np.float64)
    np.testing.assert_array_equal(numbers[:, 0], np.arange(3) / (rate or 1))
    np.testing.assert_array_equal(numbers[:, 1:3].astype(np.float32), Q)
    np.testing.assert_array_equal(numbers[:, 3:], np.stack([MORE["confidence"], MORE["hits"]], axis=1))


def test_a_pose_is_one_row_and_no_frame_none(tmp_path: Path) -> None:
    one = {"confidence": np.float32(0.5).reshape(())}
    write_joint_angles(tmp_path / "one.csv", Q[0], NAMES, None, one)
    assert (tmp_path / "one.csv").read_text().splitlines()[1:] == ["0,0.1,-1.5,0.5"]
    write_joint_angles(tmp_path / "none.csv", Q[:0], NAMES, 30.0, {"confidence": np.zeros(0)})
    assert (tmp_path / "none.csv").read_text() == 'time [s],"left, elbow [rad]",head [rad],confidence\n'


def test_mistakes_leave_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"a\.txt: the name must end in \.npz or \.csv"):
        write_joint_angles(tmp_path / "a.txt", Q, NAMES, 30.0, {})
    with pytest.raises(UserError, match=r"one motion, found joint angles of shape \(1, 3, 2\); use \.npz"):
        write_joint_angles(tmp_path / "a.csv", Q[None], NAMES, 30.0, {})
    assert not list(tmp_path.iterdir())
