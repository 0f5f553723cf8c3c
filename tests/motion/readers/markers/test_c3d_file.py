"""C3D files of all three kinds of processors."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from mrhubo import UserError
from mrhubo.motion.readers.markers.c3d_file import read_c3d_file
from tests.motion.marker_writer import Manner, c3d

_LABELS = [f"M{number:03}" for number in range(40)]


def points() -> np.ndarray:
    """Points (T, K, 3) in millimetres, some of which are not seen."""
    point_TK3 = np.random.default_rng(0).uniform(-1500, 1500, (25, len(_LABELS), 3)).round(1)
    point_TK3[3:6, 7] = np.nan
    return point_TK3


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize("is_whole", [False, True])
def test_points_labels_and_rate_come_back(processor: int, is_whole: bool, tmp_path: Path) -> None:
    path = tmp_path / "walk.c3d"
    path.write_bytes(c3d(points(), _LABELS, Manner(processor, is_whole, rate=59.94)))
    file = read_c3d_file(path)
    np.testing.assert_allclose(file.point_TK3, points(), atol=1e-3)
    assert list(file.names) == _LABELS and file.frames_told == 25
    assert file.rate == pytest.approx(59.94, rel=1e-6)


def test_labels_in_several_parameters_and_none_at_all(tmp_path: Path) -> None:
    path = tmp_path / "walk.c3d"
    path.write_bytes(c3d(points(), _LABELS, Manner(labels_a_parameter=15)))
    assert list(read_c3d_file(path).names) == _LABELS
    path.write_bytes(c3d(points(), _LABELS).replace(b"LABELS", b"LABELZ"))
    assert read_c3d_file(path).names == ("",) * len(_LABELS)


def test_more_frames_than_the_header_counts(tmp_path: Path) -> None:
    path = tmp_path / "long.c3d"
    point_TK3 = np.zeros((66_000, 1, 3)) + np.arange(66_000)[:, None, None]
    path.write_bytes(c3d(point_TK3, ["A"], Manner(analog=0, long=True)))
    file = read_c3d_file(path)
    assert file.point_TK3.shape == (66_000, 1, 3) and file.point_TK3[-1, 0, 0] == 65_999


def test_frames_that_were_cut_off_are_left_out(tmp_path: Path) -> None:
    path, good = tmp_path / "walk.c3d", c3d(points(), _LABELS, Manner(analog=0))
    path.write_bytes(good[: -(len(good) - 512 * 2) // 2])
    file = read_c3d_file(path)
    assert 5 < len(file.point_TK3) < 25 and file.frames_told == 25
    np.testing.assert_allclose(file.point_TK3, points()[: len(file.point_TK3)], atol=1e-3)


@pytest.mark.parametrize(
    ("at", "data", "said"),
    [
        (515, b"\x50", "of no processor that is known"),
        (0, b"\xff", "parameters are not where its header says"),
        (None, b"", "ends within its header"),
        (1024, b"", "has no frame of its 40 points"),
    ],
)
def test_what_is_refused_is_told(at: int | None, data: bytes, said: str, tmp_path: Path) -> None:
    path, good = tmp_path / "walk.c3d", c3d(points(), _LABELS)
    cut = good[: at or 600]
    path.write_bytes(cut if not data else good[:at] + data + good[(at or 0) + len(data) :])
    with pytest.raises(UserError, match=said):
        read_c3d_file(path)


def test_no_points(tmp_path: Path) -> None:
    path, good = tmp_path / "forces.c3d", c3d(points(), _LABELS)
    used = good.index(b"USED") + len(b"USED") + 4
    path.write_bytes(good[:2] + struct.pack("<H", 0) + good[4:used] + struct.pack("<H", 0) + good[used + 2 :])
    with pytest.raises(UserError, match="without points"):
        read_c3d_file(path)
