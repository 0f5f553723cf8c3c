"""A ROS 2 topic of JointTrajectory messages, and of a robot with legs its base's pose and what is planted, where there
is `rclpy` (ROS 2 Humble or newer).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError, first_line
from mrhubo.lazy import import_optional
from mrhubo.live.named import NamedSink
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.trajectory import trajectory
from mrhubo.robot_motion.mcap import BASE_TOPIC, TOPIC, contact_topics

_MISSING = "--sink ros2: ROS 2's {} is not there; source its setup.bash first"
_NODE = "mrhubo_live"


class Ros2Sink(NamedSink):
    """Publishes; the newest message alone is kept for who is slow."""

    def __init__(self, topic: str = "") -> None:
        """`topic`: default `/joint_trajectory`.

        Raises:
            UserError: ROS 2 is not there, is older than Humble, or takes no topic of this name.
        """
        self.topic = topic or TOPIC
        self._rclpy = import_optional("rclpy", _MISSING.format("rclpy"))
        self._trajectories = import_optional("trajectory_msgs.msg", _MISSING.format("trajectory_msgs"))
        older = "--sink ros2: needs ROS 2 Humble or newer"
        self._no_handlers = import_optional("rclpy.signals", older).SignalHandlerOptions.NO
        names = import_optional("rclpy.validate_topic_name", older)
        with _told(f"{self.topic!r} is no topic: "):
            names.validate_topic_name(self.topic)
        self._node: Any = None
        self._publisher: Any = None
        self._standing: Any = None
        self._period = 0.0
        self._began = False

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Makes the node `mrhubo_live`.

        Raises:
            UserError: ROS 2 can't.
        """
        self._period = 1.0 / config.rate
        with _told():
            if not self._rclpy.ok():
                # ROS 2's own handlers would end its topics at Ctrl-C, before the robot has braked.
                self._rclpy.init(signal_handler_options=self._no_handlers)
                self._began = True
            self._node = self._rclpy.create_node(_NODE)
            self._publisher = self._node.create_publisher(self._trajectories.JointTrajectory, self.topic, 1)
            if robot.standing is not None:
                self._standing = _Standing(self._node, robot.foot_names)

    def send(self, output: Output) -> None:
        """Publishes a trajectory that begins now: its stamp is 0, as controllers take it.

        Raises:
            UserError: ROS 2 has been ended meanwhile.
        """
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
        with _told():
            self._publisher.publish(message)
            if self._standing is not None:
                self._standing.send(output)

    def close(self) -> None:
        """Ends the node, and ROS 2 if it was begun here."""
        node, self._node = self._node, None
        if node is not None:
            node.destroy_node()
        if self._began:
            self._rclpy.try_shutdown()
            self._began = False


class _Standing:
    """Where the base is and which feet are planted, for a robot with legs."""

    def __init__(self, node: Any, feet: tuple[str, ...]) -> None:
        """Makes the topics."""
        self._pose = import_optional("geometry_msgs.msg", _MISSING.format("geometry_msgs")).PoseStamped
        self._flag = import_optional("std_msgs.msg", _MISSING.format("std_msgs")).Bool
        self._poses = node.create_publisher(self._pose, BASE_TOPIC, 1)
        self._planted = [node.create_publisher(self._flag, topic, 1) for topic in contact_topics(feet)]

    def send(self, output: Output) -> None:
        """Publishes both."""
        if output.standing is None:
            return
        pose, base = self._pose(), output.standing.base
        pose.header.frame_id = "world"
        at, turn = pose.pose.position, pose.pose.orientation
        at.x, at.y, at.z = base.position_3.tolist()
        turn.w, turn.x, turn.y, turn.z = base.quaternion_wxyz_4.tolist()
        self._poses.publish(pose)
        for publisher, planted in zip(self._planted, output.standing.contact.values(), strict=True):
            publisher.publish(self._flag(data=planted))


@contextmanager
def _told(what: str = "ROS 2 can't: ") -> Iterator[None]:
    """ROS 2's errors, of a dozen types, as a sentence."""
    try:
        yield
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"--sink ros2: {what}{first_line(error)}") from error
