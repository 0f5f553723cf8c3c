"""Robots of other conventions: what is odd about them is passed over, read as it is meant, or asked about."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from mrhubo.describing.run import open_robot
from mrhubo.errors import UserError
from mrhubo.robot import BodyMap
from mrhubo.robot.discovery import discover
from mrhubo.robot.generator import humanoid
from mrhubo.robot.generator.score import mistakes
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about, at


def test_an_elbow_behind_a_gear_is_narrowed_by_its_motors_range(tmp_path: Path) -> None:
    made = Made()
    for side in SIDES:
        upper = made.arm(side)
        made.join(f"{side}_motor", upper, (0, 0, -0.1), Y, (-5.0, 5.0))
        mimic = f"<mimic joint='{side}_motor_joint' multiplier='-0.5' offset='0.1'/>"
        link = made.join(f"{side}_elbow", upper, (0, 0, -0.3), Y, (-2.0, 2.2), more=mimic)
        made.wrist(side, made.join(f"{side}_forearm", link, (0, 0, -0.1), Z))
    found = made.found(tmp_path)
    for side in SIDES:
        # Straight is at an elbow's 0, a motor's 0.2; the elbow's own limit of -2.0 is its 4.2.
        limits = found.ranges[f"{side}_motor_joint"]
        assert (limits.lower, limits.upper) == pytest.approx((0.2, 4.2), abs=1e-6)
        assert f"{side}_motor_joint" in found.joints and f"{side}_elbow_joint" not in found.ranges


def test_a_joint_that_its_limits_hold_is_fixed_where_they_hold_it(tmp_path: Path) -> None:
    """A mount that stands at 0.6 rad, and cannot be at 0, is that turn of the arm's own frame."""
    found = []
    for held in (True, False):
        made = Made()
        for side, sign in SIDES.items():
            limits, rpy, kind = ((0.59, 0.6), (0, 0, 0), "revolute") if held else (None, (0.59, 0, 0), "fixed")
            mount = made.join(
                f"{side}_mount", "chest", (0, 0.2 * sign, 0.4), (sign, 0, 0), limits, kind, rpy=np.multiply(rpy, sign)
            )
            link = made.join(f"{side}_shoulder", mount, (0, 0, 0), Y, (-2.8, 1.2))
            link = made.join(f"{side}_twist", made.join(f"{side}_roll", link, (0, 0, 0), X), (0, 0, 0), Z)
            made.wrist(side, made.forearm(side, link))
        found.append(made.found(tmp_path))
    for point in ("left_elbow", "right_wrist"):
        assert at(found[0], point) == pytest.approx(at(found[1], point), abs=1e-5)
    assert found[0].joints == found[1].joints


@pytest.mark.parametrize("right", [(-0.3, 1.5), (-1.5, 0.3), (-1.4, 1.4)])
def test_limits_that_were_copied_to_the_other_side_are_told(right: tuple[float, float], tmp_path: Path) -> None:
    made = Made()
    for side in SIDES:
        link = made.join(f"{side}_pitch", "chest", (0, 0.2 * SIDES[side], 0.4), Y, (-2.8, 1.2))
        link = made.join(f"{side}_roll", link, (0, 0, 0), X, (-0.3, 1.5) if side == "left" else right)
        made.wrist(side, made.forearm(side, made.join(f"{side}_yaw", link, (0, 0, 0), Z)))
    told = [note for note in made.found(tmp_path).notes if "not mirrored" in note]
    assert len(told) == (right == (-0.3, 1.5)) and all("'left_roll_joint' and 'right_roll_joint'" in n for n in told)


@pytest.mark.parametrize(("joints", "found"), [(("pan", "nod"), 2), (("head_pan",), 1), (("pan",), 0)])
def test_a_head_that_turns_all_the_way_round_is_no_lidar(joints: tuple[str, ...], found: int, tmp_path: Path) -> None:
    """A lidar carries no other joint, and is not called so."""
    made, link = Made(), "chest"
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
    for name, axis, limits in zip(joints, (Z, Y), (None, (-0.5, 0.5)), strict=False):
        kind = "continuous" if limits is None else "revolute"
        link = made.join(name, link, (0, 0, 0.55 if link == "chest" else 0), axis, limits, kind)
    assert made.found(tmp_path).chains["neck"] == tuple(f"{name}_joint" for name in joints[:found])


def test_a_box_of_a_millimetre_tells_no_sole(tmp_path: Path) -> None:
    """It marks a frame, as in X Square's and other files."""
    for size, known in (("0.001 0.001 0.001", False), ("0.2 0.1 0.03", True)):
        made, shape = Made(), f"<visual><geometry><box size='{size}'/></geometry></visual>"
        for side in SIDES:
            made.wrist(side, made.forearm(side, made.arm(side)))
            made.join(f"{side}_foot", made.leg(side), (0, 0, -0.4), Y, (-0.8, 0.8), shape=shape)
        found = made.found(tmp_path)
        assert ("left_foot" in about(found)) != known and (found.ends["left_foot"].confidence >= 0.9) == known


def test_boxes_in_millimetres_are_read_so(tmp_path: Path) -> None:
    """As Bez's, whose joints are in metres."""
    soles = []
    for unit in (1, 1000):
        made = Made()
        for side in SIDES:
            made.wrist(side, made.forearm(side, made.arm(side)))
            size, place = (
                " ".join(f"{unit * length}" for length in box) for box in ((0.2, 0.1, 0.03), (0.04, 0, -0.05))
            )
            shape = f"<collision><origin xyz='{place}'/><geometry><box size='{size}'/></geometry></collision>"
            foot = made.join(f"{side}_foot", made.leg(side), (0, 0, -0.4), Y, (-0.8, 0.8), shape=shape)
            made.join(f"{side}_toes", foot, (0, 0, 0), Y, None, "fixed", shape=shape)
        found = made.found(tmp_path)
        soles.append(at(found, "left_sole"))
        assert any("millimetres" in note for note in found.notes) == (unit == 1000)
    assert soles[1] == pytest.approx(soles[0])


def test_an_arm_of_two_parallel_axes_without_limits_is_no_caster(tmp_path: Path) -> None:
    """As Bez's; a caster's two axes are at right angles."""
    made = Made()
    for side, sign in SIDES.items():
        upper = made.join(f"{side}_arm_0", "chest", (0, 0.1 * sign, 0.1), Y, None, "continuous")
        shape = "<collision><origin xyz='0 0 -0.1'/><geometry><box size='0.05 0.05 0.2'/></geometry></collision>"
        made.join(f"{side}_arm_1", upper, (0, 0, -0.25), Y, None, "continuous", shape=shape)
        made.join(f"{side}_foot", made.leg(side), (0, 0, -0.4), Y, None, "continuous")
    found = made.found(tmp_path)
    assert at(found, "left_elbow") == pytest.approx([0, 0.1, -0.15]) and {"left_wrist", "right_wrist"} <= about(found)


def test_what_lies_on_an_elbows_hinge_tells_no_forearm(tmp_path: Path) -> None:
    """As the brackets that Dora's elbows carry."""
    made = Made()
    for side, sign in SIDES.items():
        made.join(f"{side}_elbow", made.arm(side), (0, 0, -0.3), Y, (-1.5, 1.5))
        made.parts[-1] = made.parts[-1].replace("0 0 -0.05", f"0 {0.04 * sign} 0")
    found = made.found(tmp_path)
    assert at(found, "left_wrist") == pytest.approx([0, 0.2, -0.2]) and "left_wrist" in about(found)
    limits = found.ranges["left_elbow_joint"]
    assert (limits.lower, limits.upper) == pytest.approx((-1.5, 0.0))


def test_a_tail_by_its_name_is_no_waist(tmp_path: Path) -> None:
    """Below a root that is the chest of a robot without legs, the waist is what names do not call otherwise."""
    for tail, word in (("tail", ""), ("tail", "waist"), ("arm", "waist"), ("tail", "taille")):
        made, link = Made(), "chest"
        for side in SIDES:
            made.wrist(side, made.forearm(side, made.arm(side)))
        for number in range(3):
            link = made.join(f"{tail}_{number}", link, (-0.1, 0, 0), Y if number % 2 else Z)
        if word:
            made.join(word, "chest", (0, 0, -0.1), Z)
        found = made.found(tmp_path)
        assert found.chains["waist"] == ((f"{word}_joint",) if word else ()) and f"{tail}_0_joint" in found.left_out


def test_a_wrist_whose_joints_are_fixed_is_where_they_are(tmp_path: Path) -> None:
    """As G1's with its wrists locked, and COMAN's; a hand's link, which lies farther on, is no wrist."""
    made = Made()
    for side in SIDES:
        link = made.join(f"{side}_elbow", made.arm(side), (0, 0, -0.3), Y, (-2.3, 0.0))
        for name, down in (("wrist_roll", -0.15), ("wrist_pitch", -0.05), ("wrist_yaw", -0.05), ("rubber_hand", -0.1)):
            link = made.join(f"{side}_{name}", link, (0, 0, down), Z, None, "fixed")
    assert at(made.found(tmp_path), "left_wrist") == pytest.approx([0, 0.2, -0.1])


def test_elbows_that_bend_both_ways_with_arms_spread_bend_alike(tmp_path: Path) -> None:
    """Nothing tells which way is a human's there; as Galbot One's and TOCABI's."""
    made = Made()
    for side, sign in SIDES.items():
        link = made.join(f"{side}_pitch", "chest", (0, 0.2 * sign, 0.4), Y)
        link = made.join(f"{side}_twist", made.join(f"{side}_roll", link, (0, 0, 0), X), (0, 0.1 * sign, 0), Y)
        link = made.join(f"{side}_elbow", link, (0, 0.2 * sign, 0), X, (-2.1, 2.1))
        made.join(f"{side}_wrist", made.join(f"{side}_forearm", link, (0, 0.1 * sign, 0), Y), (0, 0.2 * sign, 0), X)
    found = made.found(tmp_path)
    ends = [(found.ranges[f"{side}_elbow_joint"].lower, found.ranges[f"{side}_elbow_joint"].upper) for side in SIDES]
    assert ends == [pytest.approx((0, 2.1)), pytest.approx((-2.1, 0))] and {"left_elbow", "right_elbow"} <= about(found)


def test_a_forearm_that_telescopes_has_elbow_and_wrist(tmp_path: Path) -> None:
    made = Made()
    for side in SIDES:
        link = made.join(f"{side}_elbow", made.arm(side), (0, 0, -0.3), Y, (-2.3, 0.0))
        link = made.join(f"{side}_tube", link, (0, 0, -0.1), (0, 0, -1), (0.0, 0.2), "prismatic")
        made.wrist(side, made.join(f"{side}_forearm", link, (0, 0, 0), Z))
    found = made.found(tmp_path)
    assert at(found, "left_shoulder") == pytest.approx([0, 0.2, 0.4])
    assert at(found, "left_elbow") == pytest.approx([0, 0.2, 0.1])
    assert at(found, "left_wrist") == pytest.approx([0, 0.2, -0.15])
    assert "longer" in found.left_out["left_tube_joint"]


def test_a_finger_of_three_links_is_no_wrist(tmp_path: Path) -> None:
    made = Made()
    for side in SIDES:
        link = made.forearm(side, made.arm(side))
        for number, down in enumerate((-0.2, -0.04, -0.04)):
            link = made.join(f"{side}_{number}", link, (0.01, 0, down), Y, (0.0, 1.2))
    found = made.found(tmp_path)
    assert found.chains["left_arm"][-1] == "left_forearm_joint" and len(found.chains["left_arm"]) == 5


def test_a_hand_that_is_folded_at_zero_points_along_the_axis_on_which_it_rolls(tmp_path: Path) -> None:
    """As Franka's, which lies back along the forearm there."""
    made = Made()
    for side in SIDES:
        wrist = made.join(f"{side}_wrist", made.forearm(side, made.arm(side)), (0, 0, -0.15), Y)
        roll = made.join(f"{side}_roll", wrist, (0.05, 0, 0), Z)
        made.join(f"{side}_tool", roll, (0, 0, 0.15), Z, None, "fixed")
    found = made.found(tmp_path)
    for side in SIDES:
        hand = found.ends[f"{side}_hand"]
        assert (hand.link, hand.axes["fingers"]) == (f"{side}_roll", (0, 0, 1))


def test_the_thumb_of_three_fingers_is_the_one_that_closes_against_the_others(tmp_path: Path) -> None:
    """As the middle one of Robotiq's hand, which begins no farther from the others than these from each other."""
    made = Made()
    for side in SIDES:
        hand = made.wrist(side, made.forearm(side, made.arm(side)))
        for word, x, y, axis in (
            ("one", 0.045, -0.036, X),
            ("two", -0.045, -0.036, X),
            ("three", 0, 0.036, (-1, 0, 0)),
        ):
            link = made.join(f"{side}_{word}", hand, (x, y, -0.08), axis, (0.0, 1.2))
            made.join(f"{side}_{word}_tip", link, (0, 0, -0.05), axis, (0.0, 1.2))
    found = made.found(tmp_path)
    # Both palms face left, as the first two fingers close.
    assert found.ends["left_hand"].axes["thumb"] == pytest.approx((-1, 0, 0))
    assert found.ends["right_hand"].axes["thumb"] == pytest.approx((1, 0, 0))


def test_the_thumb_beside_one_finger_lies_along_the_axis_about_which_that_curls(tmp_path: Path) -> None:
    """And not along the way between their bases, which may lie at different heights above the palm."""
    made = Made()
    for side, sign in SIDES.items():
        hand = made.wrist(side, made.forearm(side, made.arm(side)))
        for word, x, y, axis in (("finger", -0.03, 0, (-sign, 0, 0)), ("thumb", 0.03, -0.02 * sign, (0, sign, 0))):
            link = made.join(f"{side}_{word}", hand, (x, y, -0.08), axis, (0.0, 1.2))
            made.join(f"{side}_{word}_tip", link, (0, 0, -0.05), axis, (0.0, 1.2))
    for side in SIDES:
        assert made.found(tmp_path).ends[f"{side}_hand"].axes["thumb"] == pytest.approx((1, 0, 0))


def test_two_jaws_with_a_rod_beside_each_are_no_four_fingers(tmp_path: Path) -> None:
    """As Robotiq's grippers without the loops, and without <mimic>."""
    made = Made()
    for side in SIDES:
        hand = made.wrist(side, made.forearm(side, made.arm(side)))
        for word, y in (("driver", 0.03), ("spring", 0.013), ("other_driver", -0.03), ("other_spring", -0.013)):
            link = made.join(f"{side}_{word}", hand, (0, y, -0.06), X if y < 0 else (-1, 0, 0), (0.0, 0.8))
            made.join(f"{side}_{word}_end", link, (0, y, -0.05), X, (-0.8, 0.8))
    found = made.found(tmp_path)
    for side, sign in SIDES.items():
        assert found.ends[f"{side}_hand"].axes["thumb"] == pytest.approx((0, -sign, 0))
        assert any(
            question.about == f"{side}_hand" and "a gripper has no thumb" in question.text
            for question in found.questions
        )


def test_what_rolls_a_flange_is_no_jaw(tmp_path: Path) -> None:
    """As the last joint of Universal Robots' arms, which is parallel to the first one of their wrists at zero."""
    made = Made()
    for side, sign in SIDES.items():
        pan = made.join(f"{side}_pan", "chest", (0, 0.2 * sign, 0.4), (0, sign, 0), (-3, 3))
        lift = made.join(f"{side}_lift", pan, (0, 0.1 * sign, 0), Z, (-3, 3))
        elbow = made.join(f"{side}_elbow", lift, (0.4, 0, -0.1), Z, (-2.6, 0.0))
        first = made.join(f"{side}_first", elbow, (0.39, 0, 0), Z)
        second = made.join(f"{side}_second", first, (0, 0, -0.1), X)
        third = made.join(f"{side}_third", second, (0.095, 0, 0), Z)
        made.join(f"{side}_tool", third, (0, 0, -0.08), Z, None, "fixed")
    found = made.found(tmp_path)
    assert found.chains["left_arm"][-1] == "left_third_joint" and not found.left_out
    assert found.ends["left_hand"].axes["fingers"] == pytest.approx((0, 0, -1))


def test_a_leg_on_a_wheel_has_no_ankle_that_turns(tmp_path: Path) -> None:
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        made.join(f"{side}_rim", made.leg(side), (0, 0, -0.4), Y, None, "continuous")
    found = made.found(tmp_path)
    assert "left_rim_joint" not in found.joints and at(found, "left_ankle") == pytest.approx([0, 0.1, -0.9])
    assert {"left_foot", "right_foot"} <= about(found) and "left_ankle" not in about(found)


@pytest.mark.parametrize("pitch", [0.0, 0.3])
def test_an_ankle_that_no_joint_tells_lies_over_the_foot(tmp_path: Path, pitch: float) -> None:
    """However the shank with its foot is turned against the robot at the zero pose."""
    foot = (
        "<collision><origin xyz='0.05 0 -0.46'/><geometry><box size='0.24 0.1 0.04'/></geometry></collision>"
        "<collision><origin xyz='0 0 -0.2'/><geometry><cylinder radius='0.03' length='0.4'/></geometry></collision>"
    )
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = made.join(f"{side}_hip_roll", "chest", (0, 0.1 * SIDES[side], -0.1), X)
        link = made.join(f"{side}_hip_pitch", link, (0, 0, 0), Y, (-2.0, 0.5))
        made.join(f"{side}_knee", link, (0, 0, -0.4), Y, (0.0, 2.2), shape=foot, rpy=(0, pitch, 0))
    found = made.found(tmp_path)
    knee_3, ankle_3 = np.array(at(found, "left_knee")), np.array(at(found, "left_ankle"))
    turn_33 = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    ahead, aside, up = turn_33.T @ (ankle_3 - knee_3)
    assert aside == pytest.approx(0) and -0.03 < ahead < 0.03 and -0.43 < up < -0.36
    assert {"left_ankle", "right_ankle"} <= about(found)


def test_no_warning_doubts_what_the_axes_tell_where_a_hinge_lies_far_beside_the_arm(
    tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    """As the elbow of Franka's arm does: the forearm's length changes as it bends, and no other point is better."""
    made = Made()
    for side in SIDES:
        elbow = made.join(f"{side}_elbow", made.arm(side), (0.08, 0, -0.3), Y, (-3.0, 0.0))
        made.wrist(side, made.join(f"{side}_forearm", elbow, (-0.08, 0, -0.1), Z))
    made.found(tmp_path)
    BodyMap.of(open_robot(str(tmp_path / "made.urdf")))
    assert not [str(warning.message) for warning in recwarn if "keeps its length" in str(warning.message)]


def test_a_linkage_without_masses_that_is_drawn_beside_a_leg_is_passed_over(tmp_path: Path) -> None:
    """As the parallel legs of NimbRo-OP2X, which its URDF has beside the legs that weigh something."""
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        knee = made.leg(side)
        made.join(f"{side}_ankle", knee, (0, 0, -0.4), Y)
        parent = f"{side}_hip_roll"
        for word, down, more in (
            ("thigh", 0.02, ""),
            ("knee", 0.36, "thigh"),
            ("shin", 0.1, ""),
            ("foot", 0.32, "shin"),
        ):
            mimic = f"<mimic joint='{side}_drawn_{more}_joint' multiplier='-1'/>" if more else ""
            made.join(f"{side}_drawn_{word}", parent, (0.03, 0, -down), Y, None, "continuous", mimic)
            made.parts[-1] = re.sub("<inertial>.*?</inertial>", "", made.parts[-1])
            parent = f"{side}_drawn_{word}"
    found = made.found(tmp_path)
    assert found.chains["left_leg"] == tuple(
        f"left_{word}_joint" for word in ("hip_roll", "hip_pitch", "knee", "ankle")
    )
    assert at(found, "left_knee") == pytest.approx([0, 0.1, -0.5], abs=1e-3)


def test_a_shoulder_of_three_axes_in_any_order_is_not_turned_inside_out(tmp_path: Path) -> None:
    """The axis that lies along the arm, which is the first one here, gets half a turn where a file gives no limits."""
    made = Made()
    for side, sign in SIDES.items():
        link = "chest"
        for word, axis in (("yaw", Z), ("roll", X), ("pitch", Y)):
            at = (0, 0.2 * sign, 0.4) if word == "yaw" else (0, 0, 0)
            link = made.join(f"{side}_{word}", link, at, axis, None, "continuous")
        link = made.join(f"{side}_elbow", link, (0, 0, -0.3), Y, None, "continuous")
        link = made.join(f"{side}_forearm", link, (0, 0, -0.1), Z, None, "continuous")
        made.join(f"{side}_wrist", link, (0, 0, -0.15), Y, None, "continuous")
    ranges = made.found(tmp_path).ranges
    widths = {word: ranges[f"left_{word}_joint"].upper - ranges[f"left_{word}_joint"].lower
              for word in ("yaw", "roll", "pitch", "elbow", "forearm", "wrist")}  # fmt: skip
    half, whole = np.pi, 2 * np.pi
    assert list(widths.values()) == pytest.approx([half, whole, whole, half, whole, half])


def test_a_column_that_keeps_the_chest_upright_is_held(tmp_path: Path) -> None:
    """As that of Rollin' Justin: no direction tells its angle, and a robot that moves it is refused."""
    made = Made()
    made.parts.append("<link name='base'/>")
    yaw = made.join("yaw", "base", (0, 0, 0.4), Z)
    column = made.join("column", yaw, (0, 0, 0.1), Y, (-1.0, 1.0))
    made.parts.append(
        f"<joint name='back' type='revolute'><parent link='{column}'/><child link='chest'/><origin xyz='0 0 0.4'/>"
        "<axis xyz='0 -1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/><mimic joint='column_joint'/></joint>"
    )
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
    found = made.found(tmp_path)
    assert found.chains["waist"] == ("yaw_joint", "column_joint", "back")
    assert "yaw_joint" in found.joints and {"column_joint", "back"} <= set(found.held)
    assert about(found) == {"left_hand", "right_hand"}


def test_a_body_of_balls_is_read_as_its_bones(tmp_path: Path) -> None:
    """As of a human skeleton that became a URDF: three joints in each point, arms in a T."""
    made = Made()
    for side, sign in SIDES.items():
        link = "chest"
        for part, out in (("shoulder", 0.2), ("elbow", 0.3), ("wrist", 0.25)):
            for number, axis in enumerate((X, Z, Y)):
                place = (0, 0, 0) if number else (0, sign * out, 0.4 * (part == "shoulder"))
                link = made.join(f"{side}_{part}_{number}", link, place, axis)
    found = made.found(tmp_path)
    for point, out in (("shoulder", 0.2), ("elbow", 0.5), ("wrist", 0.75)):
        assert at(found, f"left_{point}") == pytest.approx([0, out, 0.4]), point
    assert len(found.chains["left_arm"]) == 9


def test_a_second_pair_of_arms_is_asked_about(tmp_path: Path) -> None:
    made = Made()
    for called, height in (("", 0.4), ("lower_", 0.1)):
        for side in SIDES:
            upper = made.arm(side, height, called)
            made.wrist(side, made.forearm(side, upper, called=called), called)
    for side in SIDES:
        made.join(f"{side}_foot", made.leg(side), (0, 0, -0.4), Y)
    assert "chest" in about(made.found(tmp_path))


def test_legs_that_a_file_lists_from_the_other_side_are_no_second_pair_of_arms(tmp_path: Path) -> None:
    """The body that carries them carries the arms too, as on a robot without a waist."""
    made = Made()
    for side in reversed(SIDES):
        made.wrist(side, made.forearm(side, made.arm(side)))
    for side in SIDES:
        made.join(f"{side}_foot", made.leg(side), (0, 0, -0.4), Y)
    assert "chest" not in about(made.found(tmp_path))


def test_an_arm_without_a_wrist_beside_a_whole_one_is_an_arm(tmp_path: Path) -> None:
    made = Made()
    made.wrist("left", made.forearm("left", made.arm("left")))
    made.join("right_elbow", made.arm("right"), (0, 0, -0.3), Y, (-2.3, 0.0))
    for side in SIDES:
        made.join(f"{side}_foot", made.leg(side), (0, 0, -0.4), Y)
    found = made.found(tmp_path)
    assert (len(found.chains["left_arm"]), len(found.chains["right_arm"])) == (7, 4)
    assert at(found, "right_elbow") == pytest.approx([0, -0.2, 0.1]) and "right_wrist" in about(found)


def test_a_file_that_begins_at_a_hand_does_not_tell_by_its_frame_where_up_is(tmp_path: Path) -> None:
    """A robot without legs or neck, up by 90 degrees wrong, which was not asked about."""
    (tmp_path / "made.urdf").write_text(humanoid(9, "root at a hand").urdf)
    assert "up" in about(discover(tmp_path / "made.urdf"))


@pytest.mark.parametrize("broken", ["0 0 x", "0 0"])
def test_what_hangs_on_a_joint_that_cannot_be_read_is_no_crash(tmp_path: Path, broken: str) -> None:
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
    made.join("left_extra", "left_wrist_roll", (0, 0, -0.1), X)
    made.parts[-1] = made.parts[-1].replace("<axis xyz='1 0 0'/>", f"<axis xyz='{broken}'/>")
    made.join("left_spin", "left_extra", (0, 0, -0.1), X, None, "continuous")
    assert len(made.found(tmp_path).chains["left_arm"]) == 7
    with pytest.raises(UserError, match="no two arms"):
        Made().found(tmp_path)


@pytest.mark.parametrize(
    ("seed", "kind"),
    [
        (1138, None),  # one jaw, right behind the elbow
        (1184, None),  # the origin of one forearm's twist lies behind the elbow
        (1589, None),  # a neck and a waist that are mirror images
        (1347, None),  # an arm of three swings, a twist and a short forearm with long fingers
        (1051, None),  # a clavicle, and a forearm that only twists
        (1003, "clavicles of two joints"),
        (1009, "a tail"),  # which ends at the height of the shoulders
        (1010, "no limits"),  # a lidar on the head
    ],
)
def test_random_robots_that_were_wrong_are_right(seed: int, kind: str | None, tmp_path: Path) -> None:
    truth, path = humanoid(seed, kind), tmp_path / "made.urdf"
    path.write_text(truth.urdf)
    assert not mistakes(discover(path, whole_body=True), truth, path)


def test_a_leg_that_a_file_has_not_as_the_other_is_no_waist(tmp_path: Path) -> None:
    """Legs drawn by eye, whose knees are askew on one side: none was found, and one was taken for the waist."""
    made = Made()
    for side, sign in SIDES.items():
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = made.join(f"Torso_Thigh_{side}", "chest", (0, 0.01 * sign + 0.005, -0.2), X)
        knee = (0.01, 1.0, -0.04) if sign > 0 else (-0.4, 0.9, -0.05)
        link = made.join(f"Thigh_Calf_{side}", link, (0.05 + 0.03 * sign, 0.0, -0.32), knee)
        made.join(f"Calf_Feet_{side}", link, (0.02, 0, -0.2), knee)
    found = made.found(tmp_path)
    assert not found.chains["waist"] and not any("Thigh" in joint for joint in found.joints)


@pytest.mark.parametrize("called", ["arm", "part"])
def test_arms_of_two_crossed_axes_without_limits_are_no_casters_if_names_say_so(called: str, tmp_path: Path) -> None:
    made = Made()
    for side, sign in SIDES.items():
        link = made.join(f"{called}_{side}_one", "chest", (0, 0.2 * sign, 0.4), X, None, "continuous")
        made.join(f"{called}_{side}_two", link, (0.03, 0, -0.3), Y, None, "continuous")
        made.join(f"{side}_ankle", made.leg(side), (0, 0, -0.4), Y, (-0.6, 0.6))
    if called == "arm":
        assert made.found(tmp_path).chains["left_arm"] == ("arm_left_one_joint", "arm_left_two_joint")
    else:
        with pytest.raises(UserError, match="no arms were found"):
            made.found(tmp_path)


def test_short_arms_are_as_long_as_their_forearms_shapes(tmp_path: Path) -> None:
    """A lesson's arms end at the elbow, a quarter as far out as its legs reach; their forearms are boxes."""
    made = Made()
    box = "<collision><origin xyz='0 0 -0.1'/><geometry><box size='0.06 0.06 0.2'/></geometry></collision>"
    for side, sign in SIDES.items():
        link = made.join(f"{side}_one", "chest", (0, 0.2 * sign, 0.4), Y, (-2.5, 1.0), shape=box)
        made.join(f"{side}_two", link, (0, 0, -0.18), Y, (-2.3, 0), shape=box)
        made.join(f"{side}_ankle", made.leg(side), (0, 0, -0.4), Y, (-0.6, 0.6))
    found = made.found(tmp_path)
    assert found.chains["left_arm"] == ("left_one_joint", "left_two_joint")
    assert found.chains["left_leg"][-1] == "left_ankle_joint"
