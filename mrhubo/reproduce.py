"""`mrhubo reproduce`: the paper's tables, the paper's figures beside ours."""

from __future__ import annotations

from mrhubo.config import BaselineConfig, CommandParser, nonempty, run_command, whole_number
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Trains everything that the paper's tables compare, on the shipped robots, and prints them with the paper's figures"
    " beside ours. Every training is a tracked fit under one parent run; what is finished is not done again."
    " key.sub=value changes a setting of every training."
)


def build_parser() -> CommandParser[BaselineConfig]:
    """The command's arguments."""
    parser = CommandParser("mrhubo reproduce", DESCRIPTION, BaselineConfig, takes_config=False)
    robots = "comma-separated: nao,coman,reachy (default: all)"
    parser.add_argument("--robots", metavar="NAMES", type=_names, default=["nao", "coman", "reachy"], help=robots)
    methods = "comma-separated: proposed,without filter,one stage,our default,S3LE (default: all)"
    parser.add_argument("--methods", metavar="NAMES", type=_names, help=methods)
    seeds = "trainings of each kind, seeds 0, 1, ... (default: 3)"
    parser.add_argument("--seeds", metavar="NUMBER", type=whole_number(1, 100), default=3, help=seeds)
    paper = "the paper's settings to the letter, conf/paper, in place of ours"
    parser.add_argument("--paper", action="store_true", help=paper)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    options = build_parser().parse_args(argv)
    for override in options.overrides:
        if override.startswith(("trainer.seed", "s3le.seed")):
            raise UserError("command line: the seeds are set by --seeds")
    from mrhubo.paper.trainings import reproduce

    report = Reporter(options.quiet)
    print(reproduce(options.robots, options.seeds, options.overrides, report, options.paper, options.methods))


def _names(value: str) -> list[str]:
    return list(dict.fromkeys(name.strip() for name in nonempty(value).split(",")))


if __name__ == "__main__":
    run_command(main)
