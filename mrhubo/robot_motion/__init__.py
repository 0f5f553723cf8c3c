"""Robot motions: what they are in memory, the formats they are written in, and the order of their joints."""

from mrhubo.robot_motion.formats import FORMATS, find_format, read_robot_motion, write_robot_motion
from mrhubo.robot_motion.lerobot import read_lerobot, write_lerobot
from mrhubo.robot_motion.motion import FollowingJoint, RobotFacts, RobotMotion
from mrhubo.robot_motion.order import JointOrder, in_order, read_joint_order

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
    "write_lerobot",
    "write_robot_motion",
]
