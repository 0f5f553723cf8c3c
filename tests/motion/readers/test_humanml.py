"""Features of HumanML3D and its kin, written as their own code lays them out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.joints import JOINT_NAMES, KEYPOINT_NAMES, REST_K3
from mrhubo.motion import Motion, ReadOptions, read_motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.humanml import _SNAPMOGEN
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.rotations import Form, to_matrices

FRAMES = 12
REST = dict(zip(KEYPOINT_NAMES, REST_K3.astype(np.float64), strict=True))
ORDERS = {263: JOINT_NAMES, 251: SETS["KIT-ML"], 296: _SNAPMOGEN}
RATES = {263: 20.0, 251: 12.5, 296: 30.0}
SIDED = {"left": "right", "right": "left"}


def joints(names: tuple[str, ...]) -> np.ndarray:
    """Somebody (T, J, 3) at the origin whose left forearm is raised, seen from their heading."""
    body = REST | {"left_wrist": REST["left_elbow"] + [0, 0.26, 0]}
    return np.tile(np.stack([body.get(name, body["head"]) for name in names]) + [0, 0.9, 0], (FRAMES, 1, 1))


def headings() -> np.ndarray:
    """How the body is turned about the vertical axis [rad]: it walks round a corner."""
    return np.linspace(0.0, 1.4, FRAMES)


def places() -> np.ndarray:
    """Where the root is (T, 2) along x and z."""
    step = np.stack([np.sin(headings()), np.cos(headings())], axis=1) * 0.05
    return np.cumsum(step, axis=0) - step[0]


def turned(angle_T: np.ndarray) -> np.ndarray:
    found = to_matrices(np.stack([0 * angle_T, angle_T, 0 * angle_T], axis=1), Form(1, False), 10.0)
    assert found is not None
    return found[:, 0]


def rows(width: int, scale: float = 1.0, swapped: bool = False) -> np.ndarray:
    """Features of a walk around a corner; names of the file's joints may be those of the other side."""
    names = ORDERS[width]
    if swapped:
        sides = [name.partition("_") for name in names]
        names = tuple(
            f"{SIDED[side]}_{part}" if side in SIDED else name
            for name, (side, _, part) in zip(names, sides, strict=True)
        )
    seen_TJ3, heading_T, place_T2 = scale * joints(names), headings(), scale * places()
    row_TX = np.full((FRAMES, width), 0.25)
    step_T3 = np.zeros((FRAMES - 1, 3))
    step_T3[:, [0, 2]] = np.diff(place_T2, axis=0)
    step_T3 = (turned(-heading_T[1:]) @ step_T3[..., None])[..., 0]
    half = 1.0 if width == 296 else 0.5
    row_TX[:, :3] = 0.0
    row_TX[:-1, 0], row_TX[:-1, 1:3] = -half * np.diff(heading_T), step_T3[:, [0, 2]]
    row_TX[:, 3] = seen_TJ3[:, 0, 1]
    if width == 296:
        row_TX[:, 148:220] = seen_TJ3.reshape(FRAMES, -1)
    else:
        row_TX[:, 4 : 4 + 3 * (len(names) - 1)] = seen_TJ3[:, 1:].reshape(FRAMES, -1)
    return row_TX


def is_the_walk(motion: Motion) -> bool:
    """Whether the left forearm is raised, and the person looks and goes around the corner."""
    arrays = motion.arrays
    assert arrays.root_rotation_T33 is not None and arrays.root_position_T3 is not None
    way_3 = arrays.root_position_T3[-1] - arrays.root_position_T3[0]
    np.testing.assert_allclose(way_3[[0, 2]], places()[-1], atol=0.02)
    np.testing.assert_allclose(way_3[1], 0.0, atol=0.02)
    looks_T3 = arrays.root_rotation_T33[..., 2]
    np.testing.assert_allclose(looks_T3[:, 0], np.sin(headings()), atol=0.1)
    np.testing.assert_allclose(looks_T3[:, 2], np.cos(headings()), atol=0.1)
    left, right = (np.trace(arrays.local_TJ33[0, JOINT_NAMES.index(f"{side}_elbow") - 1]) for side in SIDED)
    return bool(left < 1.5 < right)


@pytest.mark.parametrize("width", ORDERS)
@pytest.mark.parametrize("scale", [1.0, 100.0])
@pytest.mark.parametrize("batch", [False, True])
def test_features_are_read_in_any_unit(width: int, scale: float, batch: bool, tmp_path: Path) -> None:
    row_TX = rows(width, scale).astype(np.float32)
    np.save(tmp_path / "a.npy", row_TX[None] if batch else row_TX)
    motion = read_motion(tmp_path / "a.npy")
    assert motion.frame_rate == RATES[width] and is_the_walk(motion)


def test_sides_of_snapmogen_are_told_by_the_feet(tmp_path: Path) -> None:
    for swapped in (False, True):
        np.save(tmp_path / "a.npy", rows(296, swapped=swapped).astype(np.float32))
        motion = read_motion(tmp_path / "a.npy")
        assert is_the_walk(motion) and not any("mirrored" in note for note in motion.notes)


def test_joints_of_kit_are_read_without_features(tmp_path: Path) -> None:
    """As HumanML3D's authors keep them beside the features, in the folder `new_joints`."""
    np.save(tmp_path / "a.npy", joints(SETS["KIT-ML"]).astype(np.float32))
    motion = read_motion(tmp_path / "a.npy", ReadOptions(rate=12.5))
    assert "21 points as KIT-ML has them" in motion.source


@pytest.mark.parametrize("width", ORDERS)
def test_features_that_are_normalised_are_refused(width: int, tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.random.default_rng(0).normal(size=(FRAMES, width)))
    with pytest.raises(NoMotion, match="normalised"):
        read_motion(tmp_path / "a.npy")
