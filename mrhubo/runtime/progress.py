"""One line that shows how a long step is getting on: in a terminal or a notebook it is redrawn, in a log file it is
printed now and then.
"""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TextIO

_TERMINAL_SECONDS = 0.2
_LOG_SECONDS = 15.0


class Progress:
    """Progress of one step: `with Progress("pairs", 50_000) as progress: progress.update(2_500, "residual 4.1 mm")`."""

    def __init__(
        self, title: str, total: int, unit: str = "", quiet: bool = False, stream: TextIO | None = None
    ) -> None:
        self.title, self.total, self.unit, self.quiet = title, total, unit, quiet
        self.stream = stream or sys.stderr
        self.terminal = self.stream.isatty() or type(self.stream).__module__.startswith("ipykernel.")  # or a notebook
        self.start = time.monotonic()
        self._first: int | None = None
        self._shown, self._width, self._last = -float("inf"), 0, ""
        self._ended = False

    def update(self, done: int, measure: str = "") -> None:
        """Says that `done` of `total` are done. The rate counts from the first update, so resumed work is not in it."""
        if self._ended:
            return
        now = time.monotonic()
        if self._first is None:
            self._first, self.start = done, now
        self._last = self._line(done, measure, now)
        pause = _TERMINAL_SECONDS if self.terminal else _LOG_SECONDS
        if done >= self.total:
            self._end()
        elif now - self._shown >= pause and not self.quiet:
            self._shown = now
            self._show(self._last)

    def _line(self, done: int, measure: str, now: float) -> str:
        seconds, fresh = now - self.start, done - (self._first or 0)
        rate = fresh / seconds if seconds > 0.05 and fresh > 0 else 0.0
        parts = [f"{self.title}: {done:,} of {self.total:,}{' ' + self.unit if self.unit else ''}"]
        if rate:
            parts.append(f"{rate:,.0f}/s" if rate >= 10 else f"{rate:.2g}/s")
            parts.append(
                f"{_clock((self.total - done) / rate)} left" if done < self.total else f"took {_clock(seconds)}"
            )
        return ", ".join(parts + ([measure] if measure else []))

    def _show(self, line: str) -> None:
        if self.terminal:
            self.stream.write("\r" + line.ljust(self._width))
            self._width = len(line)
        else:
            self.stream.write(line + "\n")
        self.stream.flush()

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def _end(self) -> None:
        """The last line, once."""
        if self._last and not self.quiet and not self._ended:
            self._show(self._last)
            if self.terminal:
                self.stream.write("\n")
                self.stream.flush()
        self._ended = True


def _clock(seconds: float) -> str:
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02d} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"
