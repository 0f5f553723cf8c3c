"""The session as a file of robot motion, in any format that `mrhubo retarget` writes."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.live.named import NamedSink
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.own_file import open_own
from mrhubo.robot_motion import FORMATS, RobotMotion, find_format, write_robot_motion

PART = ".part"
_BASE = 7
"""Numbers of a row that tell where the base is."""


class FileSink(NamedSink):
    """Rows go to `NAME.part` as they come, so that memory does not grow; at the end they become the file."""

    def __init__(self, path: Path) -> None:
        """Where to write.

        Raises:
            UserError: no format has that ending, or its library is missing.
        """
        self.path, self._part = path, path.with_name(path.name + PART)
        library = FORMATS[find_format(path)].library
        if library is not None:
            library()
        self._file: BinaryIO | None = None
        self._robot: LiveRobot | None = None
        self._rate = 0.0

    @property
    def writes(self) -> tuple[Path, ...]:
        """The file, and its part."""
        return self.path, self._part

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Makes the part.

        Raises:
            UserError: another sink writes it, or the folder or the disk refuses it.
        """
        self._robot, self._rate = robot, config.rate
        self._file = open_own(self._part)

    def send(self, output: Output) -> None:
        """Appends a row: the joint angles, where the base is and which feet are planted, and the least confidence.

        Raises:
            UserError: the disk refuses it.
        """
        if self._file is not None:
            least = min(output.confidence.values(), default=0.0)
            row = np.concatenate((output.q_N, _base_row(output), [least])).astype(np.float32)
            try:
                self._file.write(row.tobytes())
            except OSError as error:
                raise UserError(f"{self._part}: cannot be written: {error.strerror or error}") from error

    def close(self) -> None:
        """Writes the file; the part stays if that fails.

        Raises:
            UserError: it cannot be written.
        """
        file, self._file = self._file, None
        if file is None or self._robot is None:
            return
        try:
            self._finish(file, self._robot)
        finally:
            with contextlib.suppress(OSError):  # what could not be flushed
                file.close()

    def _finish(self, file: BinaryIO, robot: LiveRobot) -> None:
        """Makes the file of its part, which nobody else may begin anew meanwhile."""
        joints, feet = len(robot.joint_names), robot.foot_names
        width = joints + (_BASE + len(feet) if feet else 0) + 1
        try:
            file.flush()
            numbers = np.fromfile(self._part, np.float32)
        except OSError as error:
            raise UserError(f"{self._part}: cannot be written: {error.strerror or error}") from error
        rows_TX = numbers[: len(numbers) // width * width].reshape(-1, width)  # a full disk takes parts of a row
        motion = RobotMotion(
            rows_TX[:, :joints], robot.joint_names, self._rate, name=self.path.stem, source="a live session",
            robot=robot.facts, confidence=rows_TX[:, -1], **_base_of(rows_TX[:, joints:-1], feet),
        )  # fmt: skip
        write_robot_motion(motion, self.path)
        self._part.unlink(missing_ok=True)


def _base_row(output: Output) -> np.ndarray:
    """Position, quaternion and contacts; nothing of a robot whose base is fixed."""
    if output.standing is None:
        return np.zeros(0)
    base, contact = output.standing.base, output.standing.contact
    return np.concatenate((base.position_3, base.quaternion_wxyz_4, list(contact.values())))


def _base_of(rows_TX: np.ndarray, feet: tuple[str, ...]) -> dict[str, Any]:
    """The fields of a motion that `_base_row` made rows of."""
    if not feet:
        return {}
    turn_T4 = rows_TX[:, 3:_BASE]
    return {
        "root_position": rows_TX[:, :3],
        "root_quaternion_wxyz": turn_T4 / np.linalg.norm(turn_T4, axis=1, keepdims=True),
        "contact": rows_TX[:, _BASE:] > 0,
        "contact_names": feet,
    }
