"""Which way is up in the world of a root."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mrhubo.motion import read_motion
from mrhubo.motion.readers.world import ANY_WORLD, CAMERAS, WORLDS, find_up, find_world

FRAMES = 50
TO_Y_UP = {world: find_up(np.eye(3)[None, 1], (world,))[1] for world in ANY_WORLD}


@settings(max_examples=50, deadline=None)
@given(world=st.sampled_from(ANY_WORLD), yaw=st.floats(0, 360), tilt=st.floats(-0.5, 0.5), height=st.floats(-3, 3))
def test_who_stands_is_set_upright_in_every_world(world: str, yaw: float, tilt: float, height: float) -> None:
    up = Rotation.from_euler("zy", [np.degrees(tilt), yaw], degrees=True).apply([0.0, 1.0, 0.0]) @ TO_Y_UP[world]
    place = np.tile(np.array([1.0, height, 2.0]) @ TO_Y_UP[world], (FRAMES, 1))
    found, turn, said = find_world(np.tile(up, (FRAMES, 1)), place, ANY_WORLD)
    assert found == world and not said and np.array_equal(turn, TO_Y_UP[world])


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("yaw", [40.0, 50.0, 130.0, 220.0, 310.0])
def test_who_lies_on_a_floor_is_left_lying(world: str, yaw: float) -> None:
    """Along no axis of the world, and crawling for three metres, now more to the left and now more to the right."""
    way = np.linspace(0, 3, FRAMES)[:, None]
    yaws = yaw + 12 * np.sin(10 * way)
    along = Rotation.from_euler("y", yaws, degrees=True).apply([0.0, 0.0, 1.0])
    place = (way * along + [1.0, 0.15, 0.5]) @ TO_Y_UP[world]
    found, _, said = find_world(along @ TO_Y_UP[world], place, ANY_WORLD)
    assert found == world and "by how low the root is" in said


def test_who_lies_where_nothing_tells_is_said() -> None:
    up = np.tile([1.0, 0.0, 0.0], (FRAMES, 1))
    for worlds in (ANY_WORLD, CAMERAS):
        found, _, said = find_world(up, None, worlds)
        assert found == worlds[0] and "nothing tells which way is up" in said


@pytest.mark.parametrize("key", ["poses", "pose_body"])
def test_what_a_camera_sees_is_set_upright(key: str, tmp_path: Path) -> None:
    """As BEHAVE and HuMoR write it, with AMASS's keys."""
    turn = (
        Rotation.from_euler("x", 180, degrees=True) * Rotation.from_euler("y", [[10.0]] * 5, degrees=True)
    ).as_rotvec()
    place = np.tile([0.5, 0.3, 2.5], (5, 1))
    body = {"poses": np.pad(turn, ((0, 0), (0, 153)))} if key == "poses" else {
        "pose_body": np.zeros((5, 63)), "root_orient": turn
    }  # fmt: skip
    np.savez(tmp_path / "a.npz", trans=place, fps=30.0, **body)
    motion = read_motion(tmp_path / "a.npz")
    assert "y down" in motion.source
    assert motion.arrays.root_rotation_T33 is not None and motion.arrays.root_position_T3 is not None
    assert motion.arrays.root_rotation_T33[:, 1, 1].min() > 0.999
    np.testing.assert_allclose(motion.arrays.root_position_T3, place * [1, -1, -1], atol=1e-6)
