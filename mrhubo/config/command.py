"""What all ``python -m mrhubo.X`` commands share: their arguments, and how they end."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from mrhubo.config.help import help_text
from mrhubo.config.kinds import example, requires_anything, walk
from mrhubo.config.loading import load_config
from mrhubo.config.schema import Config
from mrhubo.errors import UserError, unknown_name, was_interrupted

T = TypeVar("T")


def parse_arguments(
    argv: Sequence[str],
    prog: str,
    description: str,
    schema: type[T] = Config,
    flags: Mapping[str, str] | None = None,
) -> tuple[T, dict[str, Any]]:
    """``--config FILE``, ``--help``, the given flags and ``key.sub=value`` -> (config, {flag: given?})."""
    files, overrides, given = split_arguments(argv, prog, description, schema, flags)
    if not files and requires_anything(schema):
        raise UserError(f"command line: --config FILE is missing; {prog} --help lists the keys of that file")
    return load_config(Path(files[0]) if files else None, overrides, schema), given


def split_arguments(
    argv: Sequence[str], prog: str, description: str, schema: type, flags: Mapping[str, str] | None = None
) -> tuple[list[str], list[str], dict[str, Any]]:
    """The file of ``--config`` if it is given, the overrides, and {flag: given?}, for a command that loads by itself.

    `flags` maps a name (``quiet`` for ``--quiet``) to its meaning. One with a word for its value (``out FILE`` for
    ``--out FILE``) gives that value, or None if it is not given. ``--help`` prints `help_text` and exits with 0.
    """
    meanings = {name.lstrip("-"): text for name, text in (flags or {}).items()}
    if "--help" in argv or "-h" in argv:
        print(help_text(schema, prog, description, meanings), end="")
        raise SystemExit(0)
    with_value = {name.split()[0]: name.split()[1] for name in meanings if " " in name}
    given: dict[str, Any] = {name.split()[0]: None if " " in name else False for name in meanings}
    files: list[str] = []
    overrides: list[str] = []
    rest = iter(argv)
    for argument in rest:
        name, equals, value = argument.partition("=")
        if name == "--config":
            file = value if equals else next(rest, "")
            if not file or file.startswith("-"):
                raise UserError("command line: --config needs a file name")
            files.append(file)
        elif name[2:] in with_value and name.startswith("--"):
            text = value if equals else next(rest, "")
            if not text or text.startswith("-"):
                raise UserError(f"command line: {name} needs a value: {name} {with_value[name[2:]]}")
            if given[name[2:]] is not None:
                raise UserError(f"command line: {name} is given twice")
            given[name[2:]] = text
        elif argument.startswith("--") and argument[2:] in given:
            given[argument[2:]] = True
        elif argument.startswith("-"):
            raise UserError(_unknown_flag(argument, schema, list(given)))
        elif equals:
            overrides.append(argument)
        else:
            raise UserError(_stray(argument, schema))
    if len(files) > 1:
        raise UserError(f"command line: --config is given {len(files)} times; one file is read")
    return files, overrides, given


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
        status = _end(f"error: {' '.join(str(error).split())}", 2)
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


def _unknown_flag(argument: str, schema: type, flags: list[str]) -> str:
    name, equals, _ = argument.partition("=")
    if equals and name[2:] in flags:
        return f"command line: flag '{argument}' takes no value"
    if any(key.name == name.lstrip("-") for key in walk(schema)):
        return f"command line: '{argument}' is a key, not a flag: write {name.lstrip('-')}=VALUE"
    return "command line: " + unknown_name("flag", name, ["--config", "--help", *(f"--{flag}" for flag in flags)])


def _stray(argument: str, schema: type) -> str:
    if argument.endswith((".yaml", ".yml")):
        return f"command line: '{argument}' stands alone: write --config {argument}"
    return f"command line: '{argument}' is neither a flag nor KEY=VALUE, for instance {example(schema)}"
