"""Xsens' segments, as Nymeria has them: turns of the trunk, head, hands and feet, and where limbs begin."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mrhubo
from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES, OFFSETS_J3, PARENTS
from mrhubo.fast.rotations import angles_between, axis_angle_to_matrix
from mrhubo.motion import Motion

FRAMES = 12
TO_ROBOT = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_LIMBS = [("collar", "shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "foot")]
JOINTS = ["pelvis", "spine1", "spine1", "spine2", "spine3", "neck", "head"]
JOINTS += [f"{side}_{joint}" for limb in _LIMBS for side in ("right", "left") for joint in limb]
"""Ours that stand for Xsens' segments, in their order."""


def body() -> tuple[np.ndarray, np.ndarray]:
    """Places (T, 22, 3) and turns (T, 22, 3, 3) of our skeleton's joints in our world, y up."""
    generator = np.random.default_rng(0)
    world_TJ33 = axis_angle_to_matrix(0.3 * generator.uniform(-1, 1, (FRAMES, 22, 3)))
    place_TJ3 = np.zeros((FRAMES, 22, 3)) + [0.2, 0.95, 0.5]
    for joint, offset_3 in enumerate(OFFSETS_J3.astype(float), start=1):
        place_TJ3[:, joint] = place_TJ3[:, PARENTS[joint]] + world_TJ33[:, PARENTS[joint]] @ offset_3
        world_TJ33[:, joint] = world_TJ33[:, PARENTS[joint]] @ world_TJ33[:, joint]
    return place_TJ3, world_TJ33


def write(path: Path, place_TJ3: np.ndarray, world_TJ33: np.ndarray, **more: object) -> None:
    joints = [JOINT_NAMES.index(name) for name in JOINTS]
    turns = TO_ROBOT @ world_TJ33[:, joints] @ TO_ROBOT.T
    quaternion = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat()
    arrays: dict[str, object] = {
        "segment_qWXYZ": np.roll(quaternion, 1, axis=1).reshape(FRAMES, 92).astype(np.float32),
        "segment_tXYZ": (place_TJ3[:, joints] @ TO_ROBOT.T).reshape(FRAMES, 69),
        "timestamps_us": np.arange(FRAMES),
        "framerate": 240,
    }
    np.savez(path, **{**arrays, **more})  # type: ignore[arg-type]


TURNED = ("pelvis", "spine3", "neck", "head", "left_wrist", "right_wrist", "left_ankle")


def check(motion: Motion, place_TJ3: np.ndarray, world_TJ33: np.ndarray, turned: Iterable[str] = TURNED) -> None:
    """Trunk, head, hands and limbs are turned as our body's."""
    root_T33, root_T3 = motion.arrays.root_rotation_T33, motion.arrays.root_position_T3
    assert root_T33 is not None and root_T3 is not None
    turns = {0: root_T33}
    for joint in range(1, 22):
        turns[joint] = turns[PARENTS[joint]] @ motion.arrays.local_TJ33[:, joint - 1]
    for name in turned:
        joint = JOINT_NAMES.index(name)
        assert angles_between(turns[joint].astype(float), world_TJ33[:, joint]).max() < 1e-3, name
    for start, end in (("left_shoulder", "left_elbow"), ("right_elbow", "right_wrist"), ("left_hip", "left_knee")):
        i, j = JOINT_NAMES.index(start), JOINT_NAMES.index(end)
        np.testing.assert_allclose(turns[i] @ OFFSETS_J3[j - 1], place_TJ3[:, j] - place_TJ3[:, i], atol=1e-3)
    np.testing.assert_allclose(root_T3, place_TJ3[:, 0], atol=1e-3)


def test_trunk_head_hands_and_limbs_are_turned_as_segments_are(tmp_path: Path) -> None:
    place_TJ3, world_TJ33 = body()
    write(tmp_path / "xdata.npz", place_TJ3, world_TJ33)
    motion = mrhubo.read_motion(tmp_path / "xdata.npz")
    assert motion.frame_rate == 240 and motion.source.startswith("Nymeria")
    check(motion, place_TJ3, world_TJ33)


def test_places_that_are_none_are_refused_and_other_shapes_are_not_taken(tmp_path: Path) -> None:
    place_TJ3, world_TJ33 = body()
    write(tmp_path / "a.npz", np.full_like(place_TJ3, np.nan), world_TJ33)
    with pytest.raises(UserError, match="segment_tXYZ"):
        mrhubo.read_motion(tmp_path / "a.npz")
    write(tmp_path / "a.npz", place_TJ3, world_TJ33, segment_qWXYZ=np.zeros((FRAMES, 91)))
    with pytest.raises(UserError, match="no human motion"):
        mrhubo.read_motion(tmp_path / "a.npz")
    write(tmp_path / "a.npz", place_TJ3, world_TJ33, segment_qWXYZ=np.zeros((FRAMES, 92)))
    with pytest.raises(UserError, match="chest"):
        mrhubo.read_motion(tmp_path / "a.npz")
