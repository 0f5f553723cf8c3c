"""The clock of a page: where it is, whether it runs, how fast, and what it does at the end."""

from __future__ import annotations

import threading

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Seconds of the motion in a second."""


class Player:
    """Moved by one thread, and told by those of the page's controls."""

    def __init__(self, duration: float) -> None:
        """A clock that runs, at the beginning of a motion of so many seconds."""
        self.duration, self.speed, self.loop = duration, 1.0, True
        self._time, self._playing, self._lock = 0.0, True, threading.Lock()

    @property
    def time(self) -> float:
        """Where it is [s], from 0 to `duration`."""
        return self._time

    @property
    def playing(self) -> bool:
        """Whether it runs."""
        return self._playing

    def advance(self, seconds: float) -> float:
        """Lets so much time of the world pass; gives where the clock is then."""
        with self._lock:
            if self._playing:
                self._time += self.speed * seconds
                if self._time > self.duration:
                    over = self._time - self.duration
                    self._time = over % self.duration if self.loop and self.duration > 0 else self.duration
                    self._playing = self.loop and self.duration > 0
            return self._time

    def seek(self, time: float) -> None:
        """Goes to a moment [s], and stays there."""
        with self._lock:
            self._time, self._playing = min(max(time, 0.0), self.duration), False

    def toggle(self) -> None:
        """Runs or stops; begins anew where it has come to the end."""
        with self._lock:
            self._playing = not self._playing
            if self._playing and self._time >= self.duration:
                self._time = 0.0
