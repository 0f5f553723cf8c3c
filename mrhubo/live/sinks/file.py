"""The session as a file of robot motion, in any format that `mrhubo retarget` writes."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.robot_motion import FORMATS, RobotMotion, find_format, write_robot_motion

PART = ".part"


class FileSink:
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

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Makes the part.

        Raises:
            UserError: the folder or the disk refuses it.
        """
        self._robot, self._rate = robot, config.rate
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(self._part, "wb")
        except OSError as error:
            raise UserError(f"{self._part}: cannot be written: {error.strerror or error}") from error

    def send(self, output: Output) -> None:
        """Appends a row: the joint angles, and the least confidence.

        Raises:
            UserError: the disk refuses it.
        """
        if self._file is not None:
            row = np.append(output.q_N, min(output.confidence.values(), default=0.0)).astype(np.float32)
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
            file.close()
            rows_TX = np.fromfile(self._part, np.float32).reshape(-1, len(self._robot.joint_names) + 1)
        except OSError as error:
            raise UserError(f"{self._part}: cannot be written: {error.strerror or error}") from error
        motion = RobotMotion(
            rows_TX[:, :-1], self._robot.joint_names, self._rate, name=self.path.stem, source="a live session",
            robot=self._robot.facts, confidence=rows_TX[:, -1],
        )  # fmt: skip
        write_robot_motion(motion, self.path)
        self._part.unlink(missing_ok=True)
