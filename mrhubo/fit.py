"""`mrhubo fit nao`: from a robot's URDF to a trained, measured, tracked retargeter."""

from __future__ import annotations

from mrhubo.config import CommandParser, Config, parse_arguments, run_command
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Makes pairs of robot and human poses from a robot's URDF, trains the retargeter on them, measures it on human"
    " motion, and keeps everything in MLflow. Interrupt it at any time: the same command goes on where it stopped."
)


def build_parser() -> CommandParser[Config]:
    """The command's arguments."""
    parser = CommandParser("mrhubo fit", DESCRIPTION, Config)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    from mrhubo.fitting.fit import fit

    result = fit(config, Reporter(options.quiet))
    if result is None:
        return
    print(f"\n{result.table}\n\npackage:   {result.package}\nmodel:     {result.model}")
    print(f"dashboard: {result.dashboard}")


if __name__ == "__main__":
    run_command(main)
