"""One line: redrawn in a terminal, sparse in a file, silent when asked."""

from __future__ import annotations

import io

import pytest

from mrhubo.runtime import progress
from mrhubo.runtime.progress import SILENT, Reporter


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
    with Reporter(stream=stream).step("pairs", 1000) as line:
        line.update(500)  # resumed: these cost nothing now
        clock[0] = 10
        line.update(600, "residual 4.0 mm")
    shown = stream.getvalue().split("\r")[-1].strip()
    assert shown == "pairs: 600 of 1,000, 10/s, 40 s left, residual 4.0 mm"


def test_a_file_gets_few_lines_and_the_last(clock: list[float]) -> None:
    stream = io.StringIO()
    with Reporter(stream=stream).step("training", 1000, "steps") as line:
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
    with Reporter(stream=stream).step("training", 10, "steps") as line:
        for step in range(11):
            clock[0] = step
            line.update(step)
    assert stream.getvalue().count("\r") == 11 and stream.getvalue().count("\n") == 1


def test_a_silent_reporter_says_nothing(clock: list[float], capsys: pytest.CaptureFixture[str]) -> None:
    stream = Terminal()
    for report in (SILENT, Reporter(quiet=True, stream=stream), Reporter(stream=stream)):
        assert stream.getvalue() == "" and capsys.readouterr() == ("", "")
        with report.step("pairs", 10) as line:
            line.update(5)
            clock[0] += 1
            line.update(10)
        report.say("a sentence")
    assert stream.getvalue().endswith("pairs: 10 of 10, 5/s, took 1 s\n")
    assert capsys.readouterr() == ("a sentence\n", "")


def test_progress_goes_to_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    with Reporter().step("pairs", 10) as line:
        line.update(10)
    assert capsys.readouterr() == ("", "pairs: 10 of 10\n")


def test_a_shorter_line_covers_a_longer_one(clock: list[float]) -> None:
    stream = Terminal()
    with Reporter(stream=stream).step("x", 10) as line:
        line.update(1, "a very long measure indeed")
        clock[0] = 1
        line.update(2)
    assert len(stream.getvalue().split("\r")[2]) >= len("x: 1 of 10, a very long measure indeed")


def test_the_line_ends_when_the_step_is_done_not_when_the_program_leaves_it(clock: list[float]) -> None:
    stream = Terminal()
    report = Reporter(stream=stream)
    with report.step("first", 10) as first, report.step("second", 10) as second:
        first.update(0)
        clock[0] = 1
        first.update(10)
        first.update(10)
        second.update(10)
    assert [line.split("\r")[-1][:10] for line in stream.getvalue().split("\n")[:-1]] == ["first: 10 ", "second: 10"]
