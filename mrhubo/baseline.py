"""`python -m mrhubo.baseline --config conf/coman.yaml`: the baseline S3LE, trained and measured as a fit is."""

from __future__ import annotations

from mrhubo.config import BaselineConfig, parse_arguments, run_command
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Trains the baseline, S3LE (Choi et al., ICRA 2021), and measures it on the test clips. Unlike mrhubo it needs"
    " human motion capture. With --trials it searches its settings on the validation clips instead."
)
FLAGS = {
    "trials NUMBER": "trials of a sweep of its settings, on the validation clips; finished ones are not redone",
    "quiet": "no progress lines",
}


def main(argv: list[str]) -> None:
    """The command."""
    config, flags = parse_arguments(argv, "mrhubo.baseline", DESCRIPTION, BaselineConfig, FLAGS)
    trials, report = flags["trials"], Reporter(flags["quiet"])
    if trials is not None and (not trials.isdigit() or not 1 <= int(trials) <= 10_000):
        raise UserError(f"command line: --trials must be 1 .. 10000, found '{trials}'")
    from mrhubo.baselines.s3le.experiment import run_baseline
    from mrhubo.baselines.s3le.search import search_settings

    if trials is None:
        print(run_baseline(config, report))
        return
    result = search_settings(config, report, int(trials))
    print(f"\n{result.table}\n\nbest:      python -m mrhubo.baseline --config {result.best}")
    print(f"dashboard: {result.dashboard}")


if __name__ == "__main__":
    run_command(main)
