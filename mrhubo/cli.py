"""`mrhubo VERB ...`: every command under one name; `python -m mrhubo` is the same."""

from __future__ import annotations

import importlib
import sys
from typing import NamedTuple, NoReturn

from mrhubo.config import run_command
from mrhubo.errors import UserError, unknown_name


class Verb(NamedTuple):
    """A command: the module whose `main(argv)` it is, what it does, and whether it goes on where it was stopped."""

    module: str
    meaning: str
    resumes: bool = False


VERBS = {
    "describe": Verb("mrhubo.describe", "find out from a robot's URDF which link stands for what, and draw it"),
    "fit": Verb("mrhubo.fit", "make pairs for a robot, train a retargeter on them, measure and package it", True),
    "pair": Verb("mrhubo.pair", "make, check or show the pairs alone", True),
    "retarget": Verb("mrhubo.retarget", "make a robot's joint angles of files of human motion"),
    "live": Verb("mrhubo.live.__main__", "let a robot follow a person who is seen now"),
    "show": Verb("mrhubo.show", "look at a motion and what robots make of it, in the browser or as a film"),
    "evaluate": Verb("mrhubo.evaluate", "measure a trained retargeter on human motion"),
    "export": Verb("mrhubo.export", "write a retargeter's networks as ONNX, or as a file that needs NumPy alone"),
    "sweep": Verb("mrhubo.sweep", "search for the best settings of a fit", True),
    "baseline": Verb("mrhubo.baseline", "train and measure the baseline S3LE", True),
    "reproduce": Verb("mrhubo.reproduce", "the paper's tables, its figures beside ours", True),
    "universal": Verb("mrhubo.universal.__main__", "train the network that is the same for every robot", True),
    "models": Verb("mrhubo.models", "fetch the models that find a human body in videos, once"),
    "prior": Verb("mrhubo.prior", "train a body prior on motion capture of your own", True),
}


def main() -> NoReturn:
    """What the `mrhubo` script runs."""
    verb = VERBS.get(sys.argv[1]) if len(sys.argv) > 1 else None
    run_command(dispatch, resumes=verb is not None and verb.resumes)


def dispatch(argv: list[str]) -> int | None:
    """Runs the verb that comes first with the arguments that follow it; returns the exit status.

    Raises:
        UserError: there is no such verb, or whatever is wrong with its arguments.
    """
    first = argv[0] if argv else ""
    if first in ("", "-h", "--help"):
        print(_help(), end="")
        return 0 if first else 2
    if first == "--version":
        import mrhubo

        print(f"mrhubo {mrhubo.__version__}")
        return 0
    if first not in VERBS:
        kind, known = ("flag", ["--help", "--version"]) if first.startswith("-") else ("command", list(VERBS))
        raise UserError(f"command line: {unknown_name(kind, first, known)}")
    return importlib.import_module(VERBS[first].module).main(argv[1:])


def _help() -> str:
    width = max(map(len, VERBS))
    verbs = "".join(f"  {name:<{width}}  {verb.meaning}\n" for name, verb in VERBS.items())
    return (
        "usage: mrhubo COMMAND ...\n\n"
        "Human-to-humanoid motion retargeting that learns from robot poses.\n\n"
        f"commands:\n{verbs}\n"
        "mrhubo COMMAND --help shows its flags, and every key of its config with default, range and meaning.\n"
        "mrhubo --version tells the version.\n"
    )
