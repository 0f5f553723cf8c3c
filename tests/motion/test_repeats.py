"""Frames that are stored again and again are filled where the person moves, and no others are touched."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.motion import Motion, read_motion, resample, write_motion
from mrhubo.motion.repeats import fill_repeats


def moving(frames: int, rate: float) -> Motion:
    """Every joint turns, and the root goes, evenly."""
    time_T = np.arange(frames) / rate
    turn_TJ33 = axis_angle_to_matrix((time_T[:, None, None] * np.ones((21, 3)) * 0.8).astype(np.float32))
    root_T33 = axis_angle_to_matrix((time_T[:, None] * [0.0, 1.0, 0.0]).astype(np.float32))
    place_T3 = (time_T[:, None] * [0.0, 0.0, 1.0]).astype(np.float32)
    return Motion.of(
        name="m", local_TJ33=turn_TJ33, frame_rate=rate, root_rotation_T33=root_T33, root_position_T3=place_T3
    )


def stored(motion: Motion, frames: np.ndarray, rate: float) -> Motion:
    """Some of its frames, at a rate."""
    arrays = {name: array[frames] for name, array in vars(motion.arrays).items() if array is not None}
    return motion.changed(frame_rate=rate, **arrays)


@pytest.mark.parametrize(("rate", "times"), [(30.0, 4), (25.0, 2), (10.0, 12)])
def test_a_slow_motion_that_was_stored_fast_goes_evenly(rate: float, times: int) -> None:
    slow = moving(20, rate)
    found = fill_repeats(stored(slow, np.repeat(np.arange(20), times), rate * times))
    wanted, last = resample(slow, rate * times), 19 * times + 1
    for one, other in zip(vars(found.arrays).values(), vars(wanted.arrays).values(), strict=True):
        if other is not None:
            np.testing.assert_allclose(one[:last], other, atol=1e-5)
    assert found.notes[-1].startswith(f"{19 * (times - 1)} frames repeat the one before while the person moves")


def test_lost_frames_are_filled_and_those_that_are_there_stay(tmp_path) -> None:  # noqa: ANN001
    motion, kept = moving(60, 60.0), np.arange(60)
    kept[20:25] = 19
    found = fill_repeats(stored(motion, kept, 60.0)).arrays
    np.testing.assert_allclose(found.local_TJ33, motion.arrays.local_TJ33, atol=1e-5)
    np.testing.assert_array_equal(
        found.local_TJ33[kept == np.arange(60)], motion.arrays.local_TJ33[kept == np.arange(60)]
    )
    pose_T63 = np.zeros((60, 63))
    pose_T63[:, 40] = np.linspace(0, 1, 60)[kept]
    write_motion(tmp_path / "a.npz", pose_T63, np.zeros((60, 3)), np.zeros((60, 3)), 60.0, "waves")
    assert any(note.startswith("5 frames repeat the one before") for note in read_motion(tmp_path / "a.npz").notes)


def test_who_stands_still_is_left_alone() -> None:
    motion = moving(60, 60.0)
    stands = np.concatenate((np.arange(20), np.full(30, 20), np.arange(20, 60)))  # for half a second
    waits = np.concatenate((np.arange(40), np.full(40, 40)))  # to the end
    for frames in (stands, waits, np.zeros(50, int), np.zeros(2, int)):
        given = stored(motion, frames, 60.0)
        assert fill_repeats(given) is given
    breathes = moving(60, 60.0).changed(root_position_T3=None, root_rotation_T33=None)
    slow = breathes.changed(local_TJ33=np.repeat(breathes.arrays.local_TJ33[:1], 60, axis=0) + 0.0)
    slow.arrays.local_TJ33[30:, 3, 0, 0] += 0.001
    assert fill_repeats(slow) is slow
