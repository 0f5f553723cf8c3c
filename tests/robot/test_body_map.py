"""Directions that robot and human share, and the keypoints chained along them."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, mirror_pose
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.robot import BodyMap, build_body_map

ROBOTS = ["nao", "coman", "reachy"]


def body_map_of(root: Path, name: str, **keypoints: Any) -> BodyMap:
    config = load_config(root / "conf" / f"{name}.yaml").robot
    config.keypoints.update(keypoints)
    for key in [key for key, value in keypoints.items() if value is None]:
        del config.keypoints[key]
    return build_body_map(config)


@functools.cache
def shipped(root: Path, name: str) -> BodyMap:
    return body_map_of(root, name)


def directions(body_map: BodyMap, count: int = 50) -> torch.Tensor:
    return body_map.robot_directions(
        body_map.robot.forward(body_map.robot.sample(count, torch.Generator().manual_seed(0)))
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_directions_are_unit_and_keypoints_have_the_humans_lengths(root: Path, name: str) -> None:
    body_map = shipped(root, name)
    found = directions(body_map)
    torch.testing.assert_close(found.norm(dim=-1), torch.ones(found.shape[:2]), atol=1e-5, rtol=0)
    points = body_map.human_keypoints(found)
    rest = dict(zip(KEYPOINT_NAMES, body_map.skeleton.rest_K3, strict=True))
    at = {n: points[:, i] for i, n in enumerate(body_map.keypoint_names)}
    bones = [("left_shoulder", "left_elbow"), ("right_elbow", "right_wrist"), ("left_wrist", "left_thumb"),
             ("right_index", "right_pinky"), ("neck", "head"), ("left_eye", "right_eye")]  # fmt: skip
    for a, b in bones:
        if a in at and b in at:
            expected = (rest[a] - rest[b]).norm().expand(50)
            torch.testing.assert_close((at[a] - at[b]).norm(dim=-1), expected, atol=1e-5, rtol=0)


@pytest.mark.parametrize("name", ROBOTS)
def test_keypoints_keep_the_directions(root: Path, name: str) -> None:
    body_map = shipped(root, name)
    found = directions(body_map)
    at = dict(zip(body_map.keypoint_names, body_map.human_keypoints(found).unbind(1), strict=True))
    for i, direction in enumerate(body_map.direction_names):
        if direction.endswith(("elbow", "wrist")):
            start = direction.replace("wrist", "_").replace("elbow", "shoulder").replace("_shoulder", "_shoulder")
            start = (
                direction.replace("elbow", "shoulder") if "elbow" in direction else direction.replace("wrist", "elbow")
            )
            seen = torch.nn.functional.normalize(at[direction] - at[start], dim=-1)
            torch.testing.assert_close(seen, found[:, i], atol=1e-5, rtol=0)


def test_zero_poses_look_as_they_should(root: Path) -> None:
    """NAO's arms point forward at zero, COMAN's and Reachy's hang down; Reachy looks ahead."""
    forward, down, up = torch.tensor([0.0, 0, 1]), torch.tensor([0.0, -1, 0]), torch.tensor([0.0, 1, 0])
    for name, expected in (("nao", forward), ("coman", down), ("reachy", down)):
        body_map = shipped(root, name)
        zero = body_map.robot_directions(body_map.robot.forward(body_map.robot.home()[None]))[0]
        at = dict(zip(body_map.direction_names, zero, strict=True))
        for side in ("left", "right"):
            assert float(at[f"{side}_elbow"] @ expected) > 0.98
        if "head_up" in at:
            assert float(at["head_forward"] @ forward) > 0.999 and float(at["head_up"] @ up) > 0.999


@pytest.mark.parametrize("name", ROBOTS)
def test_human_directions_are_seen_from_the_chest_and_mirror(root: Path, name: str) -> None:
    body_map = shipped(root, name)
    pose = rotation.axis_angle_to_matrix(0.6 * torch.randn(20, 21, 3))
    found = body_map.human_directions(pose)
    lengths = found.norm(dim=-1)
    torch.testing.assert_close(lengths[:, body_map.measured], torch.ones(20, len(body_map.measured)), atol=1e-5, rtol=0)
    assert float(lengths.max()) < 1 + 1e-5
    leaning = pose.clone()
    leaning[:, [2, 5]] = rotation.axis_angle_to_matrix(torch.randn(20, 2, 3))
    torch.testing.assert_close(body_map.human_directions(leaning), found, atol=1e-5, rtol=0)
    names = body_map.direction_names
    swap = [names.index(_other_side(n)) for n in names]
    mirrored_pose = rotation.stack_columns(mirror_pose(rotation.matrix_to_sixd(pose)))
    mirrored = body_map.human_directions(mirrored_pose)[:, swap] * _in_a_mirror(body_map)
    torch.testing.assert_close(mirrored, found, atol=1e-5, rtol=0)


def _in_a_mirror(body_map: BodyMap) -> torch.Tensor:
    """Signs (D, 3) of directions in a mirror; about an axis what turned one way turns the other way."""
    signs = torch.tensor([-1.0, 1.0, 1.0]).repeat(len(body_map.directions), 1)
    signs[body_map.shared.bend_columns] *= -1
    return signs


def _other_side(name: str) -> str:
    return name.replace("left", "~").replace("right", "left").replace("~", "right")


@pytest.mark.parametrize("name", ROBOTS)
def test_the_mirrored_robot_has_mirrored_directions(root: Path, name: str) -> None:
    """Left and right entries of a YAML are mirror images: a swap of the arms' angles mirrors every direction."""
    body_map = shipped(root, name)
    joints = body_map.robot.joint_names
    rolls = ("Roll", "Yaw", "Lat", "Wrj2", "Plate", "yaw", "roll", "neck_roll", "neck_yaw")
    sign = torch.tensor([-1.0 if j.endswith(rolls) else 1.0 for j in joints])
    swap = [joints.index(_swap_joint(j, joints)) for j in joints]
    q = body_map.robot.sample(30, torch.Generator().manual_seed(0))
    a = body_map.robot_directions(body_map.robot.forward(q))
    b = body_map.robot_directions(body_map.robot.forward((q * sign)[:, swap]))
    names = body_map.direction_names
    mirrored = b[:, [names.index(_other_side(n)) for n in names]] * _in_a_mirror(body_map)
    torch.testing.assert_close(mirrored, a, atol=2e-3, rtol=0)


def _swap_joint(name: str, joints: tuple[str, ...]) -> str:
    for a, b in (("L", "R"), ("R", "L"), ("l_", "r_"), ("r_", "l_")):
        if name.startswith(a) and b + name[len(a) :] in joints:
            return b + name[len(a) :]
    return name


def test_input_joints_follow_what_the_robot_has(root: Path) -> None:
    assert "left_wrist" not in shipped(root, "nao").input_joints()
    assert "left_wrist" in shipped(root, "coman").input_joints()
    assert {"neck", "head"} <= set(shipped(root, "reachy").input_joints())


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"left_elbo": "LElbow"}, r"body part 'left_elbo' does not exist; nearest: 'left_elbow'"),
        ({"chest": None}, r"'chest' is missing"),
        ({"chest": "torsoo"}, r"link 'torsoo' does not exist in .*nao.urdf; nearest: 'torso'"),
        ({"left_elbow": None}, r"left_wrist: needs 'left_elbow' too"),
        (
            {"left_elbow": {"link": "LElbow", "ofset": [0, 0, 0]}},
            r"left_elbow.ofset' does not exist; nearest: '.*offset'",
        ),
        ({"left_elbow": {"link": "LElbow", "offset": [0, 0]}}, r"offset must be three numbers .*, found \[0, 0\]"),
        (
            {"left_elbow": {"link": "LElbow", "offset": [0, 0, float("nan")]}},
            r"offset\[2\] must be a number .*, found nan",
        ),
        ({"left_elbow": {"offset": [0, 0, 0]}}, r"a required key is missing: robot.keypoints.left_elbow.link"),
        ({"left_elbow": "LBicep"}, r"'left_shoulder' and 'left_elbow' lie on one point"),
        ({"left_hand": "l_wrist"}, r"'fingers' is missing"),
        ({"left_hand": {"link": "l_wrist", "fingers": [1, 0, 0], "thumb": [2, 0, 0]}}, r"two different directions"),
        ({"left_wrist": None}, r"'LElbowYaw' turns no limb, hand or head"),
    ],
)
def test_wrong_entries_are_refused(root: Path, entries: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        body_map_of(root, "nao", **entries)
