"""Joints that are worked out from markers are those of the body that wears them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from mrhubo.body.joints import JOINT_NAMES
from mrhubo.fast.plain.human import norm
from mrhubo.fast.rotations import angles_between
from mrhubo.motion.readers.markers.joints import body_of_markers
from tests.motion.marker_writer import markers_on
from tests.motion.readers.markers.bodies import moving_body

_LIMBS = [(f"{side}_{joint}") for side in ("left", "right") for joint in ("hip", "knee", "ankle", "elbow", "wrist")]


def farthest(points: Mapping[str, np.ndarray], place_TJ3: np.ndarray, joints: list[str]) -> float:
    """How far joints are from where they should be [m], at most."""
    return max(float(norm(points[joint] - place_TJ3[:, JOINT_NAMES.index(joint)]).max()) for joint in joints)


@pytest.mark.parametrize("motion", ["boxing", "bow_and_greet", "pointing"])
@pytest.mark.parametrize("both_sides", [False, True])
def test_joints_are_between_markers_or_beside_one(motion: str, both_sides: bool) -> None:
    place_TJ3, world_TJ33 = moving_body(motion)
    body = body_of_markers(markers_on(place_TJ3, world_TJ33, both_sides))
    assert farthest(body.points, place_TJ3, _LIMBS) < 0.006
    assert farthest(body.points, place_TJ3, ["left_shoulder", "right_shoulder"]) < 0.02  # collars turn
    for part in ("pelvis", "spine3", "head"):
        turned = angles_between(body.turns[part], world_TJ33[:, JOINT_NAMES.index(part)])
        assert turned.max() < 1e-3, part


def test_hinges_are_those_of_the_bones_also_where_limbs_are_straight() -> None:
    place_TJ3, world_TJ33 = moving_body("pointing")
    body = body_of_markers(markers_on(place_TJ3, world_TJ33))
    for side, sign in (("left", -1.0), ("right", 1.0)):
        wanted = world_TJ33[:, JOINT_NAMES.index(f"{side}_shoulder")] @ np.array([0, sign, 0])
        assert (body.hinges[f"{side}_shoulder"] * wanted).sum(-1).min() > 0.97
        wanted = world_TJ33[:, JOINT_NAMES.index(f"{side}_hip")] @ np.array([1.0, 0, 0])
        assert (body.hinges[f"{side}_hip"] * wanted).sum(-1).min() > 0.97


def test_somebody_of_another_build_is_a_centimetre_off() -> None:
    place_TJ3, world_TJ33 = moving_body("boxing")
    body = body_of_markers(markers_on(place_TJ3, world_TJ33, build=1.2))
    assert farthest(body.points, place_TJ3, _LIMBS) < 0.015


@pytest.mark.parametrize("hidden", ["left_front_pelvis", "right_back_pelvis", "front_low", "left_back_head"])
def test_a_hidden_marker_of_a_rigid_part_is_where_three_others_tell(hidden: str) -> None:
    place_TJ3, world_TJ33 = moving_body("bow_and_greet")
    markers = markers_on(place_TJ3, world_TJ33)
    whole = body_of_markers(markers)
    markers[hidden] = np.where(np.arange(len(place_TJ3))[:, None] % 5 < 3, np.nan, markers[hidden])
    body = body_of_markers(markers)
    for name, point_T3 in whole.points.items():
        np.testing.assert_allclose(body.points[name], point_T3, atol=1e-6)
    for name, turn_T33 in whole.turns.items():
        np.testing.assert_allclose(body.turns[name], turn_T33, atol=1e-6)


def test_what_no_marker_tells_is_left_open() -> None:
    """Without arms' and legs' markers, and with a sacrum in place of the pelvis' two at the back."""
    place_TJ3, world_TJ33 = moving_body("boxing")
    markers = markers_on(place_TJ3, world_TJ33)
    kept = {name: markers[name] for name in markers if "acromion" in name or "front_pelvis" in name}
    kept["sacrum"] = (markers["left_back_pelvis"] + markers["right_back_pelvis"]) / 2
    body = body_of_markers(kept)
    assert body.points.keys() == {f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "shoulder")}
    assert body.turns.keys() == {"pelvis"} and not body.hinges
    assert farthest(body.points, place_TJ3, ["left_hip", "right_hip"]) < 0.002
    hidden = {**markers, "left_lateral_elbow": np.full_like(markers["left_lateral_elbow"], np.nan)}
    assert np.isnan(body_of_markers(hidden).points["left_elbow"]).all()
