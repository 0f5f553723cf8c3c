"""Which way is up in the world of a root."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mrhubo.body.joints import REST_K3
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


def on_the_floor(world: str, yaw: float, place: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """The up axis (T, 3) of somebody who lies on the back in a world with a floor at height 0, the head to an axis, and
    joints (T, K, 3): pelvis, shoulders, hands and ankles.
    """
    turn = Rotation.from_euler("y", [[yaw]], degrees=True) * Rotation.from_euler("x", -90, degrees=True)
    body = np.array([(0, 0, 0), (0.2, 0.4, 0), (-0.2, 0.4, 0), (0.4, 0, 0.02), (-0.4, 0, 0.02), (0, -0.9, -0.04)])
    sway = Rotation.from_euler("z", 3 * np.sin(np.linspace(0, 5, FRAMES))[:, None], degrees=True)
    whole = turn * sway
    joints = np.stack([whole.apply(point) for point in body], axis=1) + place
    return whole.apply([0.0, 1.0, 0.0]) @ TO_Y_UP[world], joints @ TO_Y_UP[world]


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("yaw", [0.0, 90.0, 180.0, 270.0])
@pytest.mark.parametrize("place", [(1.3, 0.12, -2.3), (-2.0, 0.12, 1.5)])
def test_who_lies_along_an_axis_that_may_be_up_is_left_lying_where_a_floor_tells(
    world: str, yaw: float, place: tuple[float, float, float]
) -> None:
    up_T3, joints_TK3 = on_the_floor(world, yaw, place)
    found, turn_33, said = find_world(up_T3, joints_TK3[:, 0], ANY_WORLD, joints_TK3)
    assert found == world and "is taken" in said and np.array_equal(turn_33, TO_Y_UP[world])


def test_who_may_stand_or_lie_stands_and_is_told_of() -> None:
    up_T3, joints_TK3 = on_the_floor("y up", 180.0, (1.3, 0.12, 0.9))  # as high as a pelvis is, if z were up
    found, _, said = find_world(up_T3, joints_TK3[:, 0], ANY_WORLD, joints_TK3)
    assert found == "z up" and "with y up it would lie on a floor" in said


@pytest.mark.parametrize("world", ANY_WORLD)
@pytest.mark.parametrize("height", [0.0, 0.9, 3.0, -1.5])
@pytest.mark.parametrize("depth", [0.0, 0.5, 3.0])
def test_who_stands_wherever_the_floor_is_is_not_laid_down(world: str, height: float, depth: float) -> None:
    body = np.array([(0, 0, 0), (0.2, 0.4, 0), (-0.2, 0.4, 0), (0.3, 0, 0.1), (-0.3, 0, 0.1), (0, -0.9, 0)])
    joints_TK3 = np.tile(body + [0.3, height, depth], (FRAMES, 1, 1)) @ TO_Y_UP[world]
    up_T3 = np.tile([0.0, 1.0, 0.0] @ TO_Y_UP[world], (FRAMES, 1))
    assert find_world(up_T3, joints_TK3[:, 0], ANY_WORLD, joints_TK3)[0] == world


@pytest.mark.parametrize("low", [-0.4, -0.1, 0.0, 0.3])
def test_who_stands_on_a_floor_that_is_off_as_recordings_have_it_stands(low: float) -> None:
    body = np.array([(0, 0, 0), (0.2, 0.4, 0), (-0.2, 0.4, 0), (0.3, 0, 0.1), (-0.3, 0, 0.1), (0, -0.9, -0.1)])
    joints_TK3 = np.tile(body + [0.3, 0.9 + low, 0.17], (FRAMES, 1, 1))
    up_T3 = np.tile([0.0, 1.0, 0.0], (FRAMES, 1))
    found, _, said = find_world(up_T3, joints_TK3[:, 0], ANY_WORLD, joints_TK3)
    assert found == "y up" and "with z up it would lie on a floor" in said


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("walks", [False, True])
def test_who_is_put_at_height_0_and_may_lie_is_told_of(world: str, walks: bool) -> None:
    body = np.array([(0, 0, 0), (0.2, 0.4, 0), (-0.2, 0.4, 0), (0.3, 0, 0.1), (-0.3, 0, 0.1), (0, -0.9, -0.1)])
    way_T13 = walks * np.linspace(0, 2, FRAMES)[:, None, None] * [0, 0, 1]
    joints_TK3 = (np.tile(body, (FRAMES, 1, 1)) + way_T13) @ TO_Y_UP[world]
    up_T3 = np.tile([0.0, 1.0, 0.0] @ TO_Y_UP[world], (FRAMES, 1))
    found, _, said = find_world(up_T3, joints_TK3[:, 0], ANY_WORLD, joints_TK3)
    assert found == world and ("it would lie" in said) is not walks


@pytest.mark.parametrize("planted", [True, False])
def test_who_is_on_the_hands_throughout_is_so(planted: bool) -> None:
    """Upside down with y up, and upright with y down: the hands on the floor tell, where they stay there."""
    joints_TK3 = np.tile(-(REST_K3[:22].astype(np.float64)), (FRAMES, 1, 1))
    joints_TK3[:, [20, 21]] = [[0.2, -1.2, 0], [-0.2, -1.2, 0]]  # arms overhead
    joints_TK3 = (
        joints_TK3 + [0.3, 1.2, 0.1] + (not planted) * np.linspace(-0.5, 0.5, FRAMES)[:, None, None] * [0, 1, 0]
    )
    up_T3 = np.tile([0.0, -1.0, 0.0], (FRAMES, 1))
    found, _, said = find_world(up_T3, joints_TK3[:, 0], ANY_WORLD, joints_TK3)
    assert (found == "y up" and "on its hands" in said) is planted


@pytest.mark.parametrize("world", WORLDS)
def test_who_goes_on_along_the_body_may_swim(world: str) -> None:
    joints_TK3 = np.tile(REST_K3[:22].astype(np.float64), (FRAMES, 1, 1))
    joints_TK3 = joints_TK3 + np.linspace(0, 2, FRAMES)[:, None, None] * [0, 1, 0]
    up_T3 = np.tile([0.0, 1.0, 0.0] @ TO_Y_UP[world], (FRAMES, 1))
    joints_TK3 = joints_TK3 @ TO_Y_UP[world]
    found, _, said = find_world(up_T3, joints_TK3[:, 0], ANY_WORLD, joints_TK3)
    assert found == world and "and climbs; with" in said
