"""ROS 2's topics: by a stand-in for `rclpy`, and by ROS 2 itself where it is there (`.ci/environments ros2`)."""

from __future__ import annotations

import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.ros2 import Ros2Sink
from mrhubo.live.sinks.trajectory import trajectory
from tests.live.robots import AT_ONCE, NAMES, make_robot

_PATIENCE_S = 120.0


class _Kind:
    """A message of any fields."""

    def __init__(self, **fields: Any) -> None:
        self.__dict__.update(fields)


def _trajectory() -> _Kind:
    return _Kind(joint_names=[], points=[])


def _point() -> _Kind:
    return _Kind(time_from_start=_Kind(sec=0, nanosec=0))


def _pose() -> _Kind:
    return _Kind(header=_Kind(), pose=_Kind(position=_Kind(), orientation=_Kind()))


class StandIn:
    """`rclpy` as far as the sink uses it. As ROS 2 does, it hears of signals, unless it is told not to, and falls silent
    then."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.sent: dict[str, deque[Any]] = {}
        self.is_on = self.hears_signals = False
        parts = {
            "rclpy": SimpleNamespace(
                ok=lambda: self.is_on, init=self._init, try_shutdown=self._end, create_node=lambda name: self
            ),
            "rclpy.signals": SimpleNamespace(SignalHandlerOptions=SimpleNamespace(NO="no")),
            "rclpy.validate_topic_name": SimpleNamespace(validate_topic_name=self._check),
            "trajectory_msgs.msg": SimpleNamespace(JointTrajectory=_trajectory, JointTrajectoryPoint=_point),
            "geometry_msgs.msg": SimpleNamespace(PoseStamped=_pose),
            "std_msgs.msg": SimpleNamespace(Bool=_Kind),
        }
        for name, part in parts.items():
            patch.setitem(sys.modules, name, part)

    def _init(self, signal_handler_options: str = "all") -> None:
        self.is_on, self.hears_signals = True, signal_handler_options != "no"

    def _end(self) -> None:
        self.is_on = False

    def _check(self, topic: str) -> None:
        if " " in topic:
            raise ValueError("topic name must not contain characters other than alphanumerics\n  here")

    def create_publisher(self, kind: Any, topic: str, depth: int) -> Any:
        self._check(topic)
        return SimpleNamespace(publish=lambda told: self._publish(topic, told))

    def _publish(self, topic: str, told: Any) -> None:
        if not self.is_on:
            raise RuntimeError("context is invalid")
        self.sent.setdefault(topic, deque(maxlen=10)).append(told)

    def destroy_node(self) -> None:
        pass

    def listen(self, topic: str, kind: str) -> None:
        pass

    def heard(self, topic: str, send: Callable[[], None]) -> Any:
        self.sent.clear()
        send()
        return self.sent[topic][-1]

    def interrupt(self) -> None:
        self.is_on = self.is_on and not self.hears_signals

    def close(self) -> None:
        pass


class Real:
    """ROS 2 itself, with a node that listens."""

    def __init__(self) -> None:
        self._rclpy = pytest.importorskip("rclpy", reason="ROS 2's rclpy is not there")
        self._context = self._rclpy.Context()
        self._context.init()
        self._node = self._rclpy.create_node("mrhubo_test", context=self._context)
        self._executor = self._rclpy.executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._got: dict[str, deque[Any]] = {}

    def listen(self, topic: str, kind: str) -> None:
        messages: ModuleType = pytest.importorskip(kind.rpartition(".")[0])
        got = self._got[topic] = deque()
        self._node.create_subscription(
            getattr(messages, kind.rpartition(".")[2]), topic, lambda told: got.append(told), 10
        )

    def heard(self, topic: str, send: Callable[[], None]) -> Any:
        """What comes; it is sent again and again, as who publishes is known after a while."""
        self._got[topic].clear()
        end = time.monotonic() + _PATIENCE_S
        while not self._got[topic] and time.monotonic() < end:
            send()
            self._executor.spin_once(timeout_sec=0.05)
        return self._got[topic][-1]

    def interrupt(self) -> None:
        before = signal.signal(signal.SIGINT, lambda *_: None)
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.5)  # ROS 2 would work on it in a thread of its own
        signal.signal(signal.SIGINT, before)

    def close(self) -> None:
        self._node.destroy_node()
        self._context.try_shutdown()


@pytest.fixture(params=["stand-in", "real"])
def ros(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn | Real]:
    found = StandIn(monkeypatch) if request.param == "stand-in" else Real()
    yield found
    found.close()


def test_trajectories_are_published_until_the_end(ros: StandIn | Real, outputs: list[Output]) -> None:
    ros.listen("/arm", "trajectory_msgs.msg.JointTrajectory")
    sink = Ros2Sink("/arm")
    sink.open(make_robot(), AT_ONCE)
    told = ros.heard("/arm", lambda: sink.send(outputs[-1]))
    assert list(told.joint_names) == list(NAMES)
    wanted = trajectory(outputs[-1], 1 / 60, 0.0)["points"]
    assert [list(point.positions) for point in told.points] == [point["positions"] for point in wanted]
    assert [list(point.velocities) for point in told.points] == [point["velocities"] for point in wanted]
    assert [(point.time_from_start.sec, point.time_from_start.nanosec) for point in told.points] == [
        tuple(point["time_from_start"].values()) for point in wanted
    ]
    sink.close()
    sink.close()
    sink.send(outputs[-1])  # nobody hears it
    again = Ros2Sink("/arm")
    again.open(make_robot(), AT_ONCE)
    assert list(ros.heard("/arm", lambda: again.send(outputs[-1])).points[0].positions) == wanted[0]["positions"]
    again.close()


def test_ctrl_c_is_left_to_the_session(ros: StandIn | Real, outputs: list[Output]) -> None:
    ros.listen("/arm", "trajectory_msgs.msg.JointTrajectory")
    sink = Ros2Sink("/arm")
    sink.open(make_robot(), AT_ONCE)
    ros.heard("/arm", lambda: sink.send(outputs[-1]))
    ros.interrupt()
    assert ros.heard("/arm", lambda: sink.send(outputs[-1])).points  # as the robot still has to brake
    sink.close()


def test_the_base_and_what_is_planted_are_published_too(
    ros: StandIn | Real, walking: tuple[LiveRobot, list[Output]]
) -> None:
    robot, outputs = walking
    standing = outputs[-1].standing
    assert standing is not None and len(robot.foot_names) == 2
    feet = [f"/contact/{name}" for name in robot.foot_names]
    ros.listen("/base_pose", "geometry_msgs.msg.PoseStamped")
    for foot in feet:
        ros.listen(foot, "std_msgs.msg.Bool")
    sink = Ros2Sink()
    sink.open(robot, AT_ONCE)
    send = lambda: sink.send(outputs[-1])  # noqa: E731
    told = ros.heard("/base_pose", send)
    turn, place = told.pose.orientation, told.pose.position
    assert told.header.frame_id == "world"
    assert [turn.w, turn.x, turn.y, turn.z] == standing.base.quaternion_wxyz_4.tolist()
    np.testing.assert_array_equal([place.x, place.y, place.z], standing.base.position_3)
    assert [ros.heard(foot, send).data for foot in feet] == list(standing.contact.values())
    sink.close()


def test_what_is_no_topic_is_said_at_once(ros: StandIn | Real) -> None:
    with pytest.raises(UserError, match=r"--sink ros2: '/an arm' is no topic: .*must not contain[^\n]*$"):
        Ros2Sink("/an arm")


def test_ros_that_has_been_ended_is_one_sentence(ros: StandIn | Real, outputs: list[Output]) -> None:
    sink = Ros2Sink()
    sink.open(make_robot(), AT_ONCE)
    sys.modules["rclpy"].try_shutdown()
    with pytest.raises(UserError, match="--sink ros2: ROS 2 can't"):
        sink.send(outputs[-1])
    sink.close()


@pytest.mark.parametrize("missing", ["rclpy", "trajectory_msgs.msg", "rclpy.signals"])
def test_without_ros_it_is_said(monkeypatch: pytest.MonkeyPatch, missing: str) -> None:
    StandIn(monkeypatch)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(UserError, match=r"--sink ros2: .*ROS 2"):
        Ros2Sink()
