"""Feet that stand rolled are found, and turned level."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.joints import POSED_JOINT_NAMES
from mrhubo.body.level_feet import Feet, middle, own_up, rolled_up, standing_up, turn_feet, usual_up
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.motion import read_motion, write_motion

UP = np.array([0.0, 1.0, 0.0])
LEFT, RIGHT = (POSED_JOINT_NAMES.index(f"{side}_ankle") for side in ("left", "right"))


def walk(left_deg: float, right_deg: float, frames: int = 80, lean_deg: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Root and local rotations of a person who turns round on both feet, one after the other lifted and turned; the
    skeleton rolls its feet by constant angles, and leans them by one.
    """
    time = np.arange(frames) / frames
    nothing = np.zeros_like(time)
    root_T33 = axis_angle_to_matrix(np.stack((nothing, 0.8 * time, nothing), axis=-1))
    local_TJ33 = np.tile(np.eye(3), (frames, 21, 1, 1))
    for side, roll_deg, lifted in (("left", left_deg, time < 0.25), ("right", right_deg, time > 0.75)):
        bend = np.where(lifted, 0.6 + 0.5 * np.sin(40 * time), 0.2)
        hip, knee, ankle = (POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("hip", "knee", "ankle"))
        for joint, angle in ((hip, -bend), (knee, 2 * bend), (ankle, np.where(lifted, 0.3, -bend))):
            local_TJ33[:, joint] = axis_angle_to_matrix(np.stack((angle, nothing, nothing), axis=-1))
        roll = np.radians([lean_deg, 0.0, roll_deg])
        local_TJ33[:, ankle] = local_TJ33[:, ankle] @ axis_angle_to_matrix(roll)
    return root_T33, local_TJ33


def tilt_deg(feet: Feet) -> list[float]:
    return [math.degrees(math.acos(min(1.0, float(middle(up_X3) @ UP)))) for up_X3 in feet]


@pytest.mark.parametrize(("left", "right"), [(-16.0, 16.0), (-8.0, 12.0), (-24.0, 24.0)])
def test_a_roll_is_found_and_taken_out(left: float, right: float) -> None:
    root, local = walk(left, right)
    found = rolled_up(standing_up(root, local))
    assert found is not None
    level = turn_feet(local, found)
    assert tilt_deg(standing_up(root, level)) == pytest.approx([0.0, 0.0], abs=0.3)
    assert rolled_up(standing_up(root, level)) is None
    others = [joint for joint in range(21) if joint not in (LEFT, RIGHT)]
    np.testing.assert_array_equal(level[:, others], local[:, others])
    turn = np.swapaxes(local[:, LEFT], -1, -2) @ level[:, LEFT]
    np.testing.assert_allclose(turn, np.broadcast_to(turn[0], turn.shape), atol=1e-6)  # the same in all frames


@pytest.mark.parametrize(
    ("left", "right", "lean"),
    [(0.0, 0.0, 0.0), (-3.0, 3.0, 0.0), (16.0, 16.0, 0.0), (16.0, -16.0, 0.0), (-16.0, 0.0, 0.0), (-16.0, 16.0, 12.0)],
    ids=["level", "nearly", "to one side", "inwards", "one foot", "on its toes"],
)
def test_what_no_skeleton_does_stays(left: float, right: float, lean: float) -> None:
    assert rolled_up(standing_up(*walk(left, right, lean_deg=lean))) is None


def test_clips_without_standing_feet_tell_nothing() -> None:
    root, local = walk(-16.0, 16.0)
    for count in (0, 1, 2):
        assert [len(up_X3) for up_X3 in standing_up(root[:count], local[:count])] == [0, 0]
    assert rolled_up(standing_up(root[:10], local[:10])) is None
    nothing = np.zeros((0, 3))
    np.testing.assert_array_equal(usual_up([(nothing, nothing)]), UP)


def test_a_performer_with_few_frames_or_strange_ones_has_what_is_usual() -> None:
    usual = usual_up([standing_up(*walk(-16.0, 16.0, 400)), standing_up(*walk(-14.0, 14.0, 400))])
    assert math.degrees(math.asin(-usual[0])) == pytest.approx(15.0, abs=1.1)
    expected = usual, usual * [-1, 1, 1]
    few, strange = standing_up(*walk(-5.0, 5.0)), standing_up(*walk(30.0, -40.0, 400))
    for feet in (few, strange):
        np.testing.assert_allclose(own_up(feet, usual), expected, atol=1e-12)
    own = own_up(standing_up(*walk(-8.0, 8.0, 400)), usual)
    assert math.degrees(math.asin(-own[0][0])) == pytest.approx(8.0, abs=0.1)


def test_who_sits_does_not_stand(tmp_path: Path) -> None:
    root, local = walk(-16.0, 16.0)
    for side in ("left", "right"):
        hip, knee = (POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("hip", "knee"))
        local[:, hip] = axis_angle_to_matrix(np.array([-1.5, 0.0, 0.0]))
        local[:, knee] = axis_angle_to_matrix(np.array([1.5, 0.0, 0.0]))
    assert min(map(len, standing_up(root, local))) > 0 and [len(x) for x in standing_up(root, local, 0.6)] == [0, 0]
    assert min(map(len, standing_up(*walk(-16.0, 16.0), 0.6))) > 20


@pytest.mark.parametrize("rate", [24.0, 120.0, 240.0])
def test_legs_that_swing_are_not_levelled_whatever_the_rate(tmp_path: Path, rate: float) -> None:
    """Hanging feet of a person whose arms are of a converted skeleton, and who hangs on a bar."""
    time = np.arange(0, 6, 1 / rate)
    poses = np.zeros((len(time), 22, 3))
    bend = 1.0 + np.sin(time)
    for side, sign in (("left", 1), ("right", -1)):
        hip, ankle, elbow = (1 + POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("hip", "ankle", "elbow"))
        poses[:, hip, 0] = 0.5 * np.sin(math.tau * time + (0 if sign > 0 else 1.5))
        poses[:, ankle, 2] = -0.3 * sign
        poses[:, elbow] = bend[:, None] * np.array([0.0, -0.871 * sign, 0.491 * sign])
    write_motion(
        path := tmp_path / "a.npz", poses[:, 1:].reshape(len(time), 63), poses[:, 0], poses[:, 0], rate, "swings"
    )
    motion = read_motion(path)
    assert any("elbows" in note for note in motion.notes) and not any("feet" in note for note in motion.notes)


def test_clips_of_the_paper_stand_level_and_those_that_did_are_left_alone(external_dir: Path) -> None:
    rolled = read_motion(external_dir / "cmu" / "evaluation" / "15_08.npz")
    assert any(note.startswith("the feet stand rolled, the left one by 18") for note in rolled.notes)
    assert rolled.arrays.root_rotation_T33 is not None
    feet = standing_up(rolled.arrays.root_rotation_T33, rolled.arrays.local_TJ33)
    assert max(tilt_deg(feet)) < 1.0
    for path in sorted((external_dir / "cmu" / "whole_body").glob("*.npz")):
        assert not any("feet" in note for note in read_motion(path).notes), path
