"""Six numbers a joint, and quaternions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo import UserError
from mrhubo.motion import ReadOptions, read_motion
from tests.motion.readers.estimator_files import egoallo, made_up, mdm

RATE = ReadOptions(rate=20.0)


def test_an_array_of_momask_is_that_of_mdm(tmp_path: Path) -> None:
    pose = made_up(7)
    mdm(tmp_path / "a.npy", {0: pose})
    content = np.load(tmp_path / "a.npy", allow_pickle=True).item()
    np.save(tmp_path / "b.npy", content["motion"][None].astype(np.float32))
    one, other = (read_motion(tmp_path / name, RATE) for name in ("a.npy", "b.npy"))
    np.testing.assert_allclose(other.arrays.local_TJ33, one.arrays.local_TJ33, atol=1e-5)
    for found, expected in zip(other.arrays.__dict__.values(), one.arrays.__dict__.values(), strict=True):
        assert (found is None) == (expected is None)
    np.testing.assert_allclose(other.arrays.root_position_T3, np.ones((7, 3)), atol=1e-6)


def test_times_of_egoallo_tell_its_rate(tmp_path: Path) -> None:
    egoallo(tmp_path / "a.npz", {0: made_up(7)})
    assert read_motion(tmp_path / "a.npz").frame_rate == 30.0


@pytest.mark.parametrize("key", ["body_quats", "Ts_world_root"])
def test_quaternions_that_are_none_are_said(key: str, tmp_path: Path) -> None:
    """Those of the body are needed; a root is left out."""
    egoallo(tmp_path / "a.npz", {0: made_up(7)})
    content = dict(np.load(tmp_path / "a.npz"))
    content[key][0, 3] = 0
    np.savez(tmp_path / "a.npz", **content)
    if key == "body_quats":
        with pytest.raises(UserError, match="'body_quats' is not finite in frame 3"):
            read_motion(tmp_path / "a.npz")
    else:
        motion = read_motion(tmp_path / "a.npz")
        assert motion.root_rotation_T33 is None and "root's rotation is left out" in motion.notes[0]


@pytest.mark.parametrize("six", [np.zeros(6), np.array([1.0, 0, 0, 1, 0, 0]), np.full(6, np.nan)])
def test_six_numbers_that_are_no_rotation_are_said(six: np.ndarray, tmp_path: Path) -> None:
    mdm(tmp_path / "a.npy", {0: made_up(7)})
    content = np.load(tmp_path / "a.npy", allow_pickle=True).item()
    content["thetas"][5, :, 2] = six
    np.save(tmp_path / "a.npy", content)
    with pytest.raises(UserError, match="'thetas' is .* in frame 2"):
        read_motion(tmp_path / "a.npy", RATE)
