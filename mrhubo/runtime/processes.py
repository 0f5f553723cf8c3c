"""Processes that end at a bad moment: what they must not break, and how others see that they are gone."""

from __future__ import annotations

import os
import platform
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import psutil

_ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Holds Ctrl-C, SIGTERM and SIGHUP back until the block has ended.

    A transaction of SQLite that is broken off keeps its lock as long as the traceback lives, and whoever then wants to
    mark the run as killed waits for minutes.
    """
    if threading.current_thread() is not threading.main_thread():  # only the main thread is interrupted
        yield
        return
    held: list[int] = []
    before = {number: signal.getsignal(number) for number in _ENDING}
    caught = [number for number, handler in before.items() if handler not in (None, signal.SIG_IGN)]
    for number in caught:
        signal.signal(number, lambda number, frame: held.append(number))
    try:
        yield
    finally:
        for number in caught:
            signal.signal(number, before[number])
        if held:
            signal.raise_signal(held[0])


def this_process() -> str:
    """This process, so that another one on the same machine can see whether it lives."""
    return f"{_machine()} {os.getpid()} {psutil.Process().create_time()}"


def is_gone(process: str) -> bool:
    """Whether a process that `this_process` named has ended; False for one on another machine, as nobody knows."""
    machine, _, rest = process.partition(" ")
    number, _, born = rest.partition(" ")
    if machine not in (_machine(), platform.node()):
        return False
    try:
        found = psutil.Process(int(number))
        return found.create_time() != float(born) or found.status() == psutil.STATUS_ZOMBIE
    except (psutil.NoSuchProcess, ValueError):
        return True


def _machine() -> str:
    """The host, and on Linux the space of process numbers: containers of one name have each their own."""
    try:
        space = os.readlink("/proc/self/ns/pid").strip("pid:[]")
    except OSError:
        return platform.node()
    return f"{platform.node()}/{space}"
