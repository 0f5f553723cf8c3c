"""The arguments of a command: a config, flags, and KEY=VALUE, in any order; every mistake is one sentence."""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Sequence
from typing import Any, Generic, NoReturn, TypeVar

from mrhubo.config.help import WIDTH, help_text
from mrhubo.config.kinds import example, keys_of, requires_anything, walk
from mrhubo.config.loading import load_config
from mrhubo.config.shipped import find_config
from mrhubo.errors import UserError, unknown_name

T = TypeVar("T")

_EMPTY = "expected one argument"
"""What argparse says of a flag without its value."""


class CommandParser(argparse.ArgumentParser, Generic[T]):
    """argparse for commands that a config sets: ``mrhubo fit nao trainer.lr=0.01 --quiet``.

    `parse_args` gives `config` (a path or None), `overrides` (a list of KEY=VALUE) and the flags that `add_argument`
    added; those with a value take it once. ``--help`` prints the config's keys too, whatever else is wrong.
    """

    def __init__(
        self,
        prog: str,
        description: str,
        schema: type[T] | None,
        takes_config: bool = True,
        instead: str | None = None,
        word: tuple[str, str] | None = None,
    ) -> None:
        """Prepares the arguments that all commands have.

        Args:
            prog: the command as it is typed.
            description: what it does, for `--help`.
            schema: the config's dataclass, None for a command of flags alone.
            takes_config: False for a command that has configs of its own.
            instead: a flag with a value that may take the config's place, ``--urdf FILE``.
            word: name and meaning of the one word that stands alone in a command without config, ``FILE``; `parse_args`
                gives it as `word`.
        """
        super().__init__(prog, description=description, add_help=False, allow_abbrev=False, exit_on_error=False)
        self.schema, self.takes_config = schema, takes_config and schema is not None
        self.needs_config = self.takes_config and schema is not None and requires_anything(schema)
        self.instead, self.word = instead, word
        self.register("action", None, _StoreOnce)
        self.register("type", None, nonempty)
        self.add_argument("words", nargs="*", type=str, help=argparse.SUPPRESS)
        if self.takes_config:
            about = "YAML file with the keys below, or the name of a config that ships with mrhubo: nao, paper/nao"
            self.add_argument("--config", metavar="CONFIG", help=about)

    def parse_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:
        """The arguments by name.

        Raises:
            UserError: an argument is wrong, missing, or given twice.
            SystemExit: help was asked for, and is printed.
        """
        argv = list(sys.argv[1:] if args is None else args)
        if "--help" in argv or "-h" in argv:
            print(self.format_help(), end="")
            raise SystemExit(0)
        for argument in argv:
            self._refuse_unknown_flag(argument)
        try:
            options, rest = self.parse_known_intermixed_args(argv, namespace)
        except argparse.ArgumentError as error:
            raise UserError(self._sentence(error)) from None
        words = [*vars(options).pop("words"), *rest, *self._take_overrides(options)]
        vars(options).pop(_StoreOnce.SEEN, None)
        if self.word is not None:
            if len(words) != 1:
                shown = f", found '{words[0]}' and '{words[1]}'" if words else ""
                raise UserError(
                    f"command line: {self.word[0]} is {'one' if words else 'missing'}: {self.word[1]}{shown}"
                )
            options.word, words = words[0], []
        named = getattr(options, "config", None)
        configs = [*([] if named is None else [named]), *(self._config_word(word) for word in words if "=" not in word)]
        if len(configs) > 1:
            raise UserError(f"command line: the config is given twice, '{configs[0]}' and '{configs[1]}'; one is read")
        flag = (self.instead or "").partition(" ")[0]
        given = getattr(options, flag.lstrip("-"), None) is not None if flag else False
        if given and configs:
            raise UserError(
                f"command line: {flag} takes the place of the config, which is '{configs[0]}'; give one of them"
            )
        if self.needs_config and not configs and not given:
            either = f", or {self.instead}" if flag else ""
            raise UserError(
                f"command line: CONFIG is missing, for instance {self.prog} nao{either}; --help lists its keys"
            )
        options.config = find_config(configs[0]) if configs else None
        options.overrides = [word for word in words if "=" in word]
        if self.schema is None and options.overrides:
            raise UserError(f"command line: '{options.overrides[0]}' is not a flag; {self.prog} has no other settings")
        return options

    def error(self, message: str) -> NoReturn:
        """argparse's way out, without leaving the process."""
        raise UserError(self._sentence(argparse.ArgumentError(None, message)))

    def format_usage(self) -> str:
        """The flags, the config, the overrides; what may be left out in brackets."""
        either = "CONFIG | --config CONFIG" + (f" | {self.instead}" if self.instead else "")
        config = argparse.Action([], "config", None, metavar=f"({either})" if self.needs_config else f"[{either}]")
        overrides = argparse.Action([], "overrides", nargs="*", metavar="KEY=VALUE")
        formatter = argparse.HelpFormatter(self.prog, width=WIDTH)
        flags = [
            action for action in self._flags() if action.option_strings[0] != (self.instead or "").partition(" ")[0]
        ]
        shown = [*flags, *([config] if self.takes_config else []), *([overrides] if self.schema else [])]
        shown += [argparse.Action([], "word", None, metavar=self.word[0])] if self.word else []
        formatter.add_usage(None, shown, self._mutually_exclusive_groups)
        return formatter.format_help()

    def format_help(self) -> str:
        """Usage, options, and every key of the config with type, range, default and meaning."""
        rows = {}
        if self.takes_config:
            rows["CONFIG, --config CONFIG"] = str(self._option_string_actions["--config"].help)
        if self.word is not None:
            rows[self.word[0]] = self.word[1]
        for action in self._flags():
            rows[_spelt(action)] = f"{action.help}; required" if action.required else str(action.help)
        rows["-h, --help"] = "print this"
        return help_text(self.schema, self.format_usage(), str(self.description), rows, self.takes_config)

    def _flags(self) -> list[argparse.Action]:
        return [action for action in self._actions if action.option_strings and action.dest != "config"]

    def _refuse_unknown_flag(self, argument: str) -> None:
        name = argument.partition("=")[0]
        if not name.startswith("-") or name in self._option_string_actions or re.fullmatch(r"-[0-9.]+", name):
            return
        if name == "-":
            raise UserError("command line: '-' is no file: standard input and output are not used; name a file")
        key = name.lstrip("-")
        if self.schema is not None and key in keys_of(self.schema):
            raise UserError(f"command line: '{argument}' is a key, not a flag: write {key}=VALUE")
        if name == "--config":
            raise UserError(f"command line: {self.prog} takes no --config: it has its own configs")
        known = [*self._option_string_actions, "--help"]
        raise UserError(f"command line: {unknown_name('flag', name, known)}")

    def _take_overrides(self, options: Any) -> list[str]:
        """The KEY=VALUE of the config behind a flag of several values, which argparse takes for more of these."""
        sections = () if self.schema is None else tuple(key.name for key in walk(self.schema) if "." not in key.name)
        taken: list[str] = []
        for action in self._flags():
            given = getattr(options, action.dest, None)
            if sections and action.nargs == "+" and given:
                own = [word for word in given if re.split("[.=]", word)[0] not in sections or "=" not in word]
                taken += [word for word in given if word not in own]
                if not own:
                    raise UserError(f"command line: {action.option_strings[0]} needs a value: {_spelt(action)}")
                setattr(options, action.dest, own)
        return taken

    def _config_word(self, word: str) -> str:
        """A word without "=", if it can name a config."""
        if self.schema is None:
            raise UserError(f"command line: '{word}' stands alone; a value follows its flag, as --help shows")
        if word in [key.name for key in walk(self.schema)]:
            raise UserError(f"command line: '{word}' is a key: write {word}=VALUE")
        if not self.takes_config or not word:
            sample = example(self.schema)
            raise UserError(f"command line: '{word}' is neither a flag nor KEY=VALUE, for instance {sample}")
        return word

    def _sentence(self, error: argparse.ArgumentError) -> str:
        """argparse's complaint in our words."""
        flags = {"/".join(action.option_strings): action for action in self._actions if action.option_strings}
        message = str(error.message)
        if error.argument_name not in flags:
            missing = [action for name, action in flags.items() if action.required and name in message]
            shown = "; ".join(f"{_spelt(action)} is missing: {action.help}" for action in missing)
            return f"command line: {shown or message}"
        action = flags[error.argument_name]
        if message == _EMPTY:
            message = f"needs a value: {_spelt(action)}"
        elif message.startswith("ignored explicit argument"):
            message = "takes no value"
        message = message.replace("not allowed with argument", "does not go together with")
        return f"command line: {error.argument_name} {message}"


def parse_arguments(parser: CommandParser[T], argv: Sequence[str]) -> tuple[T, argparse.Namespace]:
    """The config that a command line names and changes, and its flags.

    Raises:
        UserError: anything in the command line or the config is wrong.
        SystemExit: help was asked for, and is printed.
    """
    options = parser.parse_args(argv)
    if parser.schema is None:
        raise TypeError("the command has no config")
    return load_config(options.config, options.overrides, parser.schema), options


def nonempty(value: str) -> str:
    """The type of a flag whose value is any text but none."""
    if not value:
        raise argparse.ArgumentTypeError(_EMPTY)
    return value


def whole_number(low: int, high: int) -> Callable[[str], int]:
    """The type of a flag whose value is a whole number in [low, high]."""

    def read(value: str) -> int:
        if not re.fullmatch(r"[-+]?[0-9]{1,18}", nonempty(value)) or not low <= int(value) <= high:
            raise argparse.ArgumentTypeError(f"must be a whole number from {low} to {high}, found '{value}'")
        return int(value)

    return read


def number(low: float) -> Callable[[str], float]:
    """The type of a flag whose value is a number of at least `low`."""

    def read(value: str) -> float:
        try:
            found = float(nonempty(value))
        except ValueError:
            found = math.nan
        if not low <= found < math.inf:
            raise argparse.ArgumentTypeError(f"must be a number of at least {low}, found '{value}'")
        return found

    return read


class _StoreOnce(argparse.Action):
    """Keeps a value; a second one is a mistake."""

    SEEN = "_seen"

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, values: Any, option_string: Any = None) -> None:
        seen = vars(namespace).setdefault(self.SEEN, set())
        if self.dest in seen and option_string is not None:
            raise argparse.ArgumentError(self, "is given twice")
        seen.add(self.dest)
        setattr(namespace, self.dest, values)


def _spelt(action: argparse.Action) -> str:
    """A flag as it is typed: ``--out FILE``."""
    more = " ..." if action.nargs == "+" else ""
    value = "" if action.nargs == 0 else f" {action.metavar or action.dest.upper()}{more}"
    return ", ".join(f"{name}{value}" for name in action.option_strings)
