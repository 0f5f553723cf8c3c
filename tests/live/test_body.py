"""Points that come frame by frame make the pose that a motion reader makes of the whole motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.body.joints import KEYPOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.body.skeleton import Skeleton
from mrhubo.fast.rotations import are_crooked
from mrhubo.live.body import UPRIGHT_CONFIDENCE, Body, SeenPose
from mrhubo.motion import Motion, read_motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from tests.reference.standing.steppers import moved, walk

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


@pytest.mark.parametrize("tells_middle", [False, True])
def test_arms_of_senders_without_points_of_hands_are_sure(points: dict[str, np.ndarray], tells_middle: bool) -> None:
    """As COCO's, Human3.6M's, SMPL's, PICO's: such hands rest on their forearms. Hands that were seen and are lost are
    not sure.
    """
    body = Body()
    told = {n: at for n, at in points.items() if n.split("_")[-1] not in ("index", "middle", "pinky")}
    middle = {f"{side}_middle": told[f"{side}_wrist"] + 0.1 for side in ("left", "right")}  # too little for a turn
    without = see(body, told | middle if tells_middle else told, 3)
    wrists = [joint(f"{side}_wrist") for side in ("left", "right")]
    assert (without.sure_J[wrists] == 1).all() and np.abs(without.local_J33[wrists] - np.eye(3)).max() < 1e-6
    see(body, points, 4)
    lost = see(body, told, 5)
    assert (lost.sure_J[wrists] == 0).all() and np.abs(lost.local_J33[wrists] - np.eye(3)).max() > 0.1


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


PLACES = st.tuples(*[st.one_of(st.sampled_from([0.0, 1.0, -1.0]), st.floats(-1e3, 1e3))] * 3)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.dictionaries(st.sampled_from([*TOLD, "nose"]), PLACES), max_size=4))
def test_whatever_the_points_are_the_pose_is_rotations(frames: list[dict[str, tuple[float, float, float]]]) -> None:
    body = Body()
    for told in frames:
        found = body.see(told, {})
        if found is not None:
            assert not are_crooked(found.local_J33).any() and ((found.sure_J >= 0) & (found.sure_J <= 1)).all()


def test_nothing_is_told_before_the_shoulders_are_seen() -> None:
    assert Body().see({"left_wrist": (0.0, 0.0, 0.0)}, {}) is None
    same = (1.0, 1.0, 1.0)
    assert (
        Body().see({f"{side}_{name}": same for side in ("left", "right") for name in ("shoulder", "hip")}, {}) is None
    )


def test_arms_that_have_never_been_seen_hang(points: dict[str, np.ndarray]) -> None:
    arms = tuple(name for name in points if "hip" not in name and "shoulder" not in name)
    found = see(Body(), points, 0, without=arms)
    turns = Skeleton().keypoints_and_rotations(torch.from_numpy(found.local_J33[None]))[0][0].numpy()
    for side in ("left", "right"):
        arm = turns[KEYPOINT_NAMES.index(f"{side}_wrist")] - turns[KEYPOINT_NAMES.index(f"{side}_shoulder")]
        chest_up = turns[KEYPOINT_NAMES.index("spine3")] - turns[KEYPOINT_NAMES.index("spine2")]
        assert arm @ chest_up < -0.95 * np.linalg.norm(arm) * np.linalg.norm(chest_up)


# Legs and root


def walking_points(motion: Motion, scale: float = 1.0) -> tuple[list[dict[str, tuple]], Motion]:
    """Points of a person in the world, whose body is of another size."""
    point_TK3 = Skeleton().keypoints(motion.local_TJ33).numpy().astype(np.float64)
    arrays = motion.arrays
    assert arrays.root_rotation_T33 is not None and arrays.root_position_T3 is not None
    point_TK3 = point_TK3 @ arrays.root_rotation_T33.mT + arrays.root_position_T3[:, None]
    return [dict(zip(KEYPOINT_NAMES, map(tuple, (scale * at_K3).tolist()), strict=True)) for at_K3 in point_TK3], motion


@pytest.mark.parametrize("scale", [1.0, 0.8])
def test_legs_and_root_of_a_person_of_any_size(scale: float) -> None:
    """Thighs, shins and feet point as they do, and the pelvis is where one of our skeleton would have it."""
    told, motion = walking_points(moved(walk(40), 0.7, (2.0, 0.0, -1.0)), scale)
    arrays, body = motion.arrays, Body(has_legs=True)
    assert arrays.root_rotation_T33 is not None and arrays.root_position_T3 is not None
    for t, points in enumerate(told):
        found = body.see(points, {}, in_world=True)
        assert found is not None and found.root is not None and found.root.place_3 is not None
        assert (
            found.sure_J[[joint(f"{s}_{n}") for s in ("left", "right") for n in ("hip", "knee", "ankle")]] == 1
        ).all()
        np.testing.assert_allclose(found.root.turn_33, arrays.root_rotation_T33[t], atol=1e-4)
        np.testing.assert_allclose(found.root.place_3, arrays.root_position_T3[t], atol=1e-4)
        seen_K3, wanted_K3 = (
            Skeleton().keypoints(torch.as_tensor(local, dtype=torch.float32)[None])[0].numpy()
            for local in (found.local_J33, arrays.local_TJ33[t])
        )
        legs = [i for i, name in enumerate(KEYPOINT_NAMES) if name.split("_")[-1] in ("knee", "ankle", "toe", "heel")]
        np.testing.assert_allclose(seen_K3[legs], wanted_K3[legs], atol=1e-3)


def test_legs_that_are_hidden_are_not_sure_and_stay() -> None:
    told, _ = walking_points(walk(30))
    body = Body(has_legs=True)
    before = body.see(told[0], {}, in_world=True)
    without = {name: at for name, at in told[-1].items() if not name.startswith(("left_knee", "right_ankle"))}
    after = body.see(without, {}, in_world=True)
    assert before is not None and after is not None
    for name, sure in (("left_hip", 0), ("left_knee", 0), ("right_hip", 1), ("right_knee", 0), ("left_shoulder", 1)):
        assert after.sure_J[joint(name)] == sure, name
    hip = joint("left_hip")
    np.testing.assert_allclose(after.local_J33[hip] @ [0, -1, 0], before.local_J33[hip] @ [0, -1, 0], atol=0.02)
    assert after.root is not None and after.root.place_3 is not None and np.isfinite(after.root.place_3).all()
    hips_hidden = {name: at for name, at in told[-1].items() if not name.endswith("hip")}
    assert max(body.see(hips_hidden, {}, in_world=True).sure_J[joint(f"{s}_hip")] for s in ("left", "right")) == 0  # pyright: ignore


def test_who_has_no_legs_is_seen_as_ever(points: dict[str, np.ndarray]) -> None:
    told, _ = walking_points(walk(3))
    found = Body().see(told[-1], {}, in_world=True)
    assert found is not None and found.root is None
    assert (found.local_J33[[joint(f"{s}_{n}") for s in ("left", "right") for n in ("hip", "knee", "ankle")]] == np.eye(3)).all()  # fmt: skip
