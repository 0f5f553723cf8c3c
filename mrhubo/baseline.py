"""`mrhubo baseline coman`: the baseline S3LE, trained and measured as a fit is."""

from __future__ import annotations

import shlex

from mrhubo.config import BaselineConfig, CommandParser, parse_arguments, run_command, whole_number
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Trains the baseline, S3LE (Choi et al., ICRA 2021), and measures it on the test clips. Unlike mrhubo it needs"
    " human motion capture. With --trials it searches its settings on the validation clips instead."
)


def build_parser() -> CommandParser[BaselineConfig]:
    """The command's arguments."""
    parser = CommandParser("mrhubo baseline", DESCRIPTION, BaselineConfig)
    trials = "trials of a sweep of its settings, on the validation clips; finished ones are not redone"
    parser.add_argument("--trials", metavar="NUMBER", type=whole_number(1, 10_000), help=trials)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    from mrhubo.baselines.s3le.experiment import run_baseline
    from mrhubo.baselines.s3le.search import search_settings

    report = Reporter(options.quiet)
    if options.trials is None:
        print(run_baseline(config, report))
        return
    result = search_settings(config, report, options.trials)
    print(f"\n{result.table}\n\nbest:      python -m mrhubo.baseline --config {shlex.quote(str(result.best))}")
    print(f"dashboard: {result.dashboard}")


if __name__ == "__main__":
    run_command(main)
