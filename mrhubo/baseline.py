"""`python -m mrhubo.baseline --config conf/coman.yaml`: the baseline S3LE, trained and measured as a fit is."""

from __future__ import annotations

from mrhubo.config import BaselineConfig, parse_arguments, run_command
from mrhubo.errors import UserError

DESCRIPTION = (
    "Trains the baseline, S3LE (Choi et al., ICRA 2021), and measures it on the test clips. Unlike mrhubo it needs"
    " human motion capture. With --trials it searches its settings on the validation clips instead."
)
FLAGS = {
    "trials NUMBER": "random settings to try on the validation clips; finished ones are not redone",
    "quiet": "no progress lines",
}


def main(argv: list[str]) -> None:
    """The command."""
    from mrhubo.baselines.s3le.experiment import run_baseline, search

    config, flags = parse_arguments(argv, "mrhubo.baseline", DESCRIPTION, BaselineConfig, FLAGS)
    if flags["trials"] is None:
        print(run_baseline(config, flags["quiet"]))
        return
    if not flags["trials"].isdigit() or not 1 <= int(flags["trials"]) <= 10_000:
        raise UserError(f"command line: --trials must be 1 .. 10000, found '{flags['trials']}'")
    print(search(config, int(flags["trials"]), flags["quiet"]))


if __name__ == "__main__":
    run_command(main)
