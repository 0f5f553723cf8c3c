"""Signals that ask a command to end, and are not lost in a library.

Libraries import others that may be missing, and many catch whatever goes wrong then, interrupts too: trimesh in a
hundred places, torch and networkx in dozens. And what LLVM calls while numba compiles has no caller in Python that an
interrupt could reach. A signal that comes in such a moment comes again, until the command ends.
"""

from __future__ import annotations

import _thread
import contextlib
import signal
import sys
import threading
import time
from types import FrameType

from mrhubo.errors import was_interrupted

_OUTSIDE = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)
)  # a scheduler, a shutdown, a terminal that was closed
_IMPORTING = "<frozen importlib._bootstrap>"
_CALLED_BY_LLVM = "_raw_object_cache_notify", "_raw_object_cache_getbuffer"
"""llvmlite's functions: ctypes prints what they raise, and goes on."""
_AGAIN_S = 0.05
"""After so long [s] a signal that came where it may be lost comes again."""


class Terminated(KeyboardInterrupt):
    """The process was asked to end: everything ends as after Ctrl-C."""

    number: int | None = None
    """Of the signal; None as long as none came. Libraries make errors of their own of an interrupt in their midst."""


def take_signals() -> None:
    """From now on Ctrl-C raises KeyboardInterrupt, and other signals that end a process `Terminated`, unless whoever
    started us wants something else (nohup). To be called by the function that runs a command, in its thread.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
    for number in _OUTSIDE:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _terminate)


def settle_signals() -> None:
    """The command is ending: no signal comes again."""
    _again.clear()


def _interrupt(number: int, frame: FrameType | None) -> None:
    if not _is_answered(number, frame):
        raise KeyboardInterrupt


def _terminate(number: int, frame: FrameType | None) -> None:
    """Ends as after Ctrl-C, so that runs are closed and locks let go; a second signal ends at once."""
    if not _is_answered(number, frame):
        if number not in _again:
            signal.signal(number, signal.SIG_DFL)
        Terminated.number = number
        raise Terminated


_again: set[int] = set()
"""Signals that come again until the command ends."""
_repeated: set[int] = set()
"""Those of them that have just come again."""


def _is_answered(number: int, frame: FrameType | None) -> bool:
    """Whether a signal is one that came before, and whose interrupt is still on its way out. One that interrupts an
    import, or what LLVM has called, comes again after a moment, as it may be lost there.
    """
    is_repeated = number in _repeated
    _repeated.discard(number)
    if is_repeated and (number not in _again or was_interrupted(sys.exc_info()[1])):
        if number in _again:
            _come_again(number)
        return True
    _again.discard(number)
    if _may_be_lost(frame):
        _again.add(number)
        _come_again(number)
    return False


def _come_again(number: int) -> None:
    main = threading.main_thread().ident

    def wait() -> None:
        time.sleep(_AGAIN_S)
        if number in _again and main is not None:
            _repeated.add(number)
            if hasattr(signal, "pthread_kill"):
                signal.pthread_kill(main, number)  # which lets a call return in which that thread waits
            else:  # Windows
                _thread.interrupt_main(signal.Signals(number))

    with contextlib.suppress(RuntimeError):  # no thread is to be had: the process is ending
        threading.Thread(target=wait, daemon=True).start()


def _may_be_lost(frame: FrameType | None) -> bool:
    """Whether a command is in the midst of an import, or of what LLVM has called, at this frame or above it."""
    while frame is not None and frame.f_code.co_name != "run_command":
        if frame.f_code.co_filename == _IMPORTING or frame.f_code.co_name in _CALLED_BY_LLVM:
            return True
        frame = frame.f_back
    return False
