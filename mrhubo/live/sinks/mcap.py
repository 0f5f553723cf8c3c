"""The session as a ROS 2 bag that grows, with base and contacts of a robot with legs: if the process is killed, all but
the last third of a second is there.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, BinaryIO

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.live.named import NamedSink
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.own_file import open_own
from mrhubo.live.sinks.trajectory import stamped, trajectory
from mrhubo.robot_motion.mcap import (
    BASE_TOPIC,
    BOOL,
    POSE,
    TOPIC,
    JointTrajectoryBag,
    contact_topics,
    import_mcap,
    pose_message,
)


class McapSink(NamedSink):
    """A JointTrajectory for every output, handed to the system some ten at a time."""

    def __init__(self, path: Path) -> None:
        """Where to write.

        Raises:
            UserError: mcap-ros2-support is not installed.
        """
        import_mcap()
        self.path = path
        self._file: BinaryIO | None = None
        self._bag: Any = None
        self._period, self._first = 0.0, 0

    @property
    def writes(self) -> tuple[Path, ...]:
        """The bag."""
        return (self.path,)

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Begins the file.

        Raises:
            UserError: another sink writes it, or the folder or the disk refuses it.
        """
        self._period, self._first = 1.0 / config.rate, 0
        self._file = open_own(self.path)
        try:
            self._bag = JointTrajectoryBag(self._file)
        except OSError as error:
            raise self._refused(error) from error

    def send(self, output: Output) -> None:
        """Appends a message; its stamp counts periods from 0 on, its log time is our clock's.

        Raises:
            UserError: the disk refuses it.
        """
        if self._file is None:
            return
        self._first = self._first or output.number
        stamp = (output.number - self._first) * self._period
        try:
            self._bag.write(TOPIC, trajectory(output, self._period, stamp), output.time)
            if output.standing is not None:
                base, contact = output.standing.base, output.standing.contact
                pose = pose_message(base.position_3, base.quaternion_wxyz_4, stamped(stamp))
                self._bag.write(BASE_TOPIC, pose, output.time, POSE)
                for topic, planted in zip(contact_topics(tuple(contact)), contact.values(), strict=True):
                    self._bag.write(topic, {"data": planted}, output.time, BOOL)
        except OSError as error:
            raise self._refused(error) from error

    def close(self) -> None:
        """Ends the file with its index, as far as the disk allows.

        Raises:
            UserError: the disk refuses it.
        """
        file, self._file = self._file, None
        if file is not None:
            try:
                self._bag.finish()
                file.close()
            except OSError as error:
                raise self._refused(error) from error

    def _refused(self, error: OSError) -> UserError:
        return UserError(f"{self.path}: cannot be written: {error.strerror or error}")
