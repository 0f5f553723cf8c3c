"""Legs of few joints: which of their axes are hip, knee and ankle."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.robot.discovery import Discovery
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about, at

AXES = {"yaw": Z, "roll": X, "pitch": Y}
FOOT = "<collision><origin xyz='0.04 0 -0.05'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>"


def found_of(hips: list[str], ankles: list[str], folder: Path, shape: str = FOOT) -> Discovery:
    """A robot with these joints of hips and ankles beside the knees; thighs of 0.4 m, shanks of 0.35 m."""
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = "chest"
        for word in hips:
            xyz = (0, 0.1 * SIDES[side], -0.1) if link == "chest" else (0, 0, 0)
            link = made.join(f"{side}_hip_{word}", link, xyz, AXES[word], (-0.8, 0.8))
        link = made.join(f"{side}_knee", link, (0, 0, -0.4), Y, (0.0, 2.2))
        for word in ankles:
            xyz = (0, 0, -0.35) if link.endswith("knee") else (0, 0, 0)
            last = shape if word == ankles[-1] else ""
            link = made.join(f"{side}_ankle_{word}", link, xyz, AXES[word], (-0.6, 0.6), shape=last)
    return made.found(folder)


@pytest.mark.parametrize("shape", [FOOT, ""], ids=["foot", "no shape"])
@pytest.mark.parametrize("ankles", [["pitch"], ["pitch", "roll"], ["roll", "pitch"]], ids="-".join)
@pytest.mark.parametrize("hips", [["yaw"], ["roll"], ["yaw", "roll"], ["roll", "yaw"], ["pitch"]], ids="-".join)
def test_a_knee_is_told_whether_or_not_the_hip_has_a_pitch(
    hips: list[str], ankles: list[str], shape: str, tmp_path: Path
) -> None:
    found = found_of(hips, ankles, tmp_path, shape)
    for side, sign in SIDES.items():
        assert at(found, f"{side}_hip") == pytest.approx([0, 0.1 * sign, -0.1], abs=1e-6)
        assert at(found, f"{side}_knee") == pytest.approx([0, 0.1 * sign, -0.5], abs=1e-6)
        assert at(found, f"{side}_ankle") == pytest.approx([0, 0.1 * sign, -0.85], abs=1e-6)
        assert {f"{side}_hip_{word}_joint" for word in hips} | {f"{side}_knee_joint"} <= set(found.joints)


@pytest.mark.parametrize("weight", [-0.33, -0.15])
def test_a_shin_whose_end_masses_tell_is_about_as_long_as_its_thigh(weight: float, tmp_path: Path) -> None:
    """Whichever axis is the last of the hip, and where the foot is all that weighs something."""
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = "chest"
        for word in ("roll", "pitch", "yaw"):
            xyz = (0, 0.1 * SIDES[side], -0.1) if link == "chest" else (0, 0, 0)
            link = made.join(f"{side}_hip_{word}", link, xyz, AXES[word], (-0.8, 0.8))
        made.join(f"{side}_knee", link, (0, 0, -0.4), Y, (0.0, 2.2))
        made.parts[-1] = made.parts[-1].replace("0 0 -0.05", f"0 0 {weight}")
    found = made.found(tmp_path)
    assert at(found, "left_ankle") == pytest.approx([0, 0.1, -0.5 + (-0.4 if weight < -0.3 else 2 * weight)], abs=1e-3)
    assert "left_ankle" in about(found)


def test_toes_are_no_ankle_where_the_hip_has_no_pitch(tmp_path: Path) -> None:
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = made.join(f"{side}_hip_yaw", "chest", (0, 0.1 * SIDES[side], -0.1), Z, (-0.8, 0.8))
        link = made.join(f"{side}_knee", link, (0, 0, -0.4), Y, (0.0, 2.2))
        link = made.join(f"{side}_ankle", link, (0, 0, -0.35), Y, (-0.6, 0.6), shape=FOOT)
        made.join(f"{side}_toes", link, (0.1, 0, -0.04), Y, (-0.6, 0.6))
    assert at(made.found(tmp_path), "left_ankle") == pytest.approx([0, 0.1, -0.85], abs=1e-6)


@pytest.mark.parametrize("toes", [False, True], ids=["no toes", "toes"])
@pytest.mark.parametrize("apart", [0.05, 0.12, 0.15])
def test_a_knee_of_two_hinges_ends_no_leg(apart: float, toes: bool, tmp_path: Path) -> None:
    """Two shells that roll on each other, each hinge with a motor of its own: the second one was taken for the ankle."""
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = "chest"
        for word in ("yaw", "roll", "pitch"):
            xyz = (0, 0.1 * SIDES[side], -0.1) if link == "chest" else (0, 0, 0)
            link = made.join(f"{side}_hip_{word}", link, xyz, AXES[word], (-0.8, 0.8))
        link = made.join(f"{side}_knee", link, (0, 0, -0.32), Y, (-0.1, 1.5))
        link = made.join(f"{side}_knee_too", link, (0, 0, -apart), Y, (-0.1, 1.5))
        link = made.join(f"{side}_ankle", link, (0, 0, -0.25), Y, (-0.6, 0.6), shape=FOOT)
        link = made.join(f"{side}_ankle_roll", link, (0, 0, 0), X, (-0.4, 0.4), shape=FOOT)
        if toes:
            made.join(f"{side}_toes", link, (0.1, 0, -0.04), Y, (-0.6, 0.6))
    found = made.found(tmp_path)
    assert at(found, "left_hip") == pytest.approx([0, 0.1, -0.1], abs=1e-6)
    assert at(found, "left_ankle") == pytest.approx([0, 0.1, -0.67 - apart], abs=1e-6)
    assert found.points["left_ankle"].link in ("left_knee_too", "left_ankle", "left_ankle_roll")  # not above the knee
    assert {"left_knee_joint", "left_knee_too_joint", "left_ankle_joint", "left_ankle_roll_joint"} <= set(found.joints)
    assert {"left_knee", "right_knee"} <= about(found)


def test_a_hip_that_turns_about_the_thigh_alone_is_asked_about(tmp_path: Path) -> None:
    assert {"left_hip", "right_hip"} <= about(found_of(["yaw"], ["pitch"], tmp_path))


def test_of_two_parallel_axes_without_a_foot_between_them_and_the_floor_the_upper_one_is_the_hip(
    tmp_path: Path,
) -> None:
    found = found_of(["yaw", "roll", "pitch"], [], tmp_path)
    assert at(found, "left_knee") == pytest.approx([0, 0.1, -0.5], abs=1e-6)
    assert "left_ankle" in about(found)


@pytest.mark.parametrize("axis", ["pitch", "roll"])
def test_knees_that_bend_sideways_are_asked_about(axis: str, tmp_path: Path) -> None:
    """As where somebody wrote all axes along one direction."""
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = made.join(f"{side}_hip", "chest", (0, 0.1 * SIDES[side], -0.1), AXES[axis], (-1.5, 0.8))
        link = made.join(f"{side}_knee", link, (0, 0, -0.4), AXES[axis], (0.0, 2.2))
        made.join(f"{side}_ankle", link, (0, 0, -0.35), AXES[axis], (-0.6, 0.6), shape=FOOT)
    assert ({"left_knee", "right_knee"} <= about(made.found(tmp_path))) == (axis == "roll")


@pytest.mark.parametrize(("hip", "knee"), [("hip", "knee"), ("part", "piece")])
def test_legs_of_two_joints_may_be_wings_where_no_name_tells(hip: str, knee: str, tmp_path: Path) -> None:
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        link = made.join(f"{side}_{hip}", "chest", (0, 0.1 * SIDES[side], -0.1), Y, (-1.5, 0.8))
        made.join(f"{side}_{knee}", link, (0, 0, -0.4), Y, (0.0, 2.2), shape=FOOT.replace("-0.05", "-0.4"))
    assert ("chest" in about(made.found(tmp_path))) == (hip == "part")
