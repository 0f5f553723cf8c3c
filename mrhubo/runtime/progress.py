"""What a person who waits is told: a line for each long step, and sentences.

In a terminal or a notebook a line is redrawn, in a log file it is printed now and then.
"""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TextIO

_TERMINAL_SECONDS = 0.2
_LOG_SECONDS = 15.0


class Reporter:
    """Tells whoever started a command how it is getting on; everything below the commands is given one."""

    def __init__(self, quiet: bool = False, stream: TextIO | None = None) -> None:
        """`quiet`: it says nothing at all. `stream`: where progress goes; default: standard error."""
        self.quiet, self.stream = quiet, stream

    @classmethod
    def silent(cls) -> Reporter:
        """One that says nothing: for a part whose progress somebody else tells, and for all ranks but the first."""
        return cls(quiet=True)

    def step(self, title: str, total: int, unit: str = "") -> Progress:
        """The line of one long step: `with report.step("pairs", 50_000) as progress: progress.update(2_500)`."""
        return Progress(title, total, unit, None if self.quiet else self.stream or sys.stderr)

    def say(self, text: str) -> None:
        """A sentence on standard output."""
        if not self.quiet:
            print(text, flush=True)


SILENT = Reporter.silent()
"""The default of functions that take a reporter."""


class Progress:
    """The line of one step, of which `total` parts are to be done; `stream` None: it is not shown."""

    def __init__(self, title: str, total: int, unit: str, stream: TextIO | None) -> None:
        self.title, self.total, self.unit, self.stream = title, total, unit, stream
        notebook = type(stream).__module__.startswith("ipykernel.")
        self.terminal = stream is not None and (stream.isatty() or notebook)
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
        elif now - self._shown >= pause:
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
        if self.stream is None:
            return
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
        if self._last and not self._ended:
            self._show(self._last)
            if self.terminal and self.stream is not None:
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
