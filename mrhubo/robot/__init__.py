"""The robot: its URDF, batched kinematics, and which link stands for which part of the human body."""

from mrhubo.robot.alignment import align_pose
from mrhubo.robot.bare import bare_sticks
from mrhubo.robot.body_map import BodyMap, build_body_map
from mrhubo.robot.collision import SelfCollision
from mrhubo.robot.facts import robot_facts
from mrhubo.robot.keypoints import Axis, Keypoints, Limb, read_keypoints
from mrhubo.robot.manual_scale import ManualScale, varied
from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.shapes import ROBOT_COLOR, LinkGeometry, read_collision_geometry, read_geometry
from mrhubo.robot.urdf import link_poses

__all__ = [
    "ROBOT_COLOR",
    "Axis",
    "BodyMap",
    "Keypoints",
    "Limb",
    "LinkGeometry",
    "LinkPoses",
    "ManualScale",
    "Robot",
    "SelfCollision",
    "align_pose",
    "bare_sticks",
    "build_body_map",
    "link_poses",
    "read_collision_geometry",
    "read_geometry",
    "read_keypoints",
    "robot_facts",
    "varied",
]
