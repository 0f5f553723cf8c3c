"""Names of points, and of the bones that begin at them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.motion.readers.point_names import by_names, our_name
from tests.motion.bvh_writer import NAMES, Style, names_of

ARKIT = {
    "pelvis": "hips_joint", "left_collar": "left_shoulder_1_joint", "left_shoulder": "left_arm_joint",
    "left_elbow": "left_forearm_joint", "left_wrist": "left_hand_joint", "left_hip": "left_upLeg_joint",
    "left_knee": "left_leg_joint", "left_ankle": "left_foot_joint", "neck": "neck_1_joint", "head": "head_joint",
}  # fmt: skip
UNREAL = {
    "pelvis": "pelvis", "left_collar": "clavicle_l", "left_shoulder": "upperarm_l", "left_elbow": "lowerarm_l",
    "left_wrist": "hand_l", "left_hip": "thigh_l", "left_knee": "calf_l", "left_ankle": "foot_l", "left_foot": "ball_l",
}  # fmt: skip
XSENS = {
    "pelvis": "Pelvis", "left_collar": "LeftShoulder", "left_shoulder": "LeftUpperArm", "left_elbow": "LeftForeArm",
    "left_wrist": "LeftHand", "left_hip": "LeftUpperLeg", "left_knee": "LeftLowerLeg", "left_ankle": "LeftFoot",
    "left_toe": "LeftToe",
}  # fmt: skip
POINTS = {
    "left_shoulder": "LShoulder", "left_elbow": "LElbow", "left_wrist": "LWrist", "left_hip": "LHip",
    "left_knee": "LKnee", "left_ankle": "LAnkle", "nose": "Nose", "neck": "Neck", "left_collar": "LClavicle",
}  # fmt: skip
FEET = {"left_hip": "LeftHip", "left_knee": "LeftKnee", "left_ankle": "LeftFoot", "left_shoulder": "LeftShoulder"}
STYLES = [ARKIT, UNREAL, XSENS, POINTS, FEET]
MAKERS = [maker for maker in NAMES if maker not in ("nameless", "daz", "acclaim")]
LIMBS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")


@pytest.mark.parametrize("suffix", ["", "_position", " pos"])
@given(style=st.sampled_from(STYLES), order=st.randoms(use_true_random=False))
def test_names_of_points_and_of_bones_are_those_of_points(suffix: str, style: dict[str, str], order) -> None:
    ours = list(style)
    order.shuffle(ours)
    found = by_names([style[name] + suffix for name in ours])
    assert {name: found.get(name) for name in ours} == {name: place for place, name in enumerate(ours)}


@pytest.mark.parametrize("maker", MAKERS)
def test_limbs_of_skeletons_begin_at_their_joints(maker: str) -> None:
    """As who writes where the joints of a BVH file are has them."""
    names = names_of(Style(names=maker))
    order = np.random.default_rng(0).permutation(list(names)).tolist()
    found = by_names([names[joint] for joint in order])
    for joint in (f"{side}_{part}" for side in ("left", "right") for part in LIMBS):
        place = found.get(joint)
        assert place is not None and order[place] == joint, joint


def test_spines_are_counted_from_the_first() -> None:
    assert by_names(["Hips", "Spine", "Spine1", "Spine2"]) == {"pelvis": 0, "spine1": 1, "spine2": 2, "spine3": 3}
    assert by_names(["spine1", "spine2", "spine3"]) == {"spine1": 0, "spine2": 1, "spine3": 2}
    assert by_names(["Pelvis", "Spine", "Neck"]) == {"pelvis": 0, "spine2": 1, "neck": 2}


@pytest.mark.parametrize(
    ("names", "wanted"),
    [
        (["spine_01", "spine_02", "spine_03"], {"spine1": 0, "spine2": 1, "spine3": 2}),
        (["Spine1_Loc", "Spine2_Loc"], {"spine1": 0, "spine2": 1}),
        (["spine2", "spine3"], {"spine2": 0, "spine3": 1}),
        ([f"spine_0{number}" for number in (3, 1, 2, 5, 4)], {"spine2": 0}),
        ([f"spine_{number}_joint" for number in range(1, 8)], {"spine2": 3}),
        (["Spine", "Spine1", "Spine2", "Spine3"], {"spine2": 1}),
        (["Spine", "Spine99999999999999999999"], {"spine2": 0}),
    ],
)
def test_of_many_joints_of_a_spine_the_middle_is_ours(names: list[str], wanted: dict[str, int]) -> None:
    """Unreal's and ARKit's; the lowest of five leans as the loin, and not as the chest."""
    assert by_names(names) == wanted


def test_a_bone_alone_is_no_point() -> None:
    assert our_name("LeftArm") is None and our_name("LeftLeg") is None and our_name("LeftShin") == "left_knee"
