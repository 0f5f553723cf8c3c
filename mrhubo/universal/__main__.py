"""`mrhubo universal --config conf/universal.yaml`: trains the universal network."""

from __future__ import annotations

from mrhubo.config import CommandParser, UniversalConfig, parse_arguments, run_command
from mrhubo.runtime.progress import Reporter

DESCRIPTION = "Trains the universal network on random chains of joints."


def build_parser() -> CommandParser[UniversalConfig]:
    """The command's arguments."""
    parser = CommandParser("mrhubo universal", DESCRIPTION, UniversalConfig)
    parser.add_argument("--quiet", action="store_true", help="no progress line")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    from mrhubo.runtime.folders import make_folders
    from mrhubo.universal.learning.training import train

    folders = [config.tracking_dir / "fits", config.tracking_dir / "universal_problems"]
    make_folders({"output": [config.output.parent], "tracking_dir": folders})
    train(config, Reporter(options.quiet))
    print(f"universal network: {config.output}")


if __name__ == "__main__":
    run_command(main)
