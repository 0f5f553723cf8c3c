"""`mrhubo fit nao`: from a robot's URDF to a trained, measured, tracked retargeter."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import CommandParser, Config, load_config, run_command
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Makes pairs of robot and human poses from a robot's URDF, trains the retargeter on them, measures it on human"
    " motion, and keeps everything in MLflow. Interrupt it at any time: the same command goes on where it stopped."
)


def build_parser() -> CommandParser[Config]:
    """The command's arguments."""
    parser = CommandParser("mrhubo fit", DESCRIPTION, Config, instead="--urdf FILE")
    urdf = (
        "a robot without a config: its URDF, or what else mrhubo describe takes; its config is written to"
        " conf/NAME.yaml first, or taken from there"
    )
    parser.add_argument("--urdf", metavar="FILE", help=urdf)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    options = build_parser().parse_args(argv)
    config = load_config(options.config or _described(options.urdf), options.overrides)
    from mrhubo.fitting.fit import fit

    result = fit(config, Reporter(options.quiet))
    if result is None:
        return
    print(f"\n{result.table}\n\npackage:   {result.package}\nmodel:     {result.model}")
    print(f"dashboard: {result.dashboard}")


def _described(model: str) -> Path:
    """The config of a robot's model."""
    from mrhubo.describe import tell
    from mrhubo.describing.run import config_of

    file, described = config_of(model)
    if described is None:
        print(f"config:   {file}, which is there already")
    else:
        tell(described)
    return file


if __name__ == "__main__":
    run_command(main)
