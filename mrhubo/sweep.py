"""`python -m mrhubo.sweep --config conf/nao.yaml --sweep conf/sweeps/network.yaml`: the best settings for a robot."""

from __future__ import annotations

import os
from functools import partial

from mrhubo.config import Config, SweepConfig, load_config, run_command, split_arguments
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Searches for the best settings of a fit: many trainings with settings drawn from the space of the sweep's YAML,"
    " measured on the validation clips, the bad ones stopped early. Start it several times, on one machine or many, and"
    " all processes work on the same study; start it again to go on where it stopped, or with more trials."
    " key.sub=value changes a setting of all trials."
)
FLAGS = {
    "sweep FILE": "YAML file of the sweep, see conf/sweeps",
    "trials NUMBER": "trials in place of the file's `trials`",
    "minutes NUMBER": "time limit in place of the file's `minutes`",
    "quiet": "no progress line",
}


def main(argv: list[str]) -> None:
    """The command."""
    files, overrides, given = split_arguments(argv, "mrhubo.sweep", DESCRIPTION, Config, FLAGS)
    if not files or given["sweep"] is None:
        raise UserError(
            "command line: mrhubo.sweep needs --config FILE, a robot's config, and --sweep FILE, for instance"
            " --config conf/nao.yaml --sweep conf/sweeps/network.yaml"
        )
    changes = [f"{name}={given[name]}" for name in ("trials", "minutes") if given[name] is not None]
    settings = load_config(given["sweep"], changes, SweepConfig)
    # Several processes on one machine is what a sweep is for, and waiting threads that spin take the cores from the
    # others: ten times slower with two processes on two cores. Read when torch is imported, below.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    load_config(files[0], overrides)  # a mistake there is told before the seconds that the imports below take
    from mrhubo.fitting.sweeping import Sweep
    from mrhubo.fitting.trials import FitTrials

    load, report = partial(load_config, files[0]), Reporter(given["quiet"])
    try:
        sweep = Sweep(load, overrides, settings, FitTrials(), report)
    except UserError as error:
        where = f"{given['sweep']}: " if str(error).startswith(("space", "storage")) else ""
        raise UserError(f"{where}{error}") from error
    result = sweep.run()
    print(f"\n{result.table}\n\nbest:      python -m mrhubo.fit --config {result.best}")
    print(f"dashboard: {result.dashboard}")


if __name__ == "__main__":
    run_command(main)
