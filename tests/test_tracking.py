"""What keeps a run's database whole."""

from __future__ import annotations

import signal

import pytest

from mrhubo.tracking import uninterrupted


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
    finally:
        signal.signal(signal.SIGINT, before)
