"""Points that come frame by frame make the pose that a motion reader makes of the whole motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.joints import KEYPOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.body.skeleton import Skeleton
from mrhubo.live.body import UPRIGHT_CONFIDENCE, Body, SeenPose
from mrhubo.motion import read_motion
from mrhubo.motion.positions import BodyPoints, motion_from_points

TOLD = [f"{side}_{name}" for side in ("left", "right")
        for name in ("shoulder", "elbow", "wrist", "hip", "index", "pinky", "eye")]  # fmt: skip


@pytest.fixture(scope="module")
def points(root: Path) -> dict[str, np.ndarray]:
    """Points (T, 3) of a person whose elbows are bent."""
    motion = read_motion(root / "data" / "motions" / "directing_traffic.npz")
    seen_TK3 = Skeleton().keypoints(motion.local_TJ33[::4]).numpy().astype(np.float64)
    found = {name: seen_TK3[:, KEYPOINT_NAMES.index(name)] for name in TOLD}
    return found | {"nose": (found["left_eye"] + found["right_eye"]) / 2 + [0.0, -0.03, 0.02]}


def see(body: Body, points: dict[str, np.ndarray], frame: int, without: tuple[str, ...] = ()) -> SeenPose:
    told = {n: tuple(point_T3[frame].tolist()) for n, point_T3 in points.items() if n not in without}
    found = body.see(told, {})
    assert found is not None
    return found


def joint(name: str) -> int:
    return POSED_JOINT_NAMES.index(name)


def test_as_a_reader_of_the_whole_motion_has_it(points: dict[str, np.ndarray]) -> None:
    body, frames = Body(), len(points["nose"])
    found = np.stack([see(body, points, frame).local_J33 for frame in range(frames)])
    wanted = motion_from_points(BodyPoints(points), "", 60.0, "").arrays.local_TJ33
    assert np.abs(found - wanted).max() < 1e-5
    assert np.allclose(found @ found.swapaxes(-1, -2), np.eye(3), atol=1e-5)


def test_a_turned_person_has_the_same_pose(points: dict[str, np.ndarray]) -> None:
    turn_33 = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn_33 *= np.linalg.det(turn_33)
    moved = {name: point_T3 @ turn_33.T + [3.0, 1.0, -2.0] for name, point_T3 in points.items()}
    assert np.abs(see(Body(), points, 9).local_J33 - see(Body(), moved, 9).local_J33).max() < 1e-6


def test_what_is_missing_stays_where_it_was_seen_from_the_trunk(points: dict[str, np.ndarray]) -> None:
    body = Body()
    before = see(body, points, 0)
    after = see(body, points, 20, without=("left_wrist", "left_index", "left_pinky"))
    assert after.sure_J[joint("left_elbow")] == after.sure_J[joint("left_wrist")] == 0
    assert after.sure_J[joint("left_shoulder")] == after.sure_J[joint("right_elbow")] == 1
    assert np.abs(after.local_J33[joint("right_elbow")] - before.local_J33[joint("right_elbow")]).max() > 0.01
    hidden = see(
        body,
        points,
        30,
        without=tuple(n for n in points if n.startswith("left") and "hip" not in n and "shoulder" not in n),
    )
    for name in ("left_shoulder", "left_elbow", "left_wrist"):
        assert hidden.sure_J[joint(name)] == 0
        assert np.abs(hidden.local_J33[joint(name)] - after.local_J33[joint(name)]).max() < 1e-3, name


def test_sure_is_as_the_least_sure_point_is(points: dict[str, np.ndarray]) -> None:
    told = {name: tuple(point_T3[0].tolist()) for name, point_T3 in points.items()}
    found = Body().see(told, {"left_wrist": 0.4, "left_index": 0.7})
    assert found is not None
    assert found.sure_J[joint("left_elbow")] == 0.4 and found.sure_J[joint("left_shoulder")] == 1.0


def test_without_hips_the_trunk_is_upright(points: dict[str, np.ndarray]) -> None:
    found = see(Body(), points, 0, without=("left_hip", "right_hip"))
    assert found.sure_J[joint("spine3")] == UPRIGHT_CONFIDENCE == found.sure_J.max()
    # these motions stand upright, and the hips lie below the shoulders but for some degrees
    assert np.abs(found.local_J33 - see(Body(), points, 0).local_J33).max() < 0.2


def test_nothing_is_told_before_the_shoulders_are_seen() -> None:
    assert Body().see({"left_wrist": (0.0, 0.0, 0.0)}, {}) is None
    same = (1.0, 1.0, 1.0)
    assert (
        Body().see({f"{side}_{name}": same for side in ("left", "right") for name in ("shoulder", "hip")}, {}) is None
    )


def test_arms_that_have_never_been_seen_hang(points: dict[str, np.ndarray]) -> None:
    arms = tuple(name for name in points if "hip" not in name and "shoulder" not in name)
    found = see(Body(), points, 0, without=arms)
    turns = Skeleton().keypoints_and_rotations(__import__("torch").from_numpy(found.local_J33[None]))[0][0].numpy()
    for side in ("left", "right"):
        arm = turns[KEYPOINT_NAMES.index(f"{side}_wrist")] - turns[KEYPOINT_NAMES.index(f"{side}_shoulder")]
        chest_up = turns[KEYPOINT_NAMES.index("spine3")] - turns[KEYPOINT_NAMES.index("spine2")]
        assert arm @ chest_up < -0.95 * np.linalg.norm(arm) * np.linalg.norm(chest_up)
