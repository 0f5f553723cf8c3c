"""Points in left-handed axes, as Unity's, are noticed and mirrored; those of right-handed axes stay as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.body.joints import KEYPOINT_NAMES
from mrhubo.body.skeleton import Skeleton
from mrhubo.config.live import LiveConfig
from mrhubo.live.body import SeenPose
from mrhubo.live.handedness import Handedness, way_forward
from mrhubo.live.messages import Landmarks, read_message
from mrhubo.live.pilot import Pilot
from mrhubo.live.turns import rotation_of
from mrhubo.live.vectors import Vector
from mrhubo.motion import read_motion
from mrhubo.motion.orientations import HEAD_POINTS
from mrhubo.motion.readers.keypoint_sets import SETS
from tests.live.messages import landmarks, message
from tests.live.robots import random_robot

TELLING = ["COCO", "Human3.6M", "OpenPose's BODY_25", "SMPL's body"]
"""Sets with a nose or toes."""
TURNS = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
"""Axes times angles [rad]."""


@pytest.fixture(scope="module")
def people(root: Path) -> list[dict[str, Vector]]:
    """Points of people who move."""
    found = []
    for name in ("conversation", "directing_traffic", "bow_and_greet"):
        motion = read_motion(root / "data" / "motions" / f"{name}.npz")
        point_TK3, turn_TJ33 = Skeleton().keypoints_and_rotations(motion.local_TJ33[::20])
        head_T33 = turn_TJ33[:, KEYPOINT_NAMES.index("head")].numpy()
        place = dict(zip(KEYPOINT_NAMES, point_TK3.numpy().transpose(1, 0, 2), strict=True))
        place |= {point: place["head"] + head_T33 @ np.array(at) for point, at in HEAD_POINTS.items()}
        found += [{point: tuple(at_T3[t].tolist()) for point, at_T3 in place.items()} for t in range(len(head_T33))]
    return found


def of_set(points: dict[str, Vector], name: str) -> dict[str, Vector]:
    return {point: points[point] for point in SETS[name] if point in points}


def mirrored(points: dict[str, Vector]) -> dict[str, Vector]:
    return {name: (-x, y, z) for name, (x, y, z) in points.items()}


@settings(max_examples=30, deadline=None)
@given(st.data(), st.sampled_from(TELLING), TURNS)
def test_axes_are_known_however_the_person_is_turned(people: list, data: st.DataObject, name: str, turn: tuple) -> None:
    rotation_33 = rotation_of(np.array(turn))
    told = of_set(data.draw(st.sampled_from(people)), name)
    turned = {point: tuple((rotation_33 @ np.array(at)).tolist()) for point, at in told.items()}
    assert Handedness().right(turned) == turned
    assert Handedness().right(mirrored(turned)) == turned


@pytest.mark.parametrize("left", [False, True])
def test_it_thinks_again_only_after_many_frames(people: list[dict[str, Vector]], left: bool) -> None:
    handedness = Handedness()
    first, other = (mirrored(people[0]), people[0]) if left else (people[0], mirrored(people[0]))
    for frame in [first] * 60 + [other] * 59:
        handedness.right(frame)
        assert handedness.mirrored == left
    for _ in range(61):
        handedness.right(other)
    assert handedness.mirrored != left


@pytest.mark.parametrize("bend", [0.1, 0.6])
def test_knees_that_are_bent_tell(people: list[dict[str, Vector]], bend: float) -> None:
    """Of points without a nose and toes."""
    person = {name: at for name, at in people[0].items() if name.split("_")[-1] in ("shoulder", "hip", "knee", "ankle")}
    for side in ("left", "right"):  # shins go backward
        (x, y, z), shin = person[f"{side}_knee"], 0.4
        person[f"{side}_ankle"] = (x, y - shin * np.cos(bend), z - shin * np.sin(bend))
    assert Handedness().right(person) == person
    assert Handedness().right(mirrored(person)) == (person if bend > 0.3 else mirrored(person))


def test_nothing_is_said_where_nothing_tells(people: list[dict[str, Vector]]) -> None:
    blind = {name: at for name, at in people[0].items() if name.split("_")[-1] in ("shoulder", "elbow", "wrist", "hip")}
    assert way_forward(blind) == way_forward({}) == 0.0
    assert Handedness().right(mirrored(blind)) == mirrored(blind)


@pytest.mark.parametrize("name", TELLING)
def test_left_handed_points_make_the_same_pose(people: list[dict[str, Vector]], name: str) -> None:
    def seen(points: dict[str, Vector]) -> np.ndarray:
        pilot, frame = Pilot(random_robot(0), LiveConfig(), True), read_message(landmarks(0, points)).content
        assert isinstance(frame, Landmarks)
        pose = pilot._pose(frame)
        assert isinstance(pose, SeenPose)
        return pose.local_J33

    for person in people[::9]:
        told = of_set(person, name)
        np.testing.assert_allclose(seen(mirrored(told)), seen(told), atol=1e-6)


def test_sets_whose_axes_are_known_are_not_mirrored() -> None:
    content = read_message(message(0, "landmarks", set="mediapipe", points=[[0.1, 0.2, 0.3]] * 33)).content
    assert isinstance(content, Landmarks) and content.axes_known
