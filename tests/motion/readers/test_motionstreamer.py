"""Rows of 272 numbers tell poses, places and headings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mrhubo.body.rest_directions import from_family
from mrhubo.motion import read_motion
from mrhubo.motion.readers.content import NoMotion
from tests.motion.readers.estimator_files import made_up, matrices

FRAMES = 10


def six(matrix_X33: np.ndarray) -> np.ndarray:
    return matrix_X33[..., :2, :].reshape(*matrix_X33.shape[:-2], 6)


def test_a_walk_that_turns(tmp_path: Path) -> None:
    """Steps are as the heading before sees them, and the root is turned from the heading."""
    pose = made_up(FRAMES)
    world_TJ33 = matrices(pose).astype(np.float64)
    place = np.stack([np.linspace(0, 1, FRAMES) ** 2, np.full(FRAMES, 0.9), np.linspace(0, 2, FRAMES)], axis=1)
    heading = Rotation.from_euler("y", np.linspace(10, -70, FRAMES)[:, None], degrees=True).as_matrix()
    row = np.zeros((FRAMES, 272))
    since = heading.copy()
    since[1:] = heading[1:] @ heading[:-1].swapaxes(-1, -2)
    row[:, 2:8] = six(since)
    row[1:, [0, 1]] = np.einsum("tij,tj->ti", heading[:-1], np.diff(place, axis=0))[:, [0, 2]]
    row[:, 9] = place[:, 1]
    seen = world_TJ33.copy()
    seen[:, 0] = heading @ seen[:, 0]
    row[:, 140:] = six(seen).reshape(FRAMES, -1)
    np.save(tmp_path / "a.npy", row.astype(np.float32))
    motion = read_motion(tmp_path / "a.npy")
    root, where = motion.arrays.root_rotation_T33, motion.arrays.root_position_T3
    assert root is not None and where is not None and motion.frame_rate == 30 and motion.family == "smpl"
    np.testing.assert_allclose(motion.arrays.local_TJ33, from_family(matrices(pose[:, 1:]), "smpl"), atol=1e-5)
    np.testing.assert_allclose(root, world_TJ33[:, 0], atol=1e-5)
    np.testing.assert_allclose(where, place, atol=1e-5)


def test_rows_that_were_normalised_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.random.default_rng(0).normal(size=(FRAMES, 272)))
    with pytest.raises(NoMotion, match="normalised"):
        read_motion(tmp_path / "a.npy")
