"""`python -m mrhubo.body.prior_training --config conf/prior.yaml`: trains the open body prior."""

from __future__ import annotations

from mrhubo.body.prior_training.train import PriorConfig, train
from mrhubo.config import parse_arguments, run_command
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter


def main(argv: list[str]) -> None:
    """`python -m mrhubo.body.prior_training --config conf/prior.yaml [key=value ...]`."""
    flags = {"quiet": "no progress line"}
    config, given = parse_arguments(
        argv, "mrhubo.body.prior_training", "Trains the open body prior.", PriorConfig, flags
    )
    if not config.data.is_file():
        raise UserError(f"data: {config.data} does not exist; name a file of training poses (docs/prior.md says which)")
    train(config, Reporter(given["quiet"]))
    print(f"body prior: {config.output}")


if __name__ == "__main__":
    run_command(main)
