"""`mrhubo evaluate nao --retargeter FOLDER`: how good a trained retargeter is."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import CommandParser, Config, parse_arguments, run_command, whole_number
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Measures a trained retargeter on human motion: against the reference retargeter (joints, links), against the"
    " human (directions of limbs, hands, head, jerk), and in time. The motions, and what is a key link, are those of"
    " the config; the robot is the retargeter's own and must be the config's."
)


def build_parser() -> CommandParser[Config]:
    """The command's arguments."""
    parser = CommandParser("mrhubo evaluate", DESCRIPTION, Config)
    package = "the package that a fit ended with"
    parser.add_argument("--retargeter", metavar="FOLDER", required=True, help=package)
    polish = (
        "so many steps of optimisation after the networks, each frame on its own (default: the networks alone, then"
        " every way of answering: frame by frame, whole clips, stream; and the same motions re-shared)"
    )
    parser.add_argument("--polish", metavar="NUMBER", type=whole_number(0, 1_000), help=polish)
    clips = "the validation clips, for choosing between retargeters; else the test clips"
    parser.add_argument("--validation", action="store_true", help=clips)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    from mrhubo.fitting.measurement import measure_package
    from mrhubo.fitting.preparation import prepare

    report, package = Reporter(options.quiet), Path(options.retargeter)
    print(measure_package(prepare(config), report, package, options.validation, options.polish))


if __name__ == "__main__":
    run_command(main)
