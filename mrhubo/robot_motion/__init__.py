"""Robot motions: what they are in memory, the formats they are written in, and the order of their joints.

The formats are imported when one of them is first asked for: an answer needs none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrhubo.lazy import lazy_names
from mrhubo.robot_motion.motion import FollowingJoint, RobotFacts, RobotMotion
from mrhubo.robot_motion.order import JointOrder, in_order, read_joint_order

if TYPE_CHECKING:
    from mrhubo.robot_motion.formats import FORMATS, find_format, read_robot_motion, write_robot_motion
    from mrhubo.robot_motion.lerobot import read_lerobot, write_lerobot
    from mrhubo.robot_motion.span import trim_robot_motion

__all__ = [
    "FORMATS",
    "FollowingJoint",
    "JointOrder",
    "RobotFacts",
    "RobotMotion",
    "find_format",
    "in_order",
    "read_joint_order",
    "read_lerobot",
    "read_robot_motion",
    "trim_robot_motion",
    "write_lerobot",
    "write_robot_motion",
]
_HOMES = {
    "FORMATS": ".formats",
    "find_format": ".formats",
    "read_lerobot": ".lerobot",
    "read_robot_motion": ".formats",
    "trim_robot_motion": ".span",
    "write_lerobot": ".lerobot",
    "write_robot_motion": ".formats",
}
"""Module of each name that answers do not need."""

__getattr__ = lazy_names(__name__, _HOMES)
