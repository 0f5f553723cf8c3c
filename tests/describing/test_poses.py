"""The five poses are what they are called, and the same on both sides."""

from __future__ import annotations

import torch

from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.body.skeleton import mirror_rotations
from mrhubo.describing.poses import POSES, human_poses, pose_names

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
    for whole_body in (False, True):
        poses = human_poses(whole_body)
        assert torch.allclose(mirror_rotations(poses), poses, atol=1e-6)


def test_legs_and_back_do_what_the_name_says() -> None:
    points = Skeleton().keypoints(human_poses(whole_body=True))
    place = {name: points[:, KEYPOINT_NAMES.index(name)] for name in KEYPOINT_NAMES}
    rows = {name.partition(", ")[2]: row for row, name in enumerate(pose_names(whole_body=True))}
    thigh, foot = (
        torch.nn.functional.normalize(place[f"left_{end}"] - place[f"left_{start}"], dim=-1)
        for start, end in (("hip", "knee"), ("heel", "toe"))
    )
    assert thigh[rows["legs apart"]] @ LEFT > 0.3 and thigh[rows["squatting"]] @ FORWARD > 0.6
    assert thigh[rows["standing"]] @ UP < -0.95 and foot[rows["feet out"]] @ LEFT > foot[rows["standing"]] @ LEFT + 0.3
    assert abs(foot[rows["squatting"]] @ UP - foot[rows["standing"]] @ UP) < 0.05, "soles stay flat"
    back = place["neck"] - place["pelvis"]
    assert (back[rows["back bent"]] - back[rows["standing"]]) @ FORWARD > 0.1
