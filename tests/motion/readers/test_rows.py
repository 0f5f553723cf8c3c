"""Rows that two kinds of files have as wide are told apart by what is in them, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mrhubo.body.joints import JOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.body.rest_directions import from_family
from mrhubo.errors import UserError
from mrhubo.motion import Motion, ReadOptions, read_motion
from tests.motion.readers.estimator_files import matrices

FRAMES = 20
Z_UP = Rotation.from_euler("x", 90, degrees=True)


def walk() -> np.ndarray:
    """Axis-angle (T, 21, 3) of somebody who walks with hanging arms."""
    body, phase = np.zeros((FRAMES, 21, 3)), np.linspace(0, 2 * np.pi, FRAMES)
    joint = {name: place for place, name in enumerate(POSED_JOINT_NAMES)}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        body[:, joint[f"{side}_hip"], 0] = 0.4 * sign * np.sin(phase) - 0.1
        body[:, joint[f"{side}_knee"], 0] = 0.5 + 0.4 * sign * np.cos(phase)
        body[:, joint[f"{side}_shoulder"], 2] = -1.2 * sign
        body[:, joint[f"{side}_elbow"], 1] = -0.5 * sign
    body[:, joint["spine2"], 0], body[:, joint["neck"], 0] = 0.1, 0.1 * np.sin(phase)
    return body


def phuma(world: Rotation, height: float = 0.9) -> np.ndarray:
    """Rows (T, 69) of a walk in a world."""
    place = world.apply(np.column_stack((np.zeros(FRAMES), np.full(FRAMES, height), np.linspace(0, 3, FRAMES))))
    root = (world * Rotation.from_euler("y", np.linspace(0, 40, FRAMES)[:, None], degrees=True)).as_rotvec()
    return np.column_stack((place, root, walk().reshape(FRAMES, 63)))


def read(path: Path, rows: np.ndarray) -> Motion:
    np.save(path, rows)
    return read_motion(path, ReadOptions(rate=30))


def turns(motion: Motion) -> np.ndarray:
    """Angle (T, 21) of each joint [rad]."""
    local = motion.arrays.local_TJ33.astype(np.float64)
    return Rotation.from_matrix(local.reshape(-1, 3, 3)).magnitude().reshape(-1, 21)


@pytest.mark.parametrize("world", [Rotation.identity(), Z_UP])
@pytest.mark.parametrize("more", [0, 10])
def test_phumas_rows_have_a_pelvis_above_the_floor(tmp_path: Path, world: Rotation, more: int) -> None:
    motion = read(tmp_path / "a.npy", np.column_stack((phuma(world), np.full((FRAMES, more), 0.5))))
    assert motion.source.startswith("PHUMA") and motion.family == "smplx"
    assert motion.root_position_T3 is not None
    np.testing.assert_allclose(motion.root_position_T3[:, 1], 0.9, atol=1e-5)
    np.testing.assert_allclose(motion.root_position_T3[-1, 2], 3, atol=1e-5)


@pytest.mark.parametrize("more", [0, 10])
def test_rows_of_body_pose_are_no_place(tmp_path: Path, more: int) -> None:
    rows = np.column_stack((walk().reshape(FRAMES, 63), np.full((FRAMES, 6), 0.05), np.full((FRAMES, more), 0.5)))
    motion = read(tmp_path / "a.npy", rows)
    assert "SMPL's body_pose" in motion.source and motion.family == "smpl" and "taken for" in motion.notes[0]
    assert motion.root_position_T3 is None and motion.root_rotation_T33 is None
    assert (motion.betas is not None) == (more == 10)
    np.testing.assert_allclose(motion.arrays.local_TJ33, from_family(matrices(walk()), "smpl"), atol=1e-5)


def test_a_single_shoulder_that_turns_is_a_shoulder(tmp_path: Path) -> None:
    rows = np.zeros((FRAMES, 69))
    rows[:, 3 * POSED_JOINT_NAMES.index("left_shoulder") + 1] = np.linspace(-1, -0.2, FRAMES)
    np.save(tmp_path / "a.npy", rows)
    with pytest.raises(UserError, match="--rate"):
        read_motion(tmp_path / "a.npy")
    moved = np.ptp(turns(read(tmp_path / "a.npy", rows)), axis=0)
    assert moved.argmax() == JOINT_NAMES.index("left_shoulder") - 1 and (moved > 0.1).sum() == 1


def test_who_lies_on_the_floor_is_still_phumas(tmp_path: Path) -> None:
    assert read(tmp_path / "a.npy", phuma(Rotation.identity(), height=0.1)).source.startswith("PHUMA")


def test_numbers_that_are_not_finite_are_named(tmp_path: Path) -> None:
    rows = phuma(Z_UP)
    rows[3, 40] = np.nan
    with pytest.raises(UserError, match="'rows' is not finite in frame 3"):
        read(tmp_path / "a.npy", rows)


def test_rows_that_may_be_either_are_refused(tmp_path: Path) -> None:
    """Somebody in a T-pose; and one whose thigh is turned outward so far that its numbers could be a pelvis' place."""
    turned_out = np.column_stack((walk().reshape(FRAMES, 63), np.zeros((FRAMES, 6))))
    turned_out[:, 1] = 0.5
    for rows in (np.zeros((FRAMES, 69)), turned_out):
        with pytest.raises(UserError, match=r"a\.npy: .*may be PHUMA's .* or SMPL's body_pose .*'global_orient'"):
            read(tmp_path / "a.npy", rows)


@pytest.mark.parametrize("axes", [(), (1,)])
def test_talkshows_rows_begin_with_jaw_and_eyes(tmp_path: Path, axes: tuple[int, ...]) -> None:
    turned = Rotation.from_euler("y", np.linspace(0, 1, FRAMES)[:, None])
    root = (Rotation.from_euler("x", 180, degrees=True) * turned).as_rotvec()
    face = np.random.default_rng(0).normal(size=(FRAMES, 100))
    rows = np.column_stack((np.full((FRAMES, 9), 0.1), root, walk().reshape(FRAMES, 63), np.zeros((FRAMES, 90)), face))
    np.save(tmp_path / "a.npy", rows.reshape(*axes, *rows.shape))
    motion = read_motion(tmp_path / "a.npy")
    assert motion.family == "smplx" and motion.frame_rate == 30 and "TalkSHOW" in motion.notes[0]
    assert motion.root_rotation_T33 is not None and bool((motion.root_rotation_T33[:, 1, 1] > 0.99).all())
    np.testing.assert_allclose(motion.arrays.local_TJ33, from_family(matrices(walk()), "smplx"), atol=1e-5)


def test_other_rows_as_wide_as_talkshows_are_none(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no human motion"):
        read(tmp_path / "a.npy", np.random.default_rng(0).normal(size=(FRAMES, 265)))


def test_rows_of_pose_place_and_shape(tmp_path: Path) -> None:
    body, row = walk(), np.zeros((FRAMES, 85))
    row[:, 1], row[:, 3:66], row[:, 72:75], row[:, 75:] = 0.4, body.reshape(FRAMES, 63), [1.0, 0.9, 2.0], 0.5
    expected = from_family(matrices(body), "smpl")
    motion = read(tmp_path / "a.npy", row)
    np.testing.assert_allclose(motion.arrays.local_TJ33, expected, atol=1e-4)
    assert motion.family == "smpl" and motion.betas == (0.5,) * 10
    np.testing.assert_allclose(motion.arrays.root_position_T3, np.tile([1.0, 0.9, 2.0], (FRAMES, 1)), atol=1e-5)
    seen = read(tmp_path / "b.npy", np.concatenate([np.ones((FRAMES, 3)), row[:, :72], row[:, 75:]], axis=1))
    np.testing.assert_allclose(seen.arrays.local_TJ33, expected, atol=1e-4)
    assert seen.root_position_T3 is None
    with pytest.raises(UserError, match="no human motion"):
        read(tmp_path / "c.npy", np.random.default_rng(0).normal(size=(FRAMES, 85)))
