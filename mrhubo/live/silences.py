"""How often the robot stopped because what says that it may move came too seldom, and what helps."""

from __future__ import annotations

import math

from mrhubo.config.live import LiveConfig

_PAUSE = 3.0
"""After a longer silence [s] somebody has left off, and nothing is too slow."""
_FEW = 3
"""Silences of which nothing is said: one may be by chance."""


class Silences:
    """Those of a session. `hear` is told once a period when the last message was here."""

    def __init__(self, config: LiveConfig, of_frames: bool) -> None:
        """`of_frames`: whether frames say that the robot may move; else heartbeats do."""
        self._config, self._of_frames = config, of_frames
        self._last, self._was_held = -math.inf, False
        self._count, self._seconds = 0, 0.0

    def skip(self) -> None:
        """The process was held up, so that the next message tells nothing of what sends it."""
        self._was_held = False

    def hear(self, last: float, held: bool) -> None:
        """Takes note of when the last message was here [s], and whether it says that the robot may move."""
        if last == self._last:
            return
        silence = last - self._last
        if held and self._was_held and self._config.heartbeat_timeout < silence < _PAUSE:
            self._count, self._seconds = self._count + 1, self._seconds + silence
        self._last, self._was_held = last, held

    def told(self) -> str:
        """In a sentence; empty where there were hardly any."""
        if self._count < _FEW:
            return ""
        kind = "frame" if self._of_frames else "heartbeat"
        what = (
            f"stopped for silence: {self._count} times, as a {kind} came {self._seconds / self._count:.2f} s after the"
            f" last, and heartbeat_timeout is {self._config.heartbeat_timeout:g} s"
        )
        if self._of_frames:
            return what + (
                "; heartbeat_timeout=0.18 stop_time=0.3 helps down to 6 frames a second, and with fewer a button that"
                " says that the robot may move"
            )
        return (
            what + "; what sends them, or the network, is too slow: heartbeat_timeout=0.18 stop_time=0.3 waits longer"
        )
