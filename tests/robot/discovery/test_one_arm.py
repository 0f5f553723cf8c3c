"""Robots with one arm: described by that arm where legs, a head or a trunk tell its side, refused where it is alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.describing.run import describe_model
from mrhubo.errors import UserError
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot.discovery import discover
from mrhubo.robot.generator import humanoid
from mrhubo.robot.generator.score import asked, mistakes
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about, at


def _humanoid(side: str, called: str = "") -> Made:
    """Legs, a head, and one arm."""
    made = Made()
    made.wrist(side, made.forearm(side, made.arm(side, called=called), called=called), called)
    for each in SIDES:
        made.join(f"{each}_foot", made.leg(each), (0, 0, -0.4), Y, (-0.8, 0.8))
    made.join("head_pitch", made.join("head_yaw", "chest", (0, 0, 0.5), Z), (0, 0, 0.05), Y)
    return made


@pytest.mark.parametrize("side", SIDES)
def test_a_humanoid_with_one_arm_is_described_by_it(side: str, tmp_path: Path) -> None:
    found = _humanoid(side).found(tmp_path)
    other = "right" if side == "left" else "left"
    assert at(found, f"{side}_shoulder") == pytest.approx([0, 0.2 * SIDES[side], 0.4])
    assert at(found, f"{side}_elbow") == pytest.approx([0, 0.2 * SIDES[side], 0.1])
    assert at(found, f"{side}_wrist") == pytest.approx([0, 0.2 * SIDES[side], -0.15])
    assert len(found.chains[f"{side}_arm"]) == 7 and len(found.chains["neck"]) == 2
    everywhere = [*found.points, *found.ends, *found.chains, *found.joints, *found.held, *found.left_out]
    assert not [name for name in (*everywhere, *found.key_links, *found.ranges) if name.startswith(f"{other}_hand")]
    assert f"{other}_arm" not in found.chains and f"{other}_wrist" not in found.points
    assert "chest" not in about(found)
    assert any(f"only one arm was found, the {side} one" in note for note in found.notes)


def test_which_side_it_is_does_not_hang_on_names(tmp_path: Path) -> None:
    made = _humanoid("left")
    for part, name in enumerate(made.parts):
        made.parts[part] = name.replace("left_", "a").replace("right_", "b").replace("head", "c")
    found = made.found(tmp_path)
    assert at(found, "left_elbow") == pytest.approx([0, 0.2, 0.1]) and "right_elbow" not in found.points


def test_a_trunk_by_its_name_that_carries_one_arm_is_asked_about(tmp_path: Path) -> None:
    made = Made()
    made.wrist("left", made.forearm("left", made.arm("left")))
    found = made.found(tmp_path)
    assert at(found, "left_wrist") == pytest.approx([0, 0.2, -0.15]) and "chest" in about(found)


def test_a_robot_arm_by_itself_is_refused(tmp_path: Path) -> None:
    """As those of factories are: nothing tells whether it is a left one."""
    made = Made()
    made.wrist("left", made.forearm("left", made.arm("left")))
    made.parts = [part.replace("'chest'", "'base_link'").replace("left_", "") for part in made.parts]
    with pytest.raises(UserError, match="nor one arm beside the middle of legs, a head or a trunk"):
        made.found(tmp_path)


def test_an_arm_in_the_middle_of_a_robot_is_refused(tmp_path: Path) -> None:
    """As that of a cart with a head: it is no more a left arm than a right one."""
    made = Made()
    made.wrist("left", made.forearm("left", made.arm("left")))
    made.join("head_pitch", made.join("head_yaw", "chest", (0, 0.2, 0.5), Z), (0, 0, 0.05), Y)
    with pytest.raises(UserError, match="nor one arm beside the middle"):
        made.found(tmp_path)


def test_fingers_of_a_robot_arm_are_neither_legs_nor_an_arm(tmp_path: Path) -> None:
    made = Made(["<link name='base'/>"])
    link = "base"
    for number, axis in enumerate((Z, Y, Z, Y, Z, Y, Z)):
        link = made.join(f"a{number}", link, (0, 0, 0.2), axis, (-2.9, 2.9))
    for finger, y in (("one", 0.05), ("two", -0.05), ("thumb", 0.0)):
        part, axis = link, X if finger == "thumb" else Y
        for number in range(4):
            place = (0.03 * (finger == "thumb"), y, 0.03) if not number else (0, 0, 0.05)
            part = made.join(f"{finger}{number}", part, place, axis if number else Z, (-0.2, 1.6))
    with pytest.raises(UserError):
        made.found(tmp_path)


def test_what_is_written_of_one_arm_can_be_used(tmp_path: Path) -> None:
    _humanoid("right").found(tmp_path)
    described = describe_model(str(tmp_path / "made.urdf"), tmp_path / "made.yaml")
    text = described.file.read_text()
    assert "right_elbow" in text and "left_elbow" not in text and "Note: only one arm was found" in text
    names = BodyMap(Robot.from_config(described.file)).direction_names
    assert "right_wrist" in names and "left_wrist" not in names


def test_random_humanoids_with_one_arm_are_right_or_asked_about(tmp_path: Path) -> None:
    path, right = tmp_path / "made.urdf", 0
    for seed in range(12):
        truth = humanoid(seed, "one arm")
        path.write_text(truth.urdf)
        try:
            found = discover(path, whole_body=True)
        except UserError:
            continue
        wrong = mistakes(found, truth, path)
        right += not wrong
        assert not wrong or asked(found, wrong), (seed, wrong)
    assert right >= 9


def test_what_turns_the_trunk_below_one_arm_is_no_part_of_it(tmp_path: Path) -> None:
    """By a head that it carries too, or by names; else it is asked about."""
    for waist, head, asks in (
        ("waist", False, False),
        ("waist", True, False),
        ("joint", True, False),
        ("j", False, True),
    ):
        made = Made(["<link name='pelvis'/>"])
        made.parts.append("<link name='chest'/>")
        made.parts.append(
            f"<joint name='{waist}' type='revolute'><parent link='pelvis'/><child link='chest'/><axis xyz='0 1 0'/>"
            "<limit lower='-0.5' upper='0.5' effort='1' velocity='1'/></joint>"
        )
        made.wrist("left", made.forearm("left", made.arm("left")))
        for each, sign in SIDES.items():
            link = made.join(f"{each}_hip_roll", "pelvis", (0, 0.1 * sign, -0.1), X)
            link = made.join(f"{each}_hip_pitch", link, (0, 0, 0), Y, (-2.0, 0.5))
            link = made.join(f"{each}_knee", link, (0, 0, -0.4), Y, (0.0, 2.2))
            made.join(f"{each}_foot", link, (0, 0, -0.4), Y, (-0.8, 0.8))
        if head:
            made.join("head_pitch", made.join("head_yaw", "chest", (0, 0, 0.5), Z), (0, 0, 0.05), Y)
        if asks:
            made.parts = [
                part.replace("shoulder", "s").replace("elbow", "e").replace("left_", "l") for part in made.parts
            ]
        found = made.found(tmp_path)
        assert ("chest" in about(found)) == asks, (waist, head)
        if not asks:
            assert found.chains["waist"] == (waist,) and len(found.chains["left_arm"]) == 7
