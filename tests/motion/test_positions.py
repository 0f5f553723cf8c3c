"""From points of a body to a motion: limbs point as the points do, and what points leave open is continuous."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from torch import Tensor

from mrhubo import UserError
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, SIDES, Skeleton
from mrhubo.motion import read_motion, resample
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.rotation import axis_angle_to_matrix, geodesic_distance, random_axes

FRAMES = 40


def body_of(local_TJ33: Tensor, with_turns: bool = True) -> BodyPoints:
    """Points, and how trunk, head, hands and feet are turned, of rotations."""
    point, turn = Skeleton().double().keypoints_and_rotations(local_TJ33)
    points = {name: point[:, i].numpy() for i, name in enumerate(KEYPOINT_NAMES)}
    told = ("pelvis", "spine3", "head", *(f"{side}_{joint}" for side in SIDES for joint in ("wrist", "ankle")))
    return BodyPoints(points, {name: turn[:, JOINT_NAMES.index(name)].numpy() for name in told} if with_turns else {})


def convert(body: BodyPoints) -> Tensor:
    return motion_from_points(body, "test", 30.0, "a test").local_TJ33.double()


def random_poses(seed: int) -> Tensor:
    """Rotations (T, 21, 3, 3), any."""
    generator = torch.Generator().manual_seed(seed)
    angle = torch.rand(FRAMES, 21, 1, generator=generator, dtype=torch.float64)
    return axis_angle_to_matrix(angle * random_axes(FRAMES, 21, generator=generator, dtype=torch.float64))


def test_limbs_hands_feet_and_head_are_kept_whatever_the_pose() -> None:
    pose = random_poses(0)
    skeleton = Skeleton().double()
    before, after = skeleton.global_rotations(pose), skeleton.global_rotations(convert(body_of(pose)))
    for name in ("spine3", "head", "left_wrist", "right_wrist", "left_ankle", "right_ankle"):
        i = JOINT_NAMES.index(name)
        assert float(geodesic_distance(before[:, i], after[:, i]).max()) < 1e-5, name
    rest = skeleton.rest_K3
    for joint, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle")):
        for side in SIDES:
            i, j = KEYPOINT_NAMES.index(f"{side}_{joint}"), KEYPOINT_NAMES.index(f"{side}_{end}")
            bone_3 = rest[j] - rest[i]
            torch.testing.assert_close(before[:, i] @ bone_3, after[:, i] @ bone_3, atol=1e-5, rtol=0)


def arm(bend_T: Tensor, turn_T3: Tensor) -> Tensor:
    """Poses in which the left arm alone moves: elbow bent by some angles, shoulder turned."""
    turn_TJ3 = torch.zeros(len(bend_T), 21, 3, dtype=torch.float64)
    turn_TJ3[:, POSED_JOINT_NAMES.index("left_shoulder")] = turn_T3
    turn_TJ3[:, POSED_JOINT_NAMES.index("left_elbow"), 1] = -bend_T
    return axis_angle_to_matrix(turn_TJ3)


def test_an_arm_that_is_stretched_keeps_its_twist() -> None:
    bend_T = torch.cat((torch.linspace(1.0, 0.0, 20), torch.linspace(0.0, 1.0, 20))).double()
    twist = torch.tensor([0.9, 0.0, 0.0], dtype=torch.float64).expand(FRAMES, 3)  # about the upper arm
    pose = arm(bend_T, twist)
    found = convert(body_of(pose, with_turns=False))
    shoulder = POSED_JOINT_NAMES.index("left_shoulder")
    assert float(geodesic_distance(found[:, shoulder], pose[:, shoulder]).max()) < 1e-3


def test_the_twist_of_a_straight_arm_goes_evenly_from_one_bent_pose_to_the_next() -> None:
    bend_T = torch.full((FRAMES,), 0.02, dtype=torch.float64)
    bend_T[:3] = bend_T[-3:] = 1.0
    angle_T = torch.linspace(0, 1.2, FRAMES, dtype=torch.float64)
    pose = arm(bend_T, angle_T[:, None] * torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64))
    found = convert(body_of(pose, with_turns=False))[:, POSED_JOINT_NAMES.index("left_shoulder")]
    step_T = geodesic_distance(found[:-1], found[1:])
    assert float(step_T.max()) < 0.1  # nothing jumps


def test_a_bone_that_tells_its_own_turn_is_believed_where_the_arm_is_straight() -> None:
    pose = arm(torch.zeros(FRAMES, dtype=torch.float64), torch.tensor([0.7, 0.2, 0.1]).double().expand(FRAMES, 3))
    body = body_of(pose)
    shoulder = Skeleton().double().global_rotations(pose)[:, JOINT_NAMES.index("left_shoulder")]
    down = torch.tensor([0.0, -1.0, 0.0], dtype=torch.float64)
    found = convert(BodyPoints(body.points, body.turns, {"left_shoulder": (shoulder @ down).numpy()}))
    place = POSED_JOINT_NAMES.index("left_shoulder")
    assert float(geodesic_distance(found[:, place], pose[:, place]).max()) < 1e-5


def test_a_knee_that_seems_to_bend_backward_is_a_straight_one() -> None:
    turn_TJ3 = torch.zeros(FRAMES, 21, 3, dtype=torch.float64)
    turn_TJ3[:, POSED_JOINT_NAMES.index("left_knee"), 0] = -0.3  # 17 degrees the wrong way
    found = convert(body_of(axis_angle_to_matrix(turn_TJ3), with_turns=False))
    hip = found[:, POSED_JOINT_NAMES.index("left_hip")]
    assert float(geodesic_distance(hip, torch.eye(3).double().expand_as(hip)).max()) < 0.01


def test_points_that_are_never_seen() -> None:
    body = body_of(random_poses(1))
    points = {name: point for name, point in body.points.items() if not name.startswith("left_wrist")}
    motion = motion_from_points(BodyPoints(points, body.turns), "test", 30.0, "a test")
    assert "left elbow to left wrist is never seen: completed by the body prior" in " ".join(motion.notes)
    assert motion.confidence_TJ is not None
    assert not motion.confidence_TJ[:, POSED_JOINT_NAMES.index("left_elbow")].any()
    assert bool(motion.local_TJ33.isfinite().all())
    others = {name: point for name, point in points.items() if name.endswith(("shoulder", "hip"))}
    alone = motion_from_points(BodyPoints(others), "test", 30.0, "a test")
    assert sum("completed by the body prior" in note for note in alone.notes) == 4
    assert bool(alone.local_TJ33.isfinite().all())
    with pytest.raises(UserError, match="chest"):
        motion_from_points(BodyPoints({"left_hip": body.points["left_hip"]}), "test", 30.0, "a test")


def limb_errors(found: Tensor, pose: Tensor, side: str) -> Tensor:
    """Angles (T, 2) [deg] of upper arm and forearm, seen from the chest."""
    directions = []
    for local in (found, pose):
        point, turn = Skeleton().double().keypoints_and_rotations(local.double())
        places = [KEYPOINT_NAMES.index(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist")]
        bones = torch.nn.functional.normalize(point[:, places].diff(dim=1), dim=-1)
        directions.append(bones @ turn[:, JOINT_NAMES.index("spine3")])
    return torch.rad2deg(torch.arccos((directions[0] * directions[1]).sum(-1).clamp(-1, 1)))


def test_a_forearm_that_is_never_seen_is_nearer_than_one_in_line(root: Path) -> None:
    """Of people who move, elbows are bent; nothing turns fast between the frames that the prior was asked for."""
    pose = resample(read_motion(root / "data" / "motions" / "boxing.npz"), 10.0).local_TJ33[:60].double()
    body = body_of(pose, with_turns=False)
    hidden = ("left_wrist", "left_thumb", "left_index", "left_middle", "left_pinky")
    points = {name: point for name, point in body.points.items() if name not in hidden}
    motion = motion_from_points(BodyPoints(points), "test", 10.0, "a test")
    upper_T, forearm_T = limb_errors(motion.local_TJ33, pose, "left").unbind(1)
    in_line = arm_in_line(pose)
    assert float(forearm_T.mean()) < 0.6 * float(in_line.mean())
    seen = torch.cat((upper_T, limb_errors(motion.local_TJ33, pose, "right").flatten()))
    assert float(seen.max()) < 5.0, "what is seen stays as it is, but for the bend of the back that points do not tell"


def arm_in_line(pose: Tensor) -> Tensor:
    """How far (T,) [deg] the left elbow is bent."""
    point = Skeleton().double().keypoints(pose)
    places = [KEYPOINT_NAMES.index(f"left_{joint}") for joint in ("shoulder", "elbow", "wrist")]
    upper_T3, forearm_T3 = torch.nn.functional.normalize(point[:, places].diff(dim=1), dim=-1).unbind(1)
    return torch.rad2deg(torch.arccos((upper_T3 * forearm_T3).sum(-1).clamp(-1, 1)))
