"""What files of a robot's motion tell of the robot."""

from __future__ import annotations

import pytest

from mrhubo.robot import Robot, robot_facts


def test_links_that_are_fixed_to_the_base_have_their_places() -> None:
    robot = Robot.from_config("nao")
    on_base = robot_facts(robot, "", "").on_base
    assert next(iter(on_base)) == robot.description.root and "LShoulder" not in on_base
    assert on_base[robot.description.root] == (0, 0, 0, 1, 0, 0, 0)
    assert on_base["torso"] == pytest.approx((0, 0, 0.33, 1, 0, 0, 0))
