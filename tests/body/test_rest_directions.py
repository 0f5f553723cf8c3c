"""Rotations that refer to a body model's rest pose, and to ours."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from mrhubo.body.rest_directions import FAMILIES, from_family, is_ours, to_family
from mrhubo.body.skeleton import JOINT_NAMES, POSED_JOINT_NAMES, Skeleton
from mrhubo.rotation import axis_angle_to_matrix

ENDS = {"shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "ankle"}


def model(family: str) -> Skeleton:
    """A skeleton of our lengths whose limbs point where the family's do."""
    ours = Skeleton()
    offsets_J3 = ours.offsets_J3.clone()
    for joint, direction in FAMILIES[family].directions.items():
        side, name = joint.split("_")
        row = POSED_JOINT_NAMES.index(f"{side}_{ENDS[name]}")
        unit = torch.nn.functional.normalize(torch.tensor(direction), dim=0)
        offsets_J3[row] = offsets_J3[row].norm() * unit
    return Skeleton(offsets_J3)


@pytest.fixture
def local_BJ33() -> torch.Tensor:
    return axis_angle_to_matrix(torch.randn(8, 21, 3, generator=torch.Generator().manual_seed(0)))


@pytest.mark.parametrize("family", FAMILIES)
def test_limbs_are_where_the_family_has_them(family: str, local_BJ33: torch.Tensor) -> None:
    theirs, their_turns = model(family).keypoints_and_rotations(local_BJ33)
    ours, our_turns = Skeleton().keypoints_and_rotations(torch.from_numpy(from_family(local_BJ33.numpy(), family)))
    torch.testing.assert_close(ours, theirs, atol=3e-6, rtol=0)
    others = [i for i, name in enumerate(JOINT_NAMES) if name not in FAMILIES[family].directions]
    torch.testing.assert_close(our_turns[:, others], their_turns[:, others], atol=2e-6, rtol=0)
    assert float((our_turns - their_turns).abs().max()) > 0.05


@pytest.mark.parametrize("family", FAMILIES)
def test_there_and_back(family: str, local_BJ33: torch.Tensor) -> None:
    there_BJ33 = from_family(local_BJ33.numpy(), family)
    np.testing.assert_allclose(to_family(there_BJ33, family), local_BJ33.numpy(), atol=2e-6)


@pytest.mark.parametrize(
    ("family", "joint", "droop_deg", "turn_deg"),
    [
        ("smplx", "left_shoulder", 16, 18), ("smplx", "right_shoulder", 8, 9),
        ("smpl", "left_shoulder", 3, 7), ("smpl", "right_shoulder", 3, 6),
    ],
)  # fmt: skip
def test_known_angles(family: str, joint: str, droop_deg: float, turn_deg: float) -> None:
    """How far the upper arms hang below the horizontal, and are turned from along the x axis in all."""
    x, y, z = FAMILIES[family].directions[joint]
    assert math.degrees(math.atan2(-y, abs(x))) == pytest.approx(droop_deg, abs=0.7)
    assert math.degrees(math.atan2(math.hypot(y, z), abs(x))) == pytest.approx(turn_deg, abs=0.7)


def test_whose_rest_pose_a_skeleton_has() -> None:
    assert is_ours(Skeleton()) and is_ours(Skeleton(1.1 * Skeleton().offsets_J3))
    assert not is_ours(model("smpl")) and not is_ours(model("smplx"))
