"""`mrhubo sweep nao --sweep network`: the best settings for a robot."""

from __future__ import annotations

import shlex
from functools import partial

from mrhubo.config import (
    CommandParser,
    Config,
    SweepConfig,
    find_config,
    load_config,
    number,
    places_named,
    run_command,
    whole_number,
)
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Searches for the best settings of a fit: many trainings with settings drawn from the space of the sweep's YAML,"
    " measured on the validation clips, the bad ones stopped early. Start it several times, on one machine or many, and"
    " all processes work on the same study; start it again to go on where it stopped, or with more trials."
    " key.sub=value changes a setting of all trials."
)


def build_parser() -> CommandParser[Config]:
    """The command's arguments."""
    parser = CommandParser("mrhubo sweep", DESCRIPTION, Config)
    sweep = "YAML file of the sweep, or the name of one that ships with mrhubo: filter, network, scale_factor"
    parser.add_argument("--sweep", metavar="SWEEP", required=True, help=sweep)
    trials, minutes = "trials in place of the file's `trials`", "time limit in place of the file's `minutes`"
    parser.add_argument("--trials", metavar="NUMBER", type=whole_number(1, 1_000_000), help=trials)
    parser.add_argument("--minutes", metavar="NUMBER", type=number(0.0), help=minutes)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    options = build_parser().parse_args(argv)
    given = {"trials": options.trials, "minutes": options.minutes}
    changes = [f"{name}={value}" for name, value in given.items() if value is not None]
    settings = load_config(find_config(options.sweep, "sweeps"), changes, SweepConfig)
    load_config(options.config, options.overrides)  # a mistake there is told before the slow imports below
    from mrhubo.fitting.sweeping import Sweep
    from mrhubo.fitting.trials import FitTrials
    from mrhubo.search import check_fixed

    load, report = partial(load_config, options.config), Reporter(options.quiet)
    with places_named(settings):
        check_fixed(settings.fixed, lambda text: load([*options.overrides, text]))
        sweep = Sweep(load, options.overrides, settings, FitTrials(), report)
    result = sweep.run()
    print(f"\n{result.table}\n\nbest:      python -m mrhubo.fit --config {shlex.quote(str(result.best))}")
    print(f"dashboard: {result.dashboard}")


if __name__ == "__main__":
    run_command(main)
