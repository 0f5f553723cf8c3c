"""How all commands begin and end."""

from __future__ import annotations

import io
import os
import select
import sys
import traceback
from collections.abc import Callable
from typing import NoReturn

from mrhubo.config.faults import machine_fault
from mrhubo.config.interrupts import Terminated, settle_signals, take_signals
from mrhubo.config.notices import show_warnings_plainly
from mrhubo.config.secrets import redacted
from mrhubo.errors import UserError, shortened, was_interrupted

_LONGEST = 4_000
"""Letters of the longest sentence that is printed: some name what a stranger's file holds."""


def run_command(main: Callable[[list[str]], int | None], resumes: bool = True) -> NoReturn:
    """Run a command's `main(arguments)` and leave with its exit status; `resumes`: whether the same command, given
    again, goes on where it was stopped.

    A `UserError` is one line on stderr and status 2, and so is a fault of the machine, such as a full disk. Ctrl-C is
    one line and status 130, SIGTERM one line and 143, a reader that went away (``| head``) silence and status 141.
    Anything else is a bug and shows its traceback.
    """
    _begin()
    show_warnings_plainly()
    status: str | int | None
    try:
        try:
            _stand_somewhere()
            status = main(sys.argv[1:])
        except SystemExit as stop:
            if was_interrupted(stop):
                raise KeyboardInterrupt from stop
            status = stop.code
        _flush()
    except UserError as error:
        status = print_error(str(error))
    except KeyboardInterrupt:
        status = _interrupted(resumes)
    except BrokenPipeError:
        if not _reader_is_gone():
            raise
        _drop_output()
        status = 141
    except Exception as error:
        if was_interrupted(error):
            status = _interrupted(resumes)
        elif (fault := machine_fault(error)) is not None:
            sentence = f"{fault}; put that right and start the same command again{', it goes on' if resumes else ''}"
            status = _end(f"error: {' '.join(sentence.split())}", 2)
        else:
            status = _bug()
    sys.exit(status)


def print_error(sentence: str) -> int:
    """What is wrong, as one line on stderr without what nobody should read; the exit status that it means."""
    return _end(f"error: {shortened(' '.join(sentence.split()), _LONGEST)}", 2)


def _begin() -> None:
    """What has to be so before a command does anything, and before torch is imported."""
    _wait_briefly()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a letter that the terminal does not know is no reason to end
            stream.reconfigure(errors="backslashreplace")
    take_signals()


def _stand_somewhere() -> None:
    """Refuses a current folder that was removed: libraries end the process over it, in words of their own."""
    try:
        os.getcwd()
    except OSError as error:
        raise UserError("the current folder is gone, or may not be read; change to another one") from error


def _wait_briefly() -> None:
    """Lets torch's waiting threads spin for a moment only, unless the user has said how they are to wait.

    As long as libgomp lets them, they take the cores from those that work: on a busy machine 0.6 steps of a training a
    second in place of 13. Not at all (PASSIVE) costs half of the speed on an idle one: 18 in place of 37.
    """
    if "OMP_WAIT_POLICY" in os.environ:
        return
    if sys.platform == "linux":  # torch comes with libgomp there
        os.environ.setdefault("GOMP_SPINCOUNT", "3000")
    else:
        os.environ["OMP_WAIT_POLICY"] = "PASSIVE"


def _interrupted(resumes: bool) -> int:
    settle_signals()
    number = Terminated.number
    word = "interrupted" if number is None else "terminated"
    then = "resumes" if resumes else "begins anew"
    return _end(f"{word}; the same command {then}", 130 if number is None else 128 + number)


def _bug() -> int:
    """The traceback, without what nobody should read; to be called where an error is handled."""
    text = traceback.format_exc()
    if redacted(text) == text:
        raise
    return _end(redacted(text).rstrip("\n"), 1)


def _end(sentence: str, status: int) -> int:
    try:
        _flush()
    except OSError:
        _drop_output()
    print(redacted(sentence), file=sys.stderr, flush=True)
    return status


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # None where the shell closed it
            stream.flush()


def _drop_output() -> None:
    """Point stdout at nothing, else the interpreter complains when it flushes at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _reader_is_gone() -> bool:
    poll = select.poll()
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            poll.register(stream.fileno(), 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))
