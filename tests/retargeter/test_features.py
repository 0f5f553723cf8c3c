"""Features see what they should of a pose."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo import rotation
from mrhubo.body import Skeleton
from mrhubo.body.skeleton import JOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.retargeter import PoseFeatures

ARM = ("left_shoulder", "left_elbow", "left_wrist")


@settings(max_examples=60, deadline=None)
@given(names=st.lists(st.sampled_from(POSED_JOINT_NAMES), min_size=1, max_size=21), seed=st.integers(0, 1000))
def test_chest_features_are_rotations_relative_to_the_chest(names: list[str], seed: int) -> None:
    """Whichever joints are asked for, above the chest, below it, beside it, more than once."""
    pose = torch.randn(3, 21, 6, generator=torch.Generator().manual_seed(seed))
    turns = Skeleton().global_rotations(rotation.sixd_to_matrix(pose))
    chest = turns[:, JOINT_NAMES.index("spine3"), None]
    wanted = chest.mT @ turns[:, [JOINT_NAMES.index(name) for name in names]]
    features = PoseFeatures(names, "chest")
    assert features.size == 6 * len(names)
    torch.testing.assert_close(features(pose), rotation.matrix_to_sixd(wanted).flatten(1), atol=1e-5, rtol=0)


def test_chest_features_ignore_what_lies_below_the_chest() -> None:
    features = PoseFeatures(ARM, "chest")
    pose = rotation.matrix_to_sixd(rotation.axis_angle_to_matrix(torch.randn(4, 21, 3)))
    bent = pose.clone()
    bent[:, [2, 5, 8]] = rotation.matrix_to_sixd(rotation.axis_angle_to_matrix(torch.randn(4, 3, 3)))  # the spine
    torch.testing.assert_close(features(bent), features(pose), atol=1e-5, rtol=0)
    moved = pose.clone()
    moved[:, 15] = bent[:, 2]  # left_shoulder
    assert float((features(moved) - features(pose)).abs().max()) > 0.1


def test_chest_features_hold_the_upper_arm_direction() -> None:
    local = rotation.axis_angle_to_matrix(0.5 * torch.randn(6, 21, 3))
    points, turns = Skeleton().keypoints_and_rotations(local)
    direction = torch.nn.functional.normalize(points[:, 18] - points[:, 16], dim=-1)
    seen = (turns[:, 9].mT @ direction[..., None])[..., 0]
    features = PoseFeatures(("left_shoulder",), "chest")(rotation.matrix_to_sixd(local))
    torch.testing.assert_close(features[:, :3], seen, atol=1e-5, rtol=0)


def test_local_features_are_the_pose_itself() -> None:
    pose = torch.randn(3, 21, 6)
    torch.testing.assert_close(PoseFeatures(("left_hip", "head"), "local")(pose), pose[:, [0, 14]].flatten(1))


@pytest.mark.parametrize("names", [(), ("pelvis",), ("left_wirst",)])
def test_impossible_input_joints_are_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(UserError):
        PoseFeatures(names, "chest")
