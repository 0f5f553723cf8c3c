"""What a robot's axes tell is told where it is something else than what is there."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from mrhubo.describing.yaml_file import keypoint_entries
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot.discovery import discover
from mrhubo.robot.entries import Point


def coman(root: Path) -> BodyMap:
    found = discover(root / "data/robots/coman/coman.urdf")
    robot = Robot.from_urdf(root / "data/robots/coman/coman.urdf", found.joints, keypoints=keypoint_entries(found))
    return BodyMap(robot)


def test_entries_that_are_there_are_no_advice(root: Path) -> None:
    body_map = coman(root)
    yardstick, given = body_map.yardstick, body_map.keypoints
    assert "left_elbow" in yardstick.advice("left_elbow", "chest")
    assert yardstick.advice("left_elbow", "left_wrist", "chest", given=given) == ""


def test_another_entry_is_advised_alone(root: Path) -> None:
    body_map = coman(root)
    points = {**body_map.keypoints.points, "left_wrist": Point("LShr", (0.0, 0.0, 0.1))}
    given = dataclasses.replace(body_map.keypoints, points=points)
    advice = body_map.yardstick.advice("left_elbow", "left_wrist", given=given)
    assert "left_wrist: " in advice and "left_elbow" not in advice
