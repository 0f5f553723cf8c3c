"""Arms turned about their bones until elbows bend about SMPL's axis."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body.arm_axes import CMU_TILT, elbow_tilt, untilt_arms
from mrhubo.body.joints import hinge_axis
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton
from mrhubo.motion import read_folder

ELBOWS = ("left_elbow", "right_elbow")


def moving(tilt: float, frames: int = 40) -> torch.Tensor:
    """Poses with hinge elbows, whose axes are tilted."""
    generator = torch.Generator().manual_seed(0)
    local = rotation.axis_angle_to_matrix(0.5 * torch.randn(frames, 21, 3, generator=generator))
    turn_33 = rotation.axis_angle_to_matrix(torch.tensor([tilt, 0.0, 0.0]))
    for name in ELBOWS:
        bend_T1 = 2.0 * torch.rand(frames, 1, generator=generator)
        axis_3 = turn_33 @ torch.tensor(hinge_axis(name))
        local[:, POSED_JOINT_NAMES.index(name)] = rotation.axis_angle_to_matrix(bend_T1 * axis_3)
    return local


@pytest.mark.parametrize("degrees", [-29.4, 0.0, 12.0, 80.0])
def test_a_tilt_is_found_and_taken_out(degrees: float) -> None:
    local = moving(math.radians(degrees)).numpy()
    tilt = elbow_tilt(local)
    assert tilt is not None and math.degrees(tilt) == pytest.approx(degrees, abs=0.05)
    again = elbow_tilt(untilt_arms(local, tilt))
    assert again is not None and math.degrees(again) == pytest.approx(0.0, abs=0.05)


def test_limbs_and_hands_stay() -> None:
    local, skeleton = moving(-0.5), Skeleton()
    untilted = torch.from_numpy(untilt_arms(local.numpy(), -0.5))
    (before, turns), (after, turned) = (skeleton.keypoints_and_rotations(p) for p in (local, untilted))
    torch.testing.assert_close(after, before, atol=1e-5, rtol=0)
    kept = [i for i, name in enumerate(JOINT_NAMES) if not name.endswith(("shoulder", "elbow"))]
    torch.testing.assert_close(turned[:, kept], turns[:, kept], atol=1e-5, rtol=0)
    shoulder = KEYPOINT_NAMES.index("left_shoulder")
    assert float(rotation.geodesic_distance(turned[:, shoulder], turns[:, shoulder]).min()) > 0.49


def test_ball_joints_and_still_arms_tell_no_tilt() -> None:
    loose = moving(-0.5)
    wobble = rotation.axis_angle_to_matrix(0.2 * torch.randn(40, 3, generator=torch.Generator().manual_seed(1)))
    loose[:, POSED_JOINT_NAMES.index("left_elbow")] @= wobble
    assert elbow_tilt(loose.numpy()) is None
    assert elbow_tilt(np.tile(np.eye(3), (40, 21, 1, 1))) is None
    crooked = moving(-0.5)
    crooked[:, POSED_JOINT_NAMES.index("right_elbow")] = moving(0.5)[:, POSED_JOINT_NAMES.index("right_elbow")]
    assert elbow_tilt(crooked.numpy()) is None, "left and right contradict each other"


def test_the_cmu_clips_are_read_untilted(external_dir: Path) -> None:
    for motion in read_folder(external_dir / "cmu" / "evaluation")[:3]:
        tilt = elbow_tilt(motion.arrays.local_TJ33)
        assert tilt is not None and abs(tilt) < math.radians(0.5)
        assert any("elbows' axes are tilted by -30 degrees" in note for note in motion.notes)
    assert math.degrees(CMU_TILT) == pytest.approx(-29.41, abs=0.01)
