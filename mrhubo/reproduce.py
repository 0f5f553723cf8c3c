"""`python -m mrhubo.reproduce`: the paper's tables, the paper's figures beside ours."""

from __future__ import annotations

from mrhubo.config import BaselineConfig, run_command, split_arguments
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Trains everything that the paper's tables compare, on the shipped robots, and prints them with the paper's figures"
    " beside ours. Every training is a tracked fit under one parent run; what is finished is not done again."
    " key.sub=value changes a setting of every training."
)
FLAGS = {
    "robots NAMES": "comma-separated: nao,coman,reachy (default: all)",
    "methods NAMES": "comma-separated: proposed,without filter,one stage,our default,S3LE (default: all)",
    "seeds NUMBER": "trainings of each kind, seeds 0, 1, ... (default: 3)",
    "paper": "the paper's settings to the letter, conf/paper, in place of ours",
    "quiet": "no progress lines",
}


def main(argv: list[str]) -> None:
    """The command."""
    files, overrides, given = split_arguments(argv, "mrhubo.reproduce", DESCRIPTION, BaselineConfig, FLAGS)
    if files:
        raise UserError("command line: mrhubo.reproduce has its own configs; choose among them with --robots")
    for override in overrides:
        if override.startswith(("trainer.seed", "s3le.seed")):
            raise UserError("command line: the seeds are set by --seeds")
    try:
        seeds = int(given["seeds"] or 3)
    except ValueError:
        seeds = 0
    if not 1 <= seeds <= 100:
        raise UserError(f"command line: --seeds must be 1 .. 100, found '{given['seeds']}'")
    robots = _names(given["robots"] or "nao,coman,reachy")
    methods = None if given["methods"] is None else _names(given["methods"])
    from mrhubo.paper.trainings import reproduce

    print(reproduce(robots, seeds, overrides, Reporter(given["quiet"]), given["paper"], methods))


def _names(text: str) -> list[str]:
    return list(dict.fromkeys(name.strip() for name in text.split(",")))


if __name__ == "__main__":
    run_command(main)
