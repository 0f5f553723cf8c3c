"""Rows of InterHuman's two people, one by one and both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.joints import REST_K3
from mrhubo.motion import Motion, ReadOptions, read_motion
from mrhubo.motion.readers.content import NoMotion

FRAMES = 12
REST = REST_K3[:22].astype(np.float64)
Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def joints(person: int) -> np.ndarray:
    """Somebody (T, 22, 3) who walks and raises the left forearm, or the right one."""
    points = np.tile(REST + [2.0 * person, 1.0, 0], (FRAMES, 1, 1))
    points[:, 21 - (person == 0)] = points[:, 19 - (person == 0)] + [0, 0.26, 0]
    points[..., 2] += np.linspace(0, 1, FRAMES)[:, None]
    return points


def row(person: int, width: int) -> np.ndarray:
    points = joints(person) @ Z_UP.T if width == 492 else joints(person)
    return np.pad(points.reshape(FRAMES, 66), ((0, 0), (0, width - 66)), constant_values=0.25)


def is_of(motion: Motion, person: int) -> bool:
    """By which arm is bent; the root goes forward."""
    place = motion.arrays.root_position_T3
    assert place is not None and motion.frame_rate == 30
    np.testing.assert_allclose(place[-1] - place[0], [0, 0, 1], atol=1e-3)
    turns = [np.trace(motion.arrays.local_TJ33[0, joint - 1]) for joint in (18, 19)]
    return int(np.argmin(turns)) == person


@pytest.mark.parametrize("width", [492, 262])
def test_a_row_is_a_persons(width: int, tmp_path: Path) -> None:
    for person in (0, 1):
        np.save(tmp_path / "a.npy", row(person, width).astype(np.float32))
        assert is_of(read_motion(tmp_path / "a.npy"), person)


@pytest.mark.parametrize("width", [492, 262])
@pytest.mark.parametrize("axis", [0, 1, -1])
def test_both_people_go_by_number(axis: int, width: int, tmp_path: Path) -> None:
    rows = [row(person, width) for person in (0, 1)]
    if axis == -1 and width == 492:
        return  # nobody writes so
    np.save(tmp_path / "a.npy", np.concatenate(rows, -1) if axis == -1 else np.stack(rows, axis))
    assert is_of(read_motion(tmp_path / "a.npy"), 0) and "'1' (12 frames)" in read_motion(tmp_path / "a.npy").notes[0]
    for person in (0, 1):
        assert is_of(read_motion(tmp_path / "a.npy", ReadOptions(person=str(person))), person)


@pytest.mark.parametrize("width", [492, 262, 524])
def test_rows_that_make_no_body_are_refused(width: int, tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.random.default_rng(0).normal(size=(FRAMES, width)))
    with pytest.raises(NoMotion, match="normalised"):
        read_motion(tmp_path / "a.npy")
