"""Ranges of joints of which a file tells no limits, or those of a drawing program that knows none."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from mrhubo.errors import UserError
from mrhubo.robot.discovery import Discovery, discover
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about

_LIMIT = re.compile(r'<limit lower="[^"]*" upper="[^"]*"')


def coman(root: Path, folder: Path, limit: str, kind: str) -> Discovery:
    """COMAN, all of whose joints have such limits."""
    text = (root / "data/robots/coman/coman.urdf").read_text()
    assert _LIMIT.search(text)
    text = _LIMIT.sub(f"<limit {limit}", text).replace('type="revolute"', f'type="{kind}"')
    (folder / "robot.urdf").write_text(text)
    return discover(folder / "robot.urdf", whole_body=True)


@pytest.mark.parametrize(
    ("limit", "kind"),
    [
        ("", "continuous"),
        ('lower="0" upper="0"', "revolute"),
        ('lower="-3.14159" upper="3.14159"', "revolute"),
        ('lower="-3" upper="3"', "revolute"),
    ],
    ids=["none", "empty", "a turn", "nearly a turn"],
)
def test_no_hip_and_no_shoulder_can_be_turned_inside_out(root: Path, tmp_path: Path, limit: str, kind: str) -> None:
    found = coman(root, tmp_path, limit, kind)
    assert set(found.ranges) | {"LElbj", "RElbj"} >= {"LHipLat", "LHipYaw", "LAnkSag", "WaistYaw", "LShYaw", "LWrj1"}
    for name in ("LHipLat", "RHipYaw", "LAnkSag", "LAnkLat", "WaistYaw", "LShYaw", "RWrj1", "RWrj2"):
        ends = found.ranges[name]
        assert (ends.lower, ends.upper) == pytest.approx((-math.pi / 2, math.pi / 2)) and ends.guessed, name
    # Thighs swing, and arms are raised, as far as the file lets them.
    for name in {"LHipSag", "LShSag", "LShLat"} & set(found.ranges):
        assert (found.ranges[name].lower, found.ranges[name].upper) == pytest.approx((-math.pi, math.pi))
    assert {"LHipLat", "LWrj1", "WaistYaw"} <= set(found.guessed)
    assert any("no limits, or about a turn" in note and "before it moves" in note for note in found.notes)


def test_limits_that_leave_no_way_to_move_are_named_where_they_hide_the_arms(root: Path, tmp_path: Path) -> None:
    text = (root / "data/robots/coman/coman.urdf").read_text()
    joint = re.search(r'<joint name="LShSag".*?</joint>', text, re.DOTALL)
    assert joint is not None
    (tmp_path / "robot.urdf").write_text(text.replace(joint[0], _LIMIT.sub('<limit lower="0" upper="0"', joint[0])))
    with pytest.raises(UserError, match=r"no arms were found; 'LShSag' cannot move, by limits as 0 .. 0: correct them"):
        discover(tmp_path / "robot.urdf")
    (tmp_path / "fixed.urdf").write_text(
        re.sub(r'(name="[LR](?:Sh|Elb|Fore|Wrj)\w*" type=)"revolute"', r'\1"fixed"', text)
    )
    with pytest.raises(UserError, match=r"no arms were found; 'LShSag' and 13 more are fixed, though they have limits"):
        discover(tmp_path / "fixed.urdf")


def test_a_joint_that_turns_all_the_way_round_on_an_arm_with_limits_still_does(root: Path, tmp_path: Path) -> None:
    text = (root / "data/robots/coman/coman.urdf").read_text()
    joint = re.search(r'<joint name="LShYaw".*?</joint>', text, re.DOTALL)
    assert joint is not None
    free = _LIMIT.sub("<limit", joint[0]).replace("revolute", "continuous")
    (tmp_path / "robot.urdf").write_text(text.replace(joint[0], free))
    found = discover(tmp_path / "robot.urdf", whole_body=True)
    ends = found.ranges["LShYaw"]
    assert (ends.lower, ends.upper) == pytest.approx((-math.pi, math.pi)) and not found.notes


def test_a_single_joint_of_a_leg_that_turns_far_is_left_as_it_is(root: Path, tmp_path: Path) -> None:
    """As EngineAI PM01's hips: with the roll's limits they cannot be turned inside out."""
    text = (root / "data/robots/coman/coman.urdf").read_text()
    for joint in re.findall(r'<joint name="[LR]HipYaw".*?</joint>', text, re.DOTALL):
        text = text.replace(joint, _LIMIT.sub('<limit lower="-3.14" upper="3.14"', joint))
    (tmp_path / "robot.urdf").write_text(text)
    found = discover(tmp_path / "robot.urdf", whole_body=True)
    assert not {"LHipYaw", "RHipYaw"} & set(found.ranges) and not found.notes


def test_no_joint_winds_up(root: Path, tmp_path: Path) -> None:
    """Limits of two turns, as of Universal Robots' arms, are cut to the one around 0; an elbow is narrowed after."""
    found = coman(root, tmp_path, 'lower="-6.28" upper="6.28"', "revolute")
    for name in ("LShSag", "LShLat", "LForearmPlate"):
        assert (found.ranges[name].lower, found.ranges[name].upper) == pytest.approx((-math.pi, math.pi)), name
        assert not found.ranges[name].guessed
    assert (found.ranges["LElbj"].lower, found.ranges["LElbj"].upper) == pytest.approx((-math.pi, 0.0), abs=1e-3)


def test_a_robot_with_limits_is_not_said_to_have_none(root: Path) -> None:
    found = discover(root / "data/robots/coman/coman.urdf", whole_body=True)
    assert not any("limits" in note for note in found.notes) and not any(ends.guessed for ends in found.ranges.values())


@pytest.mark.parametrize("twisted", [False, True], ids=["no twist", "twist"])
def test_an_elbow_that_bends_backwards_is_asked_about_where_nothing_twists_the_upper_arm(
    twisted: bool, tmp_path: Path
) -> None:
    """As of a lesson's robot: limits of 0 .. 3 about the axis that points left."""
    made = Made()
    for side, sign in SIDES.items():
        link = made.join(f"{side}_shoulder_pitch", "chest", (0, 0.2 * sign, 0.4), Y, (-2.8, 1.2))
        link = made.join(f"{side}_shoulder_roll", link, (0, 0, 0), X)
        link = made.join(f"{side}_shoulder_yaw", link, (0, 0, 0), Z) if twisted else link
        link = made.join(f"{side}_elbow", link, (0, 0, -0.3), Y, (0, 3.0))
        made.wrist(side, made.join(f"{side}_forearm", link, (0, 0, -0.1), Z))
        made.join(f"{side}_ankle", made.leg(side), (0, 0, -0.4), Y, (-0.6, 0.6))
    found = made.found(tmp_path)
    assert found.forward.root_3 == pytest.approx((1, 0, 0), abs=1e-6)
    assert ({"left_elbow", "right_elbow"} <= about(found)) != twisted


def test_elbows_without_limits_tell_by_how_they_are_bent_at_zero_where_the_robot_faces(tmp_path: Path) -> None:
    """Two-jointed arms on a cart, bent forwards, and names as somebody sees the sides who stands before it."""
    made = Made()
    for side, sign in SIDES.items():
        link = made.join(f"{side}_shoulder", "chest", (0, -0.2 * sign, 0.4), Y, None, "continuous")
        link = made.join(f"{side}_elbow", link, (0, 0, -0.3), Y, None, "continuous", rpy=(0, -0.9, 0))
        made.join(f"{side}_hand", link, (0, 0, -0.25), Y, None, "fixed")
    found = made.found(tmp_path)
    assert any("faced the other way: the elbows bend forward" in note for note in found.notes)
    assert "forward" in about(found)
