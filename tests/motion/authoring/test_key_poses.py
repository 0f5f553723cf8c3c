"""Key poses become the rotations that they describe, on both sides, smoothly, on standing legs."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton
from mrhubo.motion.authoring.key_poses import Arm, Key, Performance, _quintic, perform
from mrhubo.motion.authoring.stance import Stance

HANG = Arm(upper=(0.1, -1, 0), fore=(0.1, -1, 0.3), palm=(-1, 0, 0))
LOOSE = 0.08
"""How far breathing and swaying may take a direction from its key [rad]."""


def _solve(done: Performance) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    local = Rotation.from_rotvec(done.pose_body_T63.reshape(-1, 3)).as_matrix().reshape(-1, 21, 3, 3)
    points, rotations = Skeleton().double().keypoints_and_rotations(torch.from_numpy(local))
    return (
        {name: points[:, i].numpy() for i, name in enumerate(KEYPOINT_NAMES)},
        {name: rotations[:, i].numpy() for i, name in enumerate(JOINT_NAMES)},
    )


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)))


DIRECTION = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.3)


@given(DIRECTION, DIRECTION, st.floats(-80, 80), st.integers(0, 9))
@settings(max_examples=40, deadline=None)
def test_arms_point_where_the_key_says(upper: tuple, fore: tuple, twist_deg: float, seed: int) -> None:
    flexion = _angle(np.array(upper), np.array(fore))
    if not np.radians(12) < flexion < np.radians(140):
        return
    inward = np.cross(upper, fore) / np.linalg.norm(np.cross(upper, fore))
    palm = Rotation.from_rotvec(np.radians(twist_deg) * np.array(fore) / np.linalg.norm(fore)).apply(inward)
    arm = Arm(upper, fore, tuple(palm))
    points, rotations = _solve(perform([Key(0, arm, arm, hold=0.05)], seed=seed))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        chest = rotations["spine3"][0].T
        shoulder, elbow, wrist = (points[f"{side}_{name}"][0] for name in ("shoulder", "elbow", "wrist"))
        mirror = np.array([sign, 1.0, 1.0])
        assert _angle(chest @ (elbow - shoulder) * mirror, np.array(upper)) < LOOSE
        assert _angle(chest @ (wrist - elbow) * mirror, np.array(fore)) < 2 * LOOSE
        down = -rotations[f"{side}_wrist"][0][:, 1]
        assert _angle(chest @ down * mirror, palm) < 3 * LOOSE


def test_the_elbow_is_a_hinge_that_only_flexes() -> None:
    straight, bent = HANG, Arm(upper=(0.1, -1, 0), fore=(0.1, 1, 0.6), palm=(-1, 0, 0))
    done = perform([Key(0, straight, straight), Key(1, bent, bent)])
    pose = dict(zip(POSED_JOINT_NAMES, done.pose_body_T63.reshape(-1, 21, 3).swapaxes(0, 1), strict=True))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        axis = np.array([0.0, -sign, 0.0])
        angle_T = pose[f"{side}_elbow"] @ axis
        np.testing.assert_allclose(pose[f"{side}_elbow"], angle_T[:, None] * axis, atol=1e-9)
        assert np.radians(2) <= angle_T.min() and angle_T.max() <= np.radians(150)


@pytest.mark.parametrize(
    ("arm", "message"),
    [
        (Arm((0, -1, 0), (0, -1, 0.01), (-1, 0, 0)), "left arm at 0.5 s: upper arm and forearm are in line"),
        (Arm((0, -1, 0), (0, 1, 0.1), (-1, 0, 0)), "left arm at 0.5 s: the elbow bends by 174 deg"),
        (Arm((0, -1, 0), (0, 0, 1), (1, 0, 0)), "left arm at 0.5 s: the palm asks for -?180 deg"),
    ],
)
def test_what_no_arm_can_do_is_refused(arm: Arm, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        perform([Key(0, HANG, HANG), Key(0.5, left=arm), Key(1, HANG, HANG)])


def test_lag_is_overlapping_action() -> None:
    level = Arm(upper=(1, 0, 0.1), fore=(0.3, 0.2, 1), palm=(0, -1, 0), wrist=(30, 0))
    done = perform([Key(0, HANG, HANG), Key(1, level, level, hold=0.5)])
    pose = done.pose_body_T63.reshape(-1, 21, 3)
    half = []
    for name in ("left_shoulder", "left_elbow", "left_wrist"):
        turned = Rotation.from_rotvec(pose[:, POSED_JOINT_NAMES.index(name)])
        way_T = (turned[0].inv() * turned).magnitude()
        half.append(int(np.argmax(way_T > way_T[-1] / 2)))
    assert half[0] < half[1] < half[2] < half[0] + 12


def test_torso_and_head_turn_as_told() -> None:
    done = perform([Key(0, HANG, HANG, torso=(30, 0, 0), head=(0, 0, 40), hold=0.1)])
    _, rotations = _solve(done)
    pelvis = Rotation.from_rotvec(done.root_orient_T3[0])
    chest = pelvis * Rotation.from_matrix(rotations["spine3"][0])
    assert _angle(chest.apply([0, 1, 0]), np.array([0, np.cos(np.pi / 6), np.sin(np.pi / 6)])) < LOOSE
    head = chest.inv() * pelvis * Rotation.from_matrix(rotations["head"][0])
    assert _angle(head.apply([0, 0, 1]), np.array([np.sin(np.radians(40)), 0, np.cos(np.radians(40))])) < LOOSE


def test_feet_stay_on_the_floor() -> None:
    keys = [
        Key(0, HANG, HANG),
        Key(1, torso=(40, 0, 0), stance=Stance(sink=12)),
        Key(2, torso=(0, 20, 30), stance=Stance(left=5, forward=3)),
        Key(3, HANG, HANG, torso=(0, -20, -30), stance=Stance()),
    ]
    done = perform(keys)
    points, _ = _solve(done)
    world = {n: Rotation.from_rotvec(done.root_orient_T3).apply(p) + done.trans_T3 for n, p in points.items()}
    for name in ("left_ankle", "right_ankle", "left_toe", "right_heel"):
        np.testing.assert_allclose(world[name], np.broadcast_to(world[name][0], world[name].shape), atol=2e-6)
    assert 0.0 < world["left_heel"][0, 1] < 0.03
    knees = done.pose_body_T63.reshape(-1, 21, 3)[
        :, [POSED_JOINT_NAMES.index(f"{s}_knee") for s in ("left", "right")], 0
    ]
    assert knees.min() > np.radians(5)


@given(st.lists(st.floats(-2, 2), min_size=2, max_size=6), st.lists(st.floats(0.2, 1), min_size=6, max_size=6))
@settings(max_examples=50, deadline=None)
def test_curves_go_through_keys_without_overshoot(values: list[float], steps: list[float]) -> None:
    moments_K = np.cumsum(steps[: len(values)])
    rows_K1 = np.array(values)[:, None]
    np.testing.assert_allclose(_quintic(moments_K, rows_K1, moments_K), rows_K1, atol=1e-9)
    curve = _quintic(moments_K, rows_K1, np.linspace(moments_K[0] - 1, moments_K[-1] + 1, 500))
    span = np.ptp(rows_K1)
    assert curve.min() >= rows_K1.min() - 0.1 * span - 1e-9 and curve.max() <= rows_K1.max() + 0.1 * span + 1e-9


def test_the_same_seed_gives_the_same_motion() -> None:
    keys = [Key(0, HANG, HANG, hold=0.5)]
    a, b, c = (perform(keys, seed=seed).pose_body_T63 for seed in (3, 3, 4))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 1e-4
