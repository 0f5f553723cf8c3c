"""The lines about which a robot's joints turn, and where lines and points are near each other.

Positions in metres, all in the frame of the robot's root, at one pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.robot.entries import Point
from mrhubo.robot.joint import Joint
from mrhubo.robot.urdf import Description, link_poses

_PARALLEL = 1e-3
"""Sine of the angle below which two lines count as parallel (0.06 degrees): rounded numbers in a file make as much."""


@dataclass(frozen=True)
class Line:
    """A line without ends."""

    point_3: np.ndarray
    along_3: np.ndarray
    """Unit."""

    def foot(self, point_3: np.ndarray) -> np.ndarray:
        """The point (3,) of the line that is nearest to a point (3,)."""
        return self.point_3 + ((point_3 - self.point_3) @ self.along_3) * self.along_3

    def distance(self, point_3: np.ndarray) -> float:
        """How far a point (3,) is from the line."""
        return float(np.linalg.norm(point_3 - self.foot(point_3)))

    def nearest(self, other: Line) -> np.ndarray:
        """The point (3,) of this line that is nearest to another line; of a parallel one, the foot of its point.

        C. Ericson, Real-Time Collision Detection (2005), section 5.1.8.
        """
        cosine = float(self.along_3 @ other.along_3)
        if 1 - cosine * cosine < _PARALLEL**2:
            return self.foot(other.point_3)
        between_3 = other.point_3 - self.point_3
        along = float(between_3 @ self.along_3 - cosine * (between_3 @ other.along_3)) / (1 - cosine * cosine)
        return self.point_3 + along * self.along_3

    def gap(self, other: Line) -> float:
        """The least distance between two lines."""
        return other.distance(self.nearest(other))


class StandingRobot:
    """A robot at one pose: where its links and the axes of its joints are."""

    def __init__(self, description: Description, configuration: Mapping[str, float]) -> None:
        """Places every link; `configuration` as for `mrhubo.robot.urdf.link_poses`."""
        self.description = description
        self.poses = link_poses(description.parsed, configuration)
        """Pose (4, 4) of every link."""

    def line(self, joint: Joint) -> Line:
        """The axis of a joint."""
        pose_44 = self.poses[joint.child]
        along_3 = pose_44[:3, :3] @ joint.axis_3
        return Line(pose_44[:3, 3], along_3 / max(float(np.linalg.norm(along_3)), 1e-12))

    def position(self, point: Point) -> np.ndarray:
        """Where a point of a link is (3,)."""
        pose_44 = self.poses[point.link]
        return pose_44[:3, :3] @ np.asarray(point.offset_3) + pose_44[:3, 3]

    def on_link(self, link: str, position_3: np.ndarray) -> Point:
        """The point of a link that is at a position (3,), rounded to a tenth of a millimetre."""
        pose_44 = self.poses[link]
        x, y, z = np.round(pose_44[:3, :3].T @ (position_3 - pose_44[:3, 3]), 4).tolist()
        return Point(link, (x + 0.0, y + 0.0, z + 0.0))
