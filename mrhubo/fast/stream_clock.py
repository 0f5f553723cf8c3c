"""When a stream's frames come: at times of their own, or one after the other at a rate."""

from __future__ import annotations

from mrhubo.errors import UserError, shortened
from mrhubo.fast.stream_settings import is_number

_SAME = 1e-9
"""Times that differ by less [s] are the same: what is divided by less of it has no finite value."""


class StreamClock:
    """The time of a stream's last frame."""

    def __init__(self, rate: float) -> None:
        """`rate`: frames per second of those that come without a time."""
        self.rate = rate
        self.time: float | None = None
        """Of the last frame [s]; None: there was none. The stream sets it when it has worked on a frame."""

    def passed(self, time: float | None) -> tuple[float, float]:
        """Time since the last frame [s], and the time of this one; the clock stays as it is.

        Args:
            time: of the frame [s]; None: one frame after the last.

        Raises:
            UserError: the time is no number, or before the last one.
        """
        if time is None:
            return 1 / self.rate, 0.0 if self.time is None else self.time + 1 / self.rate
        if not is_number(time):
            raise UserError(f"stream: the time of a frame must be a number of seconds, found {shortened(time)}")
        if self.time is None:
            return 1 / self.rate, float(time)
        if time < self.time:
            raise UserError(f"stream: time goes back from {self.time:g} to {time:g} s; reset() begins anew")
        if time - self.time < _SAME:
            return 0.0, self.time
        return float(time) - self.time, float(time)
