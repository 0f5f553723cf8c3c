"""A ROS 2 topic of JointTrajectory messages, and of a robot with legs one of its base's pose, where `rclpy` is there,
which comes with ROS 2, not from a registry.
"""

from __future__ import annotations

from typing import Any

from mrhubo.config.live import LiveConfig
from mrhubo.lazy import import_optional
from mrhubo.live.named import NamedSink
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.trajectory import trajectory
from mrhubo.robot_motion.mcap import BASE_TOPIC, TOPIC


class Ros2Sink(NamedSink):
    """Publishes; the newest message alone is kept for who is slow."""

    def __init__(self, topic: str = "") -> None:
        """`topic`: default `/joint_trajectory`. Raises a UserError where ROS 2 is not there."""
        self.topic = topic or TOPIC
        missing = "--sink ros2: ROS 2's rclpy is not there; source its setup.bash first"
        self._rclpy = import_optional("rclpy", missing)
        self._trajectories = import_optional("trajectory_msgs.msg", missing)
        self._node: Any = None
        self._publisher: Any = None
        self._poses: Any = None
        self._period = 0.0

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Makes the node `mrhubo_live`."""
        self._period = 1.0 / config.rate
        if not self._rclpy.ok():
            self._rclpy.init()
        self._node = self._rclpy.create_node("mrhubo_live")
        self._publisher = self._node.create_publisher(self._trajectories.JointTrajectory, self.topic, 1)
        if robot.standing is not None:
            messages = import_optional("geometry_msgs.msg", "--sink ros2: ROS 2's geometry_msgs is not there")
            self._poses = messages.PoseStamped, self._node.create_publisher(messages.PoseStamped, BASE_TOPIC, 1)

    def send(self, output: Output) -> None:
        """Publishes a trajectory that begins now: its stamp is 0, as controllers take it."""
        if self._node is None:
            return
        told = trajectory(output, self._period, 0.0)
        message = self._trajectories.JointTrajectory()
        message.joint_names = told["joint_names"]
        for row in told["points"]:
            point = self._trajectories.JointTrajectoryPoint()
            point.positions, point.velocities = row["positions"], row["velocities"]
            point.time_from_start.sec = row["time_from_start"]["sec"]
            point.time_from_start.nanosec = row["time_from_start"]["nanosec"]
            message.points.append(point)
        self._publisher.publish(message)
        if self._poses is not None and output.standing is not None:
            kind, publisher = self._poses
            pose, base = kind(), output.standing.base
            pose.header.frame_id = "world"
            at, turn = pose.pose.position, pose.pose.orientation
            at.x, at.y, at.z = base.position_3.tolist()
            turn.w, turn.x, turn.y, turn.z = base.quaternion_wxyz_4.tolist()
            publisher.publish(pose)

    def close(self) -> None:
        """Ends the node."""
        node, self._node = self._node, None
        if node is not None:
            node.destroy_node()
