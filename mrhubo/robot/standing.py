"""A robot at one pose, as a mapping is checked on it: where links, points and the axes of joints are.

Positions in metres, all in the frame of the robot's root.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrhubo.robot.discovery.lines import Line
from mrhubo.robot.entries import Point
from mrhubo.robot.joint import Joint
from mrhubo.robot.urdf import Description, link_poses


class StandingRobot:
    """A robot at one pose: where its links and the axes of its joints are."""

    def __init__(self, description: Description, configuration: Mapping[str, float]) -> None:
        """Places every link; `configuration` as for `mrhubo.robot.urdf.link_poses`."""
        self.description = description
        parsed = description.parsed
        self.poses = (
            link_poses(parsed, configuration)
            if configuration
            else description.once("poses at 0", lambda: link_poses(parsed, {}))
        )
        """Pose (4, 4) of every link."""

    def line(self, joint: Joint) -> Line:
        """The axis of a joint."""
        pose_44 = self.poses[joint.child]
        return Line(pose_44[:3, 3], pose_44[:3, :3] @ joint.axis_3)

    def position(self, point: Point) -> np.ndarray:
        """Where a point of a link is (3,)."""
        pose_44 = self.poses[point.link]
        return pose_44[:3, :3] @ np.asarray(point.offset_3) + pose_44[:3, 3]

    def on_link(self, link: str, position_3: np.ndarray) -> Point:
        """The point of a link that is at a position (3,), rounded to a tenth of a millimetre."""
        pose_44 = self.poses[link]
        x, y, z = np.round(pose_44[:3, :3].T @ (position_3 - pose_44[:3, 3]), 4).tolist()
        return Point(link, (x + 0.0, y + 0.0, z + 0.0))
