"""Kinds of robots that strangers have: what is wrong about them is asked about, and the kinds' own traps are passed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.robot.discovery import Discovery, discover
from mrhubo.robot.generator import Humanoid, humanoid
from mrhubo.robot.generator.score import asked, mistakes
from mrhubo.robot.generator.strange import STRANGE
from mrhubo.robot.urdf import describe

SEEDS = (1, 4)
"""Of each kind; one stands on legs with fingers, one on a pedestal."""


def made(seed: int, kind: str, folder: Path) -> tuple[Humanoid, Path]:
    truth, path = humanoid(seed, kind), folder / "made.urdf"
    path.write_text(truth.urdf)
    return truth, path


def found_of(seed: int, kind: str, folder: Path) -> tuple[Discovery, Humanoid]:
    truth, path = made(seed, kind, folder)
    return discover(path), truth


@pytest.mark.parametrize("kind", STRANGE)
def test_what_is_wrong_is_asked_or_refused(kind: str, tmp_path: Path) -> None:
    for seed in SEEDS:
        truth, path = made(seed, kind, tmp_path)
        try:
            found = discover(path, whole_body=True)
        except UserError:
            continue
        wrong = mistakes(found, truth, path) if truth.mappable else ["two arms: not refused"]
        assert not wrong or asked(found, wrong), (seed, wrong)


@pytest.mark.parametrize(
    "kind",
    [
        "rods, names of noise", "rods on balls, names of noise", "play of gears", "pistons", "elbows of two hinges",
        "elbows behind gears", "clavicles of two joints",
    ],
)  # fmt: skip
def test_limbs_go_on_past_what_drives_them(kind: str, tmp_path: Path) -> None:
    for seed in SEEDS:
        found, truth = found_of(seed, kind, tmp_path)
        for chain in ("left_arm", "right_arm", "left_leg"):
            assert set(truth.chains[chain]) == set(found.chains.get(chain, ())), seed


def test_an_elbow_of_two_hinges_is_straight_where_both_are(tmp_path: Path) -> None:
    """A hinge that another one follows turns a forearm by twice its own angle."""
    for seed in (3, 10):
        found, truth = found_of(seed, "elbows of two hinges", tmp_path)
        narrowed = [limits for limits in found.ranges.values() if "both ways" in limits.why]
        assert len(narrowed) == 2
        for limits in narrowed:
            bent = math.atan2(*_bent(truth)) / 2
            assert bent == pytest.approx(min(abs(limits.lower), abs(limits.upper)), abs=0.02) or bent == pytest.approx(
                max(abs(limits.lower), abs(limits.upper)), abs=0.02
            )


def _bent(truth: Humanoid) -> tuple[float, float]:
    """Sine and cosine of how far the forearm is bent as the robot stands."""
    ends = [truth.points[f"left_{name}"] for name in ("shoulder", "elbow", "wrist")]
    upper_3, fore_3 = ends[1] - ends[0], ends[2] - ends[1]
    return float(np.linalg.norm(np.cross(upper_3, fore_3))), float(upper_3 @ fore_3)


def test_knees_that_bend_both_ways_bend_as_a_humans(tmp_path: Path) -> None:
    for seed in (1, 2):
        truth, path = made(seed, "knees both ways", tmp_path)
        found = discover(path, whole_body=True)
        path.write_text(humanoid(seed).urdf)
        usual = describe(path).joints
        knees = [joint for joint, limits in found.ranges.items() if "human knee" in limits.why]
        assert len(knees) == 2 and set(knees) <= {*truth.chains["left_leg"], *truth.chains["right_leg"]}
        for knee in knees:
            assert (
                usual[knee].lower - 0.2 < found.ranges[knee].lower < found.ranges[knee].upper < usual[knee].upper + 0.2
            )
        assert not set(knees) & set(discover(path).ranges)  # of arms alone, a leg's range is no matter


def test_a_base_that_drives_or_floats_is_no_waist(tmp_path: Path) -> None:
    for kind, joints in (("planar base of three joints", 3), ("floating base of six joints", 6)):
        truth, path = made(4, kind, tmp_path)
        found = discover(path, whole_body=True)
        assert truth.told & {"base: wheels", "base: pedestal"}
        left_out = [why for why in found.left_out.values() if "a base" in why]
        assert set(found.chains["waist"]) >= set(truth.chains["waist"]) and len(left_out) >= joints
        assert not [joint for joint in found.joints if joint in found.left_out]


def test_what_a_motor_beside_it_turns_is_moved_by_that_motor(tmp_path: Path) -> None:
    truth, path = made(1, "twists behind gears", tmp_path)
    found, joints = discover(path), describe(path).joints
    following = [joint for chain in ("left_arm", "neck") for joint in truth.chains[chain] if joints[joint].mimic]
    assert following and set(following) <= set(found.held)
    for joint in following:
        mimic = joints[joint].mimic
        assert mimic is not None and mimic.joint in found.joints and mimic.joint in found.held[joint]
    assert set(truth.chains["left_arm"]) == set(found.chains["left_arm"])


def test_legs_that_telescope_are_left_out_and_asked_about(tmp_path: Path) -> None:
    for seed in (1, 3):
        truth, path = made(seed, "legs that telescope", tmp_path)
        found = discover(path, whole_body=True)
        assert truth.chains["left_leg"] and not found.chains.get("left_leg")
        assert [question for question in found.questions if question.about == "pelvis" and "no knee" in question.text]


def test_limits_in_degrees_are_told_and_made_radians(tmp_path: Path) -> None:
    plain = tmp_path / "plain.urdf"
    plain.write_text(humanoid(1).urdf)
    usual = discover(plain)
    found, truth = found_of(1, "limits in degrees", tmp_path)
    assert set(found.ranges) == set(found.joints) and truth.joints == set(found.joints)
    assert any("degrees" in note and "0.0174533" in note for note in found.notes)
    for name, limits in usual.ranges.items():
        assert (found.ranges[name].lower, found.ranges[name].upper) == pytest.approx(
            (limits.lower, limits.upper), abs=1e-4
        )
    assert not any("degrees" in note for note in usual.notes)


def test_jaws_and_eyes_are_no_neck(tmp_path: Path) -> None:
    for seed in range(6):
        found, truth = found_of(seed, "a face", tmp_path)
        assert set(found.chains["neck"]) == set(truth.chains["neck"]), seed


def test_arms_that_mimic_each_other_are_told_how_to_mend(tmp_path: Path) -> None:
    _, path = made(1, "one arm mimics the other", tmp_path)
    with pytest.raises(UserError, match=r"mimics '.*' of another limb.*<mimic>"):
        discover(path)


def test_a_joint_of_an_arm_that_mimics_another_is_asked_about(pair) -> None:
    pitch = '<joint name="r_pitch" type="revolute">'
    found = discover(pair((pitch, pitch + '<mimic joint="l_pitch"/>')).urdf)
    question = next(question for question in found.questions if question.about == "r_pitch")
    assert "'r_pitch' mimics 'l_pitch'" in question.text and "<mimic>" in question.text


def test_sides_named_by_who_stands_before_the_robot_are_doubted(tmp_path: Path) -> None:
    for seed in range(4):
        found, truth = found_of(seed, "sides swapped in names", tmp_path)
        right = truth.forward_3 @ found.forward.root_3 > 0.99
        assert right or {"forward"} & {question.about for question in found.questions}, seed


def test_a_forearm_that_only_twists_and_is_short_is_asked_about(tmp_path: Path) -> None:
    text = '<robot name="t"><link name="chest"/>'
    joints = (("a", 0.1, "0 1 0"), ("b", 0.0, "1 0 0"), ("c", 0.0, "0 1 0"), ("d", 0.25, "0 0 1"), ("e", {}, "0 1 0"))
    for along, asks in ((0.1, True), (0.24, False)):
        robot = text
        for side, sign in (("l", 1), ("r", -1)):
            parent = "chest"
            for name, out, axis in joints:
                y = sign * (along if isinstance(out, dict) else out)
                robot += f'<link name="{side}{name}"/><joint name="{side}{name}_j" type="revolute">'
                robot += (
                    f'<parent link="{parent}"/><child link="{side}{name}"/><origin xyz="0 {y} 0"/><axis xyz="{axis}"/>'
                )
                robot += '<limit lower="-1.6" upper="1.7" effort="1" velocity="1"/></joint>'
                parent = f"{side}{name}"
        path = tmp_path / "t.urdf"
        path.write_text(robot + "</robot>")
        about = {question.about for question in discover(path).questions}
        assert ("left_wrist" in about) == asks
