"""Signals that wait, and processes that are gone."""

from __future__ import annotations

import os
import platform
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from mrhubo.runtime.processes import is_gone, this_process, uninterrupted


@pytest.fixture(autouse=True)
def interruptible() -> Iterator[None]:
    """Python's own handler: a shell's background job is started with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_waits_for_the_end_of_a_transaction() -> None:
    done: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
            done.append("committed")
        done.append("went on")
    assert done == ["committed"]
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_an_ignored_interrupt_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_sigterm_waits_too() -> None:
    said: list[str] = []
    before = signal.signal(signal.SIGTERM, lambda *_: said.append("ended"))
    try:
        with uninterrupted():
            signal.raise_signal(signal.SIGTERM)
            assert not said
        assert said == ["ended"]
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_process_is_gone_when_it_has_ended() -> None:
    code = "from mrhubo.runtime.processes import this_process; print(this_process(), flush=True); input()"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    named = process.stdout.readline().strip()
    assert not is_gone(named) and not is_gone(this_process()) and named != this_process()
    process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    assert is_gone(named), "a zombie works no more"
    process.communicate()
    assert is_gone(named)


def test_another_with_the_same_number_is_another() -> None:
    machine, number, born = this_process().split()
    assert is_gone(f"{machine} {number} {float(born) - 1000}")
    assert is_gone(f"{platform.node()} {number} {float(born) - 1000}"), "as earlier versions wrote it"


@pytest.mark.parametrize("process", ["elsewhere 1 2.0", "elsewhere/4026 1 2.0", "", "nonsense"])
def test_nobody_knows_of_other_machines(process: str) -> None:
    assert not is_gone(process)
