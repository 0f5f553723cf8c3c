"""Rows of six numbers a joint, as models of dances have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.rest_directions import from_family
from mrhubo.motion import ReadOptions, read_motion
from mrhubo.motion.readers.content import NoMotion
from tests.motion.readers.estimator_files import finedance, made_up, matrices, padded

FRAMES = 8


def test_contacts_may_stand_before_the_place(tmp_path: Path) -> None:
    pose = made_up(FRAMES)
    for contacts in (False, True):
        finedance(tmp_path / "a.npy", {0: pose}, contacts)
        motion = read_motion(tmp_path / "a.npy")
        assert motion.frame_rate == 30 and motion.family == "smplx" and "FineDance" in motion.notes[0]
        np.testing.assert_allclose(motion.arrays.local_TJ33, from_family(matrices(pose[:, 1:]), "smplx"), atol=1e-5)
        np.testing.assert_allclose(motion.arrays.root_position_T3, np.ones((FRAMES, 3)), atol=1e-6)


def test_edge_has_the_joints_of_smpl(tmp_path: Path) -> None:
    pose = made_up(FRAMES)
    six = matrices(padded(pose, 24).reshape(FRAMES, 24, 3))[:, :, :2].reshape(FRAMES, 144)
    np.save(tmp_path / "a.npy", np.concatenate([np.zeros((FRAMES, 4)), np.ones((FRAMES, 3)), six], axis=1)[None])
    motion = read_motion(tmp_path / "a.npy", ReadOptions(rate=60))
    assert motion.frame_rate == 60 and motion.family == "smpl"
    np.testing.assert_allclose(motion.arrays.local_TJ33, from_family(matrices(pose[:, 1:]), "smpl"), atol=1e-5)


@pytest.mark.parametrize("width", [315, 319, 151])
def test_rows_that_were_normalised_are_refused(width: int, tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.random.default_rng(0).normal(size=(FRAMES, width)))
    with pytest.raises(NoMotion, match="normalised"):
        read_motion(tmp_path / "a.npy")
