"""The robot: its URDF, batched kinematics, and which link stands for which part of the human body."""

from mrhubo.robot.keypoints import BodyMap, build_body_map
from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.urdf import load_urdf

__all__ = ["BodyMap", "LinkPoses", "Robot", "build_body_map", "load_urdf"]
