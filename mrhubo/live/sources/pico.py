"""Body tracking of a PICO headset by XRoboToolkit: 24 joints, of which the places are read.

SDK: https://github.com/XR-Robotics, on PyPI `xrobotoolkit-sdk`; its joints are SMPL's and two hands, its axes are
right-handed with y up, as its app in the headset writes them (XRoboToolkit-Unity-Client, `TrackingData.cs`) and GMR
reads them (https://github.com/YanjieZe/GMR, `XRobotStreamer`). Not tried with a headset.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from mrhubo.errors import UserError, first_line
from mrhubo.lazy import import_optional
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import Landmarks, Message, Nobody, Refused
from mrhubo.live.named import NamedSource
from mrhubo.live.point_sets import POINT_SETS

_JOINTS, _NUMBERS = 24, 7
"""How many there are, and numbers of each that are known."""
_FARTHEST = 1e3
_NAME = "pico"


def to_landmarks(poses: Any) -> Landmarks:
    """Points of `get_body_joints_pose()`: (24, 7), each x, y, z [m] and a quaternion, which is not read, nor what a
    newer SDK tells after it.

    Raises:
        Refused: it has another shape or holds no numbers.
    """
    try:
        pose_K7 = np.asarray(poses, np.float64)
    except (TypeError, ValueError) as error:
        raise Refused("malformed") from error
    if pose_K7.ndim != 2 or len(pose_K7) != _JOINTS or pose_K7.shape[1] < _NUMBERS:
        raise Refused("malformed")
    if not (np.abs(pose_K7[:, :3]) <= _FARTHEST).all():
        raise Refused("malformed")
    names = POINT_SETS["pico"].names or ()
    points = {name: (x, y, z) for name, (x, y, z) in zip(names, pose_K7[:, :3].tolist(), strict=True)}
    return Landmarks(points, {}, in_world=True)


class PicoSource(NamedSource):
    """Asks the SDK once a period."""

    has_heartbeat = False

    def __init__(self) -> None:
        """Raises a UserError where the SDK is not installed."""
        self._sdk = import_optional(
            "xrobotoolkit_sdk", "--source pico: needs XRoboToolkit's SDK: pip install 'mrhubo[pico]'"
        )
        self._session, self._number = str(time.time_ns()), 0
        self._last: Any = None
        self._is_open = False

    def open(self) -> None:
        """Connects to the service on this machine.

        Raises:
            UserError: it does not answer.
        """
        try:
            self._sdk.init()
        except Exception as error:
            raise UserError(f"--source pico: XRoboToolkit's service does not answer: {error}") from error
        self._is_open = True

    def read(self, inbox: Inbox, now: float) -> bool:
        """Gives the pose, if it is a new one; nobody, where the headset has tracked no body yet.

        The SDK goes on telling the last body when the headset has lost it or has gone, and knows the time of a body
        only where the app in the headset gives one, which that of 2025 does not. So a body is new if anything of it is:
        no two measurements of a person are equal.

        Raises:
            UserError: the SDK has failed.
        """
        try:
            tracked = bool(self._sdk.is_body_data_available())
            poses = self._sdk.get_body_joints_pose() if tracked else None
            times = (self._sdk.get_body_timestamp_ns(), self._sdk.get_body_joints_timestamp()) if tracked else None
        except Exception as error:
            raise UserError(f"--source pico: XRoboToolkit's SDK has failed: {first_line(error)}") from error
        if tracked and (poses, times) == self._last:
            return True
        self._last = (poses, times)
        self._number += 1
        try:
            content = to_landmarks(poses) if tracked else Nobody()
        except Refused as fault:
            inbox.counts[str(fault)] += 1
            return True
        inbox.offer(Message(self._session, self._number, now, content), _NAME, now)
        return True

    def close(self) -> None:
        """Disconnects."""
        if self._is_open:
            self._sdk.close()
        self._is_open = False
