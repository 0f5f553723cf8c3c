"""`mrhubo baseline coman`: the baseline S3LE, trained and measured as a fit is."""

from __future__ import annotations

from mrhubo.config import BaselineConfig, CommandParser, parse_arguments, run_command, whole_number

DESCRIPTION = (
    "Trains the baseline, S3LE (Choi et al., ICRA 2021), and measures it on the test clips. Unlike mrhubo it needs"
    " human motion capture. With --trials it searches its settings on the validation clips instead."
)


def build_parser() -> CommandParser[BaselineConfig]:
    """The command's arguments."""
    parser = CommandParser("mrhubo baseline", DESCRIPTION, BaselineConfig)
    trials = "random settings to try on the validation clips; finished ones are not redone"
    parser.add_argument("--trials", metavar="NUMBER", type=whole_number(1, 10_000), help=trials)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    from mrhubo.baselines.s3le.experiment import run_baseline, search

    if options.trials is None:
        print(run_baseline(config, options.quiet))
    else:
        print(search(config, options.trials, options.quiet))


if __name__ == "__main__":
    run_command(main)
