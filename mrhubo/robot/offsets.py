"""Whether the points of a body map lie on the robot: offsets in metres, and the right ones like the left ones."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.errors import InputWarning, UserError
from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.axis_lines import Line, StandingRobot
from mrhubo.robot.entries import Point
from mrhubo.robot.suggestions import end_entry, oriented, point_entry

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_FAR = 0.4
"""How far a point may be from every link's frame, as a share of the robot's size: a forearm is a fifth of a body."""
_NOWHERE = 2.0
"""The same from where on it cannot be meant."""
_MILLIMETRES = 1e-3
_MIRRORED_M, _MIRRORED_DEG = 0.01, 5.0
"""Up to how far from its mirror image an axis of the other side may be where the robot's two sides are alike."""
_UNLIKE_M, _UNLIKE_DEG = 0.02, 10.0
"""From where on an entry is no mirror image: what turns a limb of 20 cm by 6 degrees, or a hand by more than files are
rounded to."""


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
            f"robot.keypoints.{name}: lies {apart:.3g} m from every link of a robot of {size:.2g} m; offsets are metres "
            f"in the frame of '{point.link}'. "
        )
        smaller = Point(point.link, (x, y, z))
        if apart > _NOWHERE * size:
            raise UserError(f"{sentence}Were these millimetres? Write {point_entry(name, smaller)}")
        warnings.warn(f"{sentence}Is this one right?", InputWarning, stacklevel=2)


def check_mirrored(body_map: BodyMap) -> None:
    """Warns of pairs of entries that are no mirror images of each other, where the robot's two sides are."""
    robot, keypoints = body_map.robot, body_map.keypoints
    standing = StandingRobot(robot.description, robot.configuration(robot.home().cpu().numpy()))
    words = {part.name: part.words for part in oriented(keypoints)}
    seen_from = {name: part.seen_from for part in keypoints.parts for name in (part.name, *part.outer_points)}
    seen_from |= {getattr(part, "start", ""): part.seen_from for part in keypoints.parts}
    for left, right in keypoints.pairs:
        one, other = (keypoints.points.get(name) or keypoints.ends[name] for name in (left, right))
        view = keypoints.ends[seen_from[left] or ""]
        plane = _mid_plane(body_map, standing, one.link, other.link, view.link, view.axes_23.numpy().astype(float))
        if plane is None:
            continue
        if isinstance(one, Point) and isinstance(other, Point):
            image_3 = _reflected(plane, standing.position(one), place=True)
            apart = float(np.linalg.norm(image_3 - standing.position(other)))
            if apart > _UNLIKE_M:
                images = [
                    point_entry(right, standing.on_link(other.link, image_3)),
                    point_entry(left, standing.on_link(one.link, _reflected(plane, standing.position(other), place=True))),
                ]
                _warn(right, left, f"lies {1000 * apart:.0f} mm from it", images)


