"""SMPL's rotations in an array without a name are no points, and points no rotations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.joints import OFFSETS_J3, PARENTS
from mrhubo.errors import UserError
from mrhubo.fast.rotations import matrix_to_axis_angle
from mrhubo.motion import ReadOptions, read_motion

RATE = ReadOptions(rate=60.0)


@pytest.fixture(scope="module", params=["boxing", "wave", "conversation", "pointing"])
def matrices(root: Path, request: pytest.FixtureRequest) -> np.ndarray:
    """Rotations (T, 22, 3, 3) of people whose legs hardly move, whose turns keep their lengths as bones do."""
    local_TJ33 = np.asarray(read_motion(root / "data" / "motions" / f"{request.param}.npz").local_TJ33)[::4]
    turn_T33 = np.tile(np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]), (len(local_TJ33), 1, 1))
    return np.concatenate((turn_T33[:, None], local_TJ33), axis=1)


def saved(path: Path, array: np.ndarray) -> Path:
    np.save(path / "bare.npy", array.astype(np.float32))
    return path / "bare.npy"


@pytest.mark.parametrize("joints", [22, 24, 52, 55])
@pytest.mark.parametrize("form", ["rows", "joints", "matrices", "one"])
def test_they_are_as_with_a_name(matrices: np.ndarray, joints: int, form: str, tmp_path: Path) -> None:
    turn_TK33 = np.tile(np.eye(3), (len(matrices), joints, 1, 1))
    turn_TK33[:, :22] = matrices
    axis_TK3 = matrix_to_axis_angle(turn_TK33)
    array = {"rows": axis_TK3.reshape(len(axis_TK3), -1), "joints": axis_TK3, "matrices": turn_TK33}.get(form)
    found = read_motion(saved(tmp_path, axis_TK3[None] if array is None else array), RATE)
    np.savez(tmp_path / "named.npz", fullpose=axis_TK3.reshape(len(axis_TK3), -1).astype(np.float32))
    named = read_motion(tmp_path / "named.npz", RATE)
    np.testing.assert_allclose(found.local_TJ33, named.local_TJ33, atol=1e-5)
    assert found.root_rotation_T33 is not None and named.root_rotation_T33 is not None
    np.testing.assert_allclose(found.root_rotation_T33, named.root_rotation_T33, atol=1e-5)
    assert found.family == named.family and "without a name" in found.source


def test_points_stay_points(matrices: np.ndarray, tmp_path: Path) -> None:
    turn_TJ33, place_TJ3 = matrices.copy(), np.zeros((len(matrices), 22, 3))
    for joint in range(1, 22):
        parent = PARENTS[joint]
        turn_TJ33[:, joint] = turn_TJ33[:, parent] @ matrices[:, joint]
        place_TJ3[:, joint] = place_TJ3[:, parent] + turn_TJ33[:, parent] @ OFFSETS_J3[joint - 1]
    rng = np.random.default_rng(0)
    for size, noise in ((1.0, 0.0), (1.0, 0.02), (0.1, 0.002), (100.0, 2.0)):
        array = size * place_TJ3 + rng.normal(0, noise, place_TJ3.shape)
        assert "keypoints" in read_motion(saved(tmp_path, array), RATE).source
        with pytest.raises(UserError, match="no human motion that is known"):  # rows may be rotations
            read_motion(saved(tmp_path, array.reshape(len(array), -1)), RATE)


def test_what_makes_no_body_is_refused(matrices: np.ndarray, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    for array in (
        rng.normal(0, 1, (50, 72)),
        np.full((5, 66), np.nan),
        rng.normal(0, 1, (20, 24, 3, 3)),
        np.ones((0, 72)),
    ):
        with pytest.raises(UserError):
            read_motion(saved(tmp_path, array), RATE)
    axis_TK3 = matrix_to_axis_angle(matrices)
    with pytest.raises(UserError, match="--rate"):
        read_motion(saved(tmp_path, axis_TK3.reshape(len(axis_TK3), -1)))
