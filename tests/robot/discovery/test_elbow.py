"""Arms of which a file tells little: no limits, no shapes, no masses beyond the last joint."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.errors import UserError
from mrhubo.robot.discovery import discover
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about, at

ARM = (("pitch", "0 0.08 0", "0 1 0"), ("roll", "0.002 0.07 -0.01", "1 0 0"), ("twist", "0 0.04 0", "0 1 0"),
       ("elbow", "0 0.12 0", "0 0 1"))  # fmt: skip


def robot(limits: str, *more: tuple[str, str, str]) -> str:
    """Two arms in a T on a chest, and nothing but joints."""
    text = '<robot name="t"><link name="chest"/>'
    for side, sign in (("left", 1), ("right", -1)):
        parent = "chest"
        for name, xyz, axis in (*ARM, *more):
            x, y, z = map(float, xyz.split())
            text += f'<link name="{side}_{name}"/><joint name="{side}_{name}_joint" type="revolute">'
            text += f'<parent link="{parent}"/><child link="{side}_{name}"/><origin xyz="{x} {sign * y} {z}"/>'
            text += f'<axis xyz="{axis}"/>{limits}</joint>'
            parent = f"{side}_{name}"
    return text + "</robot>"


@pytest.mark.parametrize("more", [(), (("forearm", "0 0 0", "0 1 0"),)])
def test_elbow_is_found_where_nothing_tells_the_forearm(tmp_path: Path, more: tuple[tuple[str, str, str], ...]) -> None:
    file = tmp_path / "t.urdf"
    file.write_text(robot('<limit lower="-1.7" upper="1.6" effort="1" velocity="1"/>', *more))
    found = discover(file)
    assert found.points["left_elbow"].root_3 == pytest.approx((0.002, 0.31, -0.01), abs=1e-4)
    assert found.points["left_shoulder"].root_3 == pytest.approx((0.002, 0.15, -0.01), abs=1e-4)
    # The forearm is a guess, and asked about.
    assert {"left_wrist", "right_wrist"} <= {question.about for question in found.questions}


def test_joints_without_limits_are_arms_too(tmp_path: Path) -> None:
    file = tmp_path / "t.urdf"
    file.write_text(robot('<limit lower="0" upper="0" effort="1" velocity="1"/>').replace("revolute", "continuous"))
    assert len(discover(file).chains["left_arm"]) == len(ARM)


@pytest.mark.parametrize("across", [X, Y], ids=["across", "parallel"])
def test_an_elbow_has_the_shoulders_axes_before_it_and_not_a_clavicles(across, tmp_path: Path) -> None:
    """A shoulder of two axes, an elbow and a wrist with a hand longer than the forearm: the wrist was taken for the
    elbow, as three joints are before it.
    """
    made = Made()
    hand = "<collision><origin xyz='0 0 -0.125'/><geometry><box size='0.05 0.05 0.25'/></geometry></collision>"
    for side, sign in SIDES.items():
        link = made.join(f"{side}_one", "chest", (0, 0.2 * sign, 0.4), Y, (-2.5, 2.5))
        link = made.join(f"{side}_two", link, (0, 0, 0), X)
        link = made.join(f"{side}_three", link, (0, 0, -0.25), Y, (-2.3, 0))
        made.join(f"{side}_four", link, (0, 0, -0.15), across, (-1, 1), shape=hand)
        made.leg(side)
    found = made.found(tmp_path)
    assert at(found, "left_shoulder") == pytest.approx([0, 0.2, 0.4], abs=1e-6)
    assert at(found, "left_elbow") == pytest.approx([0, 0.2, 0.15], abs=1e-6)
    assert at(found, "left_wrist") == pytest.approx([0, 0.2, 0.0], abs=1e-6)


@pytest.mark.parametrize("called", ["elbow", "joint"])
def test_a_joint_that_is_called_an_elbow_and_was_not_taken_for_it_is_asked_about(called: str, tmp_path: Path) -> None:
    """A lesson's arm in a T whose only shoulder joint turns about the arm: its upper arm has no length by the axes."""
    made = Made()
    for side, sign in SIDES.items():
        link = made.join(f"{side}_shoulder", "chest", (0, 0.2 * sign, 0.4), Y, (-3, 1))
        link = made.join(f"{side}_{called}", link, (0, 0.25 * sign, 0), Z, (-2.3, 0) if sign > 0 else (0, 2.3))
        link = made.join(f"{side}_wrist_yaw", link, (0, 0.25 * sign, 0), Y)
        made.join(f"{side}_wrist_pitch", link, (0, 0, 0), Z)
        made.join(f"{side}_ankle", made.leg(side), (0, 0, -0.4), Y, (-0.6, 0.6))
    found = made.found(tmp_path)
    assert ({"left_elbow", "right_elbow", "left_shoulder"} <= about(found)) == (called == "elbow")


@pytest.mark.parametrize("called", ["arm", "sho", "limb"])
def test_arms_that_hang_lower_than_all_else_are_no_legs_if_names_say_so(called: str, tmp_path: Path) -> None:
    """An upper body on a plate whose wrist, elbow and shoulder turn about parallel axes."""
    made = Made()
    for side, sign in SIDES.items():
        link = made.join(f"{side}_{called}_one", "chest", (0, 0.2 * sign, 0.2), Y, (-2.5, 2.5))
        link = made.join(f"{side}_{called}_two", link, (0, 0, 0), X)
        link = made.join(f"{side}_{called}_three", link, (0, 0, -0.25), Y, (-2.3, 0))
        link = made.join(f"{side}_{called}_four", link, (0, 0, -0.25), X, (-1, 1))
        made.join(f"{side}_{called}_five", link, (0, 0, 0), Y, (-1, 1))
    if called != "limb":
        assert at(made.found(tmp_path), "left_elbow") == pytest.approx([0, 0.2, -0.05], abs=1e-6)
    else:
        with pytest.raises(UserError, match="looks like legs"):
            made.found(tmp_path)


def test_no_clavicle_is_longer_than_the_upper_arm_behind_it(tmp_path: Path) -> None:
    """Six joints of an industrial arm on each side of a table: pan, lift, elbow, and a wrist with a long tool, which was
    taken for the elbow, with the upper arm for a clavicle.
    """
    made = Made()
    tool = "<collision><origin xyz='0 0 0.18'/><geometry><box size='0.05 0.05 0.36'/></geometry></collision>"
    for side, sign in SIDES.items():
        link = made.join(f"{side}_one", "chest", (0, 0.3 * sign, 0.2), Z, (-2.5, 2.5))
        link = made.join(f"{side}_two", link, (0, 0, 0.2), Y, (-2, 2))
        link = made.join(f"{side}_three", link, (0, 0, 0.41), Y, (-2.5, 0))
        link = made.join(f"{side}_four", link, (0.01, 0, 0), Z, (-2.5, 2.5))
        link = made.join(f"{side}_five", link, (0, 0, 0.31), Y, (-2, 2))
        made.join(f"{side}_six", link, (0, 0, 0), Z, (-3, 3), shape=tool)
    found = made.found(tmp_path)
    assert at(found, "left_elbow")[2] == pytest.approx(0.81, abs=1e-6)
    assert at(found, "left_shoulder") == pytest.approx([0, 0.3, 0.4], abs=1e-6)


@pytest.mark.parametrize("turns", [2.0, 6.28])
def test_what_turns_all_the_way_round_is_no_jaw(turns: float, tmp_path: Path) -> None:
    """The last joint of an industrial arm, parallel at zero to the one that swings its wrist already."""
    made = Made()
    for side, sign in SIDES.items():
        link = made.join(f"{side}_pan", "chest", (0, 0.3 * sign, 0.2), Z, (-6.28, 6.28))
        for name, z, axis, most in (
            ("lift", 0.1, Y, 6.28), ("elbow", 0.42, Y, 3.14), ("wrist_1", 0.39, Y, 6.28), ("wrist_2", 0.09, Z, 6.28)
        ):  # fmt: skip
            link = made.join(f"{side}_{name}", link, (0, 0.13 if name == "wrist_2" else 0, z), axis, (-most, most))
        made.parts.append(f"<link name='{side}_flange'/>")
        made.parts.append(
            f"<joint name='{side}_last_joint' type='revolute'><parent link='{link}'/><child link='{side}_flange'/>"
            f"<origin xyz='0 0.08 0.09'/><axis xyz='0 1 0'/><limit lower='-{turns}' upper='{turns}' effort='1' "
            "velocity='1'/></joint>"
        )
    assert ("left_last_joint" in made.found(tmp_path).joints) == (turns > 3)
