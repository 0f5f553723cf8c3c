"""How all commands end."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable
from typing import NoReturn

from mrhubo.errors import UserError, shortened, was_interrupted

_LONGEST = 4_000
"""Letters of the longest sentence that is printed: some name what a stranger's file holds."""
_INTERRUPTED = "interrupted; the same command resumes"


def run_command(main: Callable[[list[str]], int | None]) -> NoReturn:
    """Run a command's `main(arguments)` and leave with its exit status.

    A `UserError` is one line on stderr and status 2, Ctrl-C one line and status 130, a reader that went
    away (``| head``) silence and status 141. Anything else is a bug and shows its traceback.
    """
    status: str | int | None
    try:
        try:
            status = main(sys.argv[1:])
        except SystemExit as stop:
            if was_interrupted(stop):
                raise KeyboardInterrupt from stop
            status = stop.code
        _flush()
    except UserError as error:
        status = _end(f"error: {shortened(' '.join(str(error).split()), _LONGEST)}", 2)
    except KeyboardInterrupt:
        status = _end(_INTERRUPTED, 130)
    except BrokenPipeError:
        if not _reader_is_gone():
            raise
        _drop_output()
        status = 141
    except Exception as error:
        if not was_interrupted(error):
            raise
        status = _end(_INTERRUPTED, 130)
    sys.exit(status)


def _end(sentence: str, status: int) -> int:
    try:
        _flush()
    except BrokenPipeError:
        _drop_output()
    print(sentence, file=sys.stderr, flush=True)
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
