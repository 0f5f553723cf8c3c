"""One line: redrawn in a terminal, sparse in a file, silent when asked."""

from __future__ import annotations

import io

import pytest

from mrhubo.runtime import progress
from mrhubo.runtime.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_rate_and_time_left_count_from_the_first_update(clock: list[float]) -> None:
    stream = Terminal()
    with Progress("pairs", 1000, stream=stream) as line:
        line.update(500)  # resumed: these cost nothing now
        clock[0] = 10
        line.update(600, "residual 4.0 mm")
    shown = stream.getvalue().split("\r")[-1].strip()
    assert shown == "pairs: 600 of 1,000, 10/s, 40 s left, residual 4.0 mm"


def test_a_file_gets_few_lines_and_the_last(clock: list[float]) -> None:
    stream = io.StringIO()
    with Progress("training", 1000, "steps", stream=stream) as line:
        for step in range(1001):
            clock[0] = step * 0.04
            line.update(step)
    lines = stream.getvalue().splitlines()
    assert (
        3 <= len(lines) <= 5
        and lines[-1].startswith("training: 1,000 of 1,000 steps")
        and "\r" not in stream.getvalue()
    )


def test_a_notebook_redraws(clock: list[float]) -> None:
    stream = type("OutStream", (io.StringIO,), {"__module__": "ipykernel.iostream"})()
    with Progress("training", 10, "steps", stream=stream) as line:
        for step in range(11):
            clock[0] = step
            line.update(step)
    assert stream.getvalue().count("\r") == 11 and stream.getvalue().count("\n") == 1


def test_quiet_is_quiet(clock: list[float]) -> None:
    stream = Terminal()
    with Progress("pairs", 10, quiet=True, stream=stream) as line:
        line.update(10)
    assert stream.getvalue() == ""


def test_a_shorter_line_covers_a_longer_one(clock: list[float]) -> None:
    stream = Terminal()
    with Progress("x", 10, stream=stream) as line:
        line.update(1, "a very long measure indeed")
        clock[0] = 1
        line.update(2)
    assert len(stream.getvalue().split("\r")[2]) >= len("x: 1 of 10, a very long measure indeed")


def test_the_line_ends_when_the_step_is_done_not_when_the_program_leaves_it(clock: list[float]) -> None:
    stream = Terminal()
    with Progress("first", 10, stream=stream) as first, Progress("second", 10, stream=stream) as second:
        first.update(0)
        clock[0] = 1
        first.update(10)
        first.update(10)
        second.update(10)
    assert [line.split("\r")[-1][:10] for line in stream.getvalue().split("\n")[:-1]] == ["first: 10 ", "second: 10"]
