"""`mrhubo evaluate nao --retargeter FOLDER`: how good a trained retargeter is, or the optimiser of a whole body."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import CommandParser, Config, number, parse_arguments, run_command, whole_number
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Measures a trained retargeter on human motion: against the reference retargeter (joints, links), against the"
    " human (directions of limbs, hands, head, jerk), and in time. The motions, and what is a key link, are those of"
    " the config; the robot is the retargeter's own and must be the config's. Or measures files of robot motion in"
    " the same way, whoever made them. Or measures the optimiser's whole bodies."
)


def build_parser() -> CommandParser[Config]:
    """The command's arguments."""
    parser = CommandParser("mrhubo evaluate", DESCRIPTION, Config)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--retargeter", metavar="FOLDER", help="the package that a fit ended with")
    predictions = (
        "robot motions of any retargeter, as docs/formats.md has them: each with the names of its joints, its frame"
        " rate, and the name of the motion that it answers, in the file or as the file's"
    )
    what.add_argument("--predictions", metavar="FILE", nargs="+", help=predictions)
    optimiser = (
        "the optimiser, of a robot with feet: limbs, feet on the floor, the way gone, speeds; as whole motions and as"
        " streams (docs/whole-body.md)"
    )
    what.add_argument("--optimiser", action="store_true", help=optimiser)
    order = "names the joints of predictions that do not: a URDF, a MuJoCo model, or a name a line"
    parser.add_argument("--joint-order", metavar="FILE", help=order)
    rate = "frames per second of predictions that do not tell"
    parser.add_argument("--rate", metavar="HERTZ", type=number(0), help=rate)
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
    from mrhubo.fitting.predictions import measure_predictions
    from mrhubo.fitting.preparation import prepare

    report = Reporter(options.quiet)
    if options.predictions is None and (options.joint_order or options.rate):
        raise UserError("command line: --joint-order and --rate are for --predictions")
    if options.optimiser:
        from mrhubo.fitting.whole_body import measure_optimiser

        if options.polish is not None:
            raise UserError("command line: --polish is for a package")
        print(measure_optimiser(config, report, options.validation))
        return
    if options.predictions is None:
        package = Path(options.retargeter)
        print(measure_package(prepare(config), report, package, options.validation, options.polish))
        return
    if options.polish is not None or options.validation:
        raise UserError("command line: --polish and --validation are for a package; predictions stay as they are")
    prepared = prepare(config, split=False)
    files, names = [Path(name) for name in options.predictions], ()
    if options.joint_order is not None:
        from mrhubo.robot_motion import read_joint_order

        names = read_joint_order(Path(options.joint_order)).names
    print(measure_predictions(prepared, report, files, names, options.rate))


if __name__ == "__main__":
    run_command(main, resumes=False)
