"""`mrhubo prior --config conf/prior.yaml`: trains the open body prior."""

from __future__ import annotations

from mrhubo.config import CommandParser, PriorConfig, parse_arguments, run_command
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

DESCRIPTION = "Trains the open body prior."


def build_parser() -> CommandParser[PriorConfig]:
    """The command's arguments."""
    parser = CommandParser("mrhubo prior", DESCRIPTION, PriorConfig)
    parser.add_argument("--quiet", action="store_true", help="no progress line")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    if not config.data.is_file():
        raise UserError(f"data: {config.data} does not exist; name a file of training poses (docs/prior.md says which)")
    from mrhubo.body.prior_training.train import train
    from mrhubo.runtime.folders import make_folders

    make_folders({"output": [config.output.parent], "tracking_dir": [config.tracking_dir / "fits"]})
    train(config, Reporter(options.quiet))
    print(f"body prior: {config.output}")


if __name__ == "__main__":
    run_command(main)
