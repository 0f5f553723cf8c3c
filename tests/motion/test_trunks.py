"""Trunks: joints alone tell how pelvis, chest and neck are turned, of whichever body they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mrhubo
from mrhubo.body.joints import JOINT_NAMES, PARENTS, REST_K3
from mrhubo.fast.rotations import angles_between, axis_angle_to_matrix
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.trunks import _TRUNKS, trunk_turns

FRAMES = 30
PARTS = ("pelvis", "spine3", "neck")


def body(whose: str, seed: int, most: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Places (T, 22, 3) [m] of joints of a body with this trunk, and their rotations (T, 22, 3, 3) in the world; what
    is not its trunk is ours.
    """
    generator = np.random.default_rng(seed)
    trunk = _TRUNKS[whose]
    turn_TJ3 = most * generator.uniform(-1, 1, (FRAMES, 22, 3))
    local_TJ33 = axis_angle_to_matrix(turn_TJ3)
    place_TJ3, world_TJ33 = np.zeros((FRAMES, 22, 3)), local_TJ33.copy()
    for joint, (name, parent) in enumerate(zip(JOINT_NAMES[1:], PARENTS[1:], strict=True), start=1):
        of = JOINT_NAMES[parent]
        both = name in trunk and of in trunk
        offset_3 = trunk[name] - trunk[of] if both else (REST_K3[joint] - REST_K3[parent]).astype(float)
        place_TJ3[:, joint] = place_TJ3[:, parent] + world_TJ33[:, parent] @ offset_3
        world_TJ33[:, joint] = world_TJ33[:, parent] @ local_TJ33[:, joint]
    return place_TJ3, world_TJ33


def points_of(place_TJ3: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(JOINT_NAMES, place_TJ3.swapaxes(0, 1), strict=True))


def neck_to_head(whose: str) -> np.ndarray:
    return _TRUNKS[whose]["head"] - _TRUNKS[whose]["neck"]


@pytest.mark.parametrize("whose", _TRUNKS)
@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_a_bent_and_twisted_back_hides_neither_pelvis_nor_chest(whose: str, unit: float) -> None:
    place_TJ3, world_TJ33 = body(whose, 0)
    found, told = trunk_turns(points_of(unit * place_TJ3))
    assert told == whose
    for part in ("pelvis", "spine3"):
        assert angles_between(found[part], world_TJ33[:, JOINT_NAMES.index(part)]).max() < 1e-5, part
    neck, head = (place_TJ3[:, JOINT_NAMES.index(name)] for name in ("neck", "head"))
    np.testing.assert_allclose(found["neck"] @ neck_to_head(whose), head - neck, atol=1e-9)


@pytest.mark.parametrize("whose", ["SMPL", "SMPL-X"])
def test_another_person_with_the_same_model_is_nearly_as_well_told(whose: str) -> None:
    """People differ by a tenth in every length of a trunk, which is not told."""
    for seed in range(5):
        generator = np.random.default_rng(seed)
        place_TJ3, world_TJ33 = body(whose, seed, most=0.0)
        place_TJ3 = place_TJ3 + 0.008 * generator.normal(size=(1, 22, 3))
        found, told = trunk_turns(points_of(place_TJ3))
        assert told == whose
        for part in ("pelvis", "spine3"):
            assert angles_between(found[part], world_TJ33[:, JOINT_NAMES.index(part)]).max() < np.radians(15)


@pytest.mark.parametrize("whose", _TRUNKS)
def test_a_file_of_joints_is_read_as_its_rotations_would_be(whose: str, tmp_path: Path) -> None:
    place_TJ3, world_TJ33 = body(whose, 1)
    np.save(tmp_path / "joints.npy", place_TJ3 + [0.0, 1.0, 0.0])
    motion = mrhubo.read_motion(tmp_path / "joints.npy", ReadOptions(rate=30.0))
    assert f"a trunk like {whose}'s" in motion.source
    root_T33, local_TJ33 = motion.arrays.root_rotation_T33, motion.arrays.local_TJ33
    assert root_T33 is not None
    assert angles_between(root_T33, world_TJ33[:, 0]).max() < 1e-3
    turn_T33 = root_T33
    for joint in ("spine1", "spine2", "spine3"):
        turn_T33 = turn_T33 @ local_TJ33[:, JOINT_NAMES.index(joint) - 1]
    assert angles_between(turn_T33, world_TJ33[:, JOINT_NAMES.index("spine3")]).max() < 1e-3
    neck_T33 = turn_T33 @ local_TJ33[:, JOINT_NAMES.index("neck") - 1]
    head_T3 = place_TJ3[:, JOINT_NAMES.index("head")] - place_TJ3[:, JOINT_NAMES.index("neck")]
    np.testing.assert_allclose(neck_T33 @ neck_to_head(whose), head_T3, atol=1e-4)


def test_joints_that_are_missing_in_few_frames_leave_these_open_and_in_many_all() -> None:
    place_TJ3, world_TJ33 = body("SMPL", 2)
    place_TJ3[4, JOINT_NAMES.index("spine1")] = np.nan
    found, _ = trunk_turns(points_of(place_TJ3))
    for part in PARTS:
        assert np.unique(np.argwhere(np.isnan(found[part]))[:, 0]).tolist() == [4]
    assert angles_between(found["pelvis"][5:], world_TJ33[5:, 0]).max() < 1e-5
    place_TJ3[::5, JOINT_NAMES.index("neck")] = np.nan
    assert trunk_turns(points_of(place_TJ3)) == ({}, "")


def test_another_body_is_not_taken_for_one_of_them() -> None:
    """Hips beside the pelvis, and collars in the neck, as Kinect's and others' bodies have them."""
    place_TJ3, _ = body("SMPL", 3, most=0.0)
    for side, x in (("left", 0.1), ("right", -0.1)):
        place_TJ3[:, JOINT_NAMES.index(f"{side}_hip")] = [x, 0.0, 0.0]
        place_TJ3[:, JOINT_NAMES.index(f"{side}_collar")] = place_TJ3[:, JOINT_NAMES.index("neck")] + [x / 20, 0, 0]
    assert trunk_turns(points_of(place_TJ3)) == ({}, "")
    points = points_of(place_TJ3)
    del points["spine1"]
    assert trunk_turns(points) == ({}, "")
    assert trunk_turns({name: np.zeros((3, 3)) for name in JOINT_NAMES}) == ({}, "")
