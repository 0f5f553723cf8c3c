"""Soles that are rolled by a constant where they stand, which other skeletons' are, are found and made level."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.foot_axes import foot_rolls, level_feet, sole_rolls
from mrhubo.body.joints import POSED_JOINT_NAMES
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.motion import read_motion

RATE = 60.0
Walk = tuple[np.ndarray, np.ndarray, np.ndarray]


def turns(axis: tuple[float, float, float], angle_T: np.ndarray) -> np.ndarray:
    return axis_angle_to_matrix(angle_T[:, None] * np.array(axis))


def made_up_walk(rolled_deg: tuple[float, float] = (0.0, 0.0)) -> Walk:
    """Steps on the spot: each foot in turn is lifted for half a second and stands for as long, level but for a roll."""
    time_T = np.arange(360) / RATE
    local_TJ33 = np.tile(np.eye(3), (len(time_T), 21, 1, 1))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        bend_T = 0.9 * np.maximum(sign * np.sin(2 * np.pi * time_T), 0.0) ** 2
        for name, share in (("hip", -1.0), ("knee", 2.0), ("ankle", -1.0)):
            local_TJ33[:, POSED_JOINT_NAMES.index(f"{side}_{name}")] = turns((1.0, 0.0, 0.0), share * bend_T)
    heading_T33 = np.tile(axis_angle_to_matrix(np.array([0.0, 0.7, 0.0])), (len(time_T), 1, 1))
    rolls = {side: -math.radians(deg) for side, deg in zip(("left", "right"), rolled_deg, strict=True)}
    return level_feet(local_TJ33, rolls), heading_T33, np.zeros((len(time_T), 3))


def test_a_constant_roll_is_found_and_taken_out() -> None:
    rolled, *root = made_up_walk((12.0, -7.0))
    found = foot_rolls(rolled, root[0], root[1], RATE)
    assert {side: math.degrees(roll) for side, roll in found.items()} == pytest.approx({"left": 12.0, "right": -7.0})
    level = level_feet(rolled, found)
    np.testing.assert_allclose(level, made_up_walk()[0], atol=1e-6)
    for roll_X in sole_rolls(level, root[0], root[1], RATE).values():
        assert len(roll_X) > 60 and np.abs(roll_X).max() < 1e-6


def test_only_ankles_turn_and_feet_point_as_before() -> None:
    rolled, *_ = made_up_walk((12.0, -7.0))
    level, before = rolled, made_up_walk()[0]
    for joint, name in enumerate(POSED_JOINT_NAMES):
        same = np.allclose(level[:, joint], before[:, joint])
        assert same != name.endswith("ankle"), name
    bone_3 = np.array([0.0, -0.04, 0.119])
    for side in ("left", "right"):
        ankle = POSED_JOINT_NAMES.index(f"{side}_ankle")
        np.testing.assert_allclose(level[:, ankle] @ bone_3, before[:, ankle] @ bone_3, atol=2e-3)


def test_a_foot_that_a_person_rolls_now_so_now_otherwise_stays() -> None:
    local, *root = made_up_walk()
    ankle = POSED_JOINT_NAMES.index("left_ankle")
    half = len(local) // 2
    local[:half, ankle] = level_feet(local, {"left": 0.3})[:half, ankle]
    assert "left" not in foot_rolls(local, root[0], root[1], RATE)
    assert foot_rolls(local[:1], root[0][:1], root[1][:1], RATE) == {}


def test_own_motions_stay_as_they_are(root: Path) -> None:
    """Their soles are level, as those of SMPL's files."""
    for name in ("boxing", "wave"):
        motion = read_motion(root / "data" / "motions" / f"{name}.npz")
        assert not any("sole" in note for note in motion.notes)


def test_cmu_recordings(root: Path) -> None:
    """One conversion rolls the soles, and says so; another has level ones, which stay."""
    folder = root / "data" / "external" / "cmu"
    if not folder.is_dir():
        pytest.skip("the CMU recordings are not here")
    for name, rolled_deg in (("13_08", (-12.0, 13.0)), ("15_08", (-19.0, 18.0)), ("56_02", (-7.0, 11.0))):
        motion = read_motion(folder / "evaluation" / f"{name}.npz")
        (note,) = [note for note in motion.notes if "sole" in note]
        assert all(f"by {deg:.0f}" in note for deg in rolled_deg)
        arrays = motion.arrays
        assert arrays.root_rotation_T33 is not None and arrays.root_position_T3 is not None
        after = sole_rolls(arrays.local_TJ33, arrays.root_rotation_T33, arrays.root_position_T3, motion.frame_rate)
        assert max(abs(math.degrees(float(np.median(roll_X)))) for roll_X in after.values()) < 0.1
    for path in sorted((folder / "whole_body").glob("*.npz")):
        assert not any("sole" in note for note in read_motion(path).notes), path.name
