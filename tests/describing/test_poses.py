"""The five poses are what they are called, and the same on both sides."""

from __future__ import annotations

import torch

from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.body.skeleton import mirror_rotations
from mrhubo.describing.poses import POSES, human_poses

LEFT, UP, FORWARD = torch.eye(3)
LIMBS = {  # upper arm, forearm
    "T": (LEFT, LEFT),
    "arms down": (-UP, -UP),
    "forward": (FORWARD, FORWARD),
    "elbows at right angles": (-UP, FORWARD),
    "hands up": (LEFT, UP),
}


def test_limbs_point_where_the_name_says() -> None:
    points = Skeleton().keypoints(human_poses())
    place = {name: points[:, KEYPOINT_NAMES.index(name)] for name in KEYPOINT_NAMES}
    for row, (name, expected) in enumerate(zip(POSES, (LIMBS[name] for name in POSES), strict=True)):
        for start, end, direction_3 in (("shoulder", "elbow", expected[0]), ("elbow", "wrist", expected[1])):
            limb_3 = place[f"left_{end}"][row] - place[f"left_{start}"][row]
            assert torch.allclose(torch.nn.functional.normalize(limb_3, dim=0), direction_3, atol=1e-5), name


def test_both_sides_do_the_same() -> None:
    assert torch.allclose(mirror_rotations(human_poses()), human_poses(), atol=1e-6)
