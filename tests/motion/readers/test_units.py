"""Places in centimetres or millimetres are told by their speed or height, and those in metres stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.motion import read_motion, write_motion
from mrhubo.motion.readers.units import find_unit


def way(speed: float, height: float = 0.95, frames: int = 60) -> np.ndarray:
    """Goes straight on [m/s], at a height [m], at 60 frames a second, and sways."""
    time_T = np.arange(frames) / 60
    return np.stack((0.01 * np.sin(2 * time_T), height + 0.02 * np.sin(9 * time_T), speed * time_T), axis=1)


@pytest.mark.parametrize("speed", [0.0, 1.4, 6.0, 12.0])
@pytest.mark.parametrize(("unit", "metres"), [("centimetres", 0.01), ("millimetres", 0.001)])
def test_units_are_told(speed: float, unit: str, metres: float) -> None:
    place_T3 = way(speed)
    assert find_unit(place_T3 / metres, 60.0) == (unit, metres)
    assert find_unit(place_T3, 60.0) is None and find_unit(place_T3[:1] / metres, 60.0) == (unit, metres)


def test_metres_stay_wherever_they_are() -> None:
    for place_T3 in (
        way(1.4, -3.0), way(1.4, 19.0), way(12.0, 300.0), way(20.0), way(1.4) + [1e4, 0.0, 1e4], way(0.0, 0.0),
        np.zeros((0, 3)),
    ):  # fmt: skip
        assert find_unit(place_T3, 60.0) is None
    jumps_T3 = way(1.4)
    jumps_T3[30] += 50.0
    assert find_unit(jumps_T3, 60.0) is None


def test_a_file_in_centimetres_is_read_in_metres(tmp_path: Path) -> None:
    pose_T63, root_T3 = np.zeros((60, 63)), np.zeros((60, 3))
    write_motion(tmp_path / "a.npz", pose_T63, root_T3, 100 * way(1.4), 60.0, "glides")
    found = read_motion(tmp_path / "a.npz")
    assert found.notes == ("'trans' is in centimetres, by how fast or how high the root is: told in metres",)
    np.testing.assert_allclose(found.arrays.root_position_T3, way(1.4), atol=1e-6)


def test_depths_that_jump_near_a_camera_are_no_units() -> None:
    generator = np.random.default_rng(0)
    place_T3 = way(1.0, 0.2) * [0.1, 1.0, 0.1] + [0.0, 0.0, 4.0] + generator.normal(0, 0.5, (60, 3)) * [0, 0, 1]
    assert find_unit(place_T3, 60.0) is not None and find_unit(place_T3, 60.0, beyond=100.0) is None
    assert find_unit(1000 * place_T3[:1].repeat(60, 0) + way(1.0), 60.0, beyond=100.0) is None
    steady_T3 = way(1.0, 0.2) * [0.1, 1.0, 0.1] + [0.0, 0.0, 4.0]
    assert find_unit(1000 * steady_T3, 60.0, beyond=100.0) == ("millimetres", 0.001)
    assert find_unit(steady_T3, 60.0, beyond=100.0) is None


@pytest.mark.parametrize("height", [0.0, 120.0])
@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_who_walks_high_above_the_origin_in_metres_is_not_in_centimetres(
    unit: float, height: float, tmp_path: Path
) -> None:
    """The legs tell: a planted foot keeps still."""
    if unit < 1 and height:
        return  # nobody's floor
    frames, swing = 120, np.sin(np.arange(120) / 60 * 2 * np.pi)
    body = np.zeros((frames, 21, 3))
    body[:, 0, 0], body[:, 1, 0] = -0.4 * swing, 0.4 * swing  # the hips
    leg = 0.85
    low = np.stack([np.sin(0.4 * swing), -np.sin(0.4 * swing)], axis=1) * leg
    planted = np.where(np.gradient(low[:, 0]) < 0, 0, 1)
    step = -np.diff(low, axis=0)[np.arange(frames - 1), planted[:-1]]
    place = np.stack(
        [np.zeros(frames), np.full(frames, 0.95 + height), np.concatenate([[0.0], np.cumsum(step)])], axis=1
    )
    np.savez(
        tmp_path / "walk.npz", pose_body=body.reshape(frames, 63), root_orient=np.zeros((frames, 3)),
        trans=place / unit, mocap_frame_rate=60,
    )  # fmt: skip
    motion = read_motion(tmp_path / "walk.npz")
    found = motion.arrays.root_position_T3
    assert found is not None
    np.testing.assert_allclose(np.ptp(found[:, 2]), np.ptp(place[:, 2]), rtol=0.01)
