"""Whether the points of a body map lie on the robot: offsets are metres, and of a size that a robot has."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.errors import InputWarning, UserError
from mrhubo.robot.entries import Point
from mrhubo.robot.standing import StandingRobot
from mrhubo.robot.suggestions import point_entry

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_FAR = 0.4
"""How far a point may be from every link's frame, as a share of the robot's size: a forearm is a fifth of a body."""
_NOWHERE = 2.0
"""The same from where on it cannot be meant."""
_MILLIMETRES = 1e-3


def check_offsets(body_map: BodyMap) -> None:
    """Refuses points that lie nowhere near the robot, and warns of those that lie beside it.

    Raises:
        UserError: names the entry, and what it would be in metres.
    """
    robot = body_map.robot
    standing = StandingRobot(robot.description, robot.configuration(robot.home().cpu().numpy()))
    origin_L3 = np.stack([pose_44[:3, 3] for pose_44 in standing.poses.values()])
    size = float(np.linalg.norm(origin_L3.max(axis=0) - origin_L3.min(axis=0)))
    for name, point in body_map.keypoints.points.items():
        apart = float(np.linalg.norm(origin_L3 - standing.position(point), axis=1).min())
        if apart <= _FAR * size or not any(point.offset_3):
            continue
        x, y, z = (number * _MILLIMETRES for number in point.offset_3)
        sentence = (
            f"robot.keypoints.{name}: lies {apart:.3g} m from every link of a robot of {size:.2g} m; offsets are in "
            f"metres, in the frame of '{point.link}'. "
        )
        smaller = Point(point.link, (x, y, z))
        if apart > _NOWHERE * size:
            raise UserError(f"{sentence}Were these millimetres? Write {point_entry(name, smaller)}")
        advice = body_map.yardstick.advice(name, after=" ")
        warnings.warn(f"{sentence}Is this one right?{advice}", InputWarning, stacklevel=2)
