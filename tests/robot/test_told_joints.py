"""Joints that no pose tells are held or refused; those that could be told and are not listed are named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import torch

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot import BodyMap, Robot, build_body_map
from tests.robot.two_arms import joint_of

Pair = Callable[..., RobotConfig]
ARMS = [f"{s}_{joint}" for s in "lr" for joint in ("pitch", "roll", "yaw", "elbow")]
WAIST = (
    joint_of("waist"),
    joint_of("waist").replace("fixed", "revolute").replace(
        "</joint>", '<axis xyz="0 0 1"/><limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>'
    ),
)  # fmt: skip
"""The waist turns."""
HANDS = {f"{side}_hand": {"link": f"{side[0]}_hand", "fingers": [0, 0, -1], "thumb": [1, 0, 0]}
         for side in ("left", "right")}  # fmt: skip


def wrist(side: str) -> tuple[str, str]:
    """One wrist turns."""
    fixed = joint_of(f"{side}_wrist")
    limit = '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    return fixed, fixed.replace("fixed", "revolute").replace("</joint>", limit)


def test_a_waist_is_held_and_said_so(pair: Pair) -> None:
    message = r"robot.joints: 'waist' carries the chest 'chest' .* held at 0; .* hold: {waist: 0.0}"
    with pytest.warns(InputWarning, match=message):
        body_map = build_body_map(pair(WAIST, joints=["waist", *ARMS], ranges={"waist": [-1.0, 1.0]}))
    without = build_body_map(pair(WAIST))
    assert body_map.robot.joint_names == tuple(ARMS)
    q_BN = without.robot.sample(5, torch.Generator().manual_seed(0))
    for robot in (body_map.robot, without.robot):
        assert robot.moving_links == without.robot.moving_links
    found, expected = (m.robot_directions(m.robot.forward(q_BN)) for m in (body_map, without))
    assert torch.equal(found, expected)


def test_a_waist_is_held_in_a_robot_too(pair: Pair) -> None:
    config = pair(WAIST)
    robot = Robot.from_urdf(config.urdf, ["waist", *ARMS], config.keypoints, hold={"neck": 0.2})
    with pytest.warns(InputWarning, match="'waist'"):
        held = BodyMap.of(robot).robot
    assert held.joint_names == tuple(ARMS)
    assert held.held["neck"] == 0.2 and held.held["waist"] == 0.0


def test_a_pelvis_is_no_chest_where_the_waist_turns(pair: Pair) -> None:
    message = (
        r"robot.keypoints.chest: 'base' does not carry 'left_shoulder', 'right_shoulder': 'waist' .* write chest: chest"
    )
    with pytest.raises(UserError, match=message):
        build_body_map(pair(WAIST, joints=["waist", *ARMS], keypoints={"chest": "base"}))
    build_body_map(pair(WAIST, keypoints={"chest": "base"}))  # it does not turn


@pytest.mark.parametrize("joints", [["waist"], [*ARMS, "neck"]])
def test_what_is_no_waist_is_refused(pair: Pair, joints: list[str]) -> None:
    with pytest.raises(UserError, match=rf"'{joints[-1]}' turns no limb, hand or head"):
        build_body_map(pair(WAIST, joints=joints))


def test_what_limits_hold_is_named_as_such_and_a_gears_play_is_not(
    pair: Pair, recwarn: pytest.WarningsRecorder
) -> None:
    elbow, (fixed, turning) = joint_of("l_elbow"), wrist("l")
    behind = elbow.replace("l_elbow", "l_play").replace('"l_fore"', '"l_mid"')
    behind = behind.replace("-2.3", "-0.01").replace('upper="0"', 'upper="0.01"')
    build_body_map(pair((elbow, elbow.replace('"l_lower"', '"l_mid"') + '<link name="l_mid"/>' + behind), joints=ARMS))
    assert not [str(warning.message) for warning in recwarn.list]
    stuck = turning.replace('"-1"', '"0.2"').replace('upper="1"', 'upper="0.2"')
    message = r"'l_wrist' would turn .* limits as 0.2 .. 0.2 leave it no way .* hold: {l_wrist: 0.2}"
    with pytest.warns(InputWarning, match=message):
        build_body_map(pair((fixed, stuck), joints=ARMS, keypoints=HANDS))


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"joints": [j for j in ARMS if j not in ("l_yaw", "r_pitch")]}, r"'l_yaw', 'r_pitch'.*hold: {l_yaw: 0, r_pitch: 0}"),
        ({"joints": ARMS, "keypoints": HANDS}, "'l_wrist'"),
        ({"joints": ARMS, "keypoints": {"head": "head"}}, "'neck'"),
    ],
)  # fmt: skip
def test_joints_that_are_neither_listed_nor_held_are_named(pair: Pair, changes: dict[str, Any], named: str) -> None:
    with pytest.warns(InputWarning, match=rf"robot.joints: {named}.* never move|robot.joints: {named}"):
        build_body_map(pair(wrist("l"), **changes))


def test_held_joints_and_those_that_turn_nothing_are_not_named(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    build_body_map(pair(wrist("l"), wrist("r")))  # they turn hands alone, of which there are none
    build_body_map(pair(wrist("l"), wrist("r"), keypoints=HANDS, hold={"l_wrist": 0.3, "r_wrist": 0.0}))
    assert not [str(warning.message) for warning in recwarn.list]
