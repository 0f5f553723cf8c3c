"""`mrhubo models`: fetches the models that find a body in a camera's pictures; `mrhubo live --setup` is the same."""

from __future__ import annotations

from mrhubo.config import CommandParser, run_command
from mrhubo.video import fetching

_NAME = "mrhubo models"


def build_parser() -> CommandParser[None]:
    """The command's arguments."""
    return fetching.build_parser(_NAME)


def main(argv: list[str]) -> None:
    """The command."""
    fetching.fetch(argv, _NAME)


if __name__ == "__main__":
    run_command(main, resumes=False)
