"""`mrhubo retarget --retargeter FOLDER --motion FILE --out FILE`: human motion files to a robot's joint angles."""

from __future__ import annotations

from argparse import BooleanOptionalAction, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mrhubo.config import CommandParser, number, print_error, run_command
from mrhubo.config.answering import add_who_flags, add_whole_body_flag, check_whole_body
from mrhubo.errors import UserError, unknown_name
from mrhubo.robot_motion import FORMATS, read_joint_order
from mrhubo.runtime.progress import Reporter

if TYPE_CHECKING:
    from mrhubo.retargeting import Answerer, Request
    from mrhubo.robot import Robot

DESCRIPTION = (
    "Retargets files of human motion to a robot and writes its joint angles. What is in a file, and not its ending,"
    " says how it is read. With a package its networks and some steps of optimisation answer; with a robot alone, and"
    " without any training, the network that is the same for every robot. docs/formats.md specifies all formats."
)

METHODS = ("universal", "reference")
"""The default, and that for robots that stand on feet."""
METHOD_MEANING = (
    "`universal`, the network for every robot (default), or `reference`, the optimiser alone, which tells too where a"
    " robot with feet goes (default for those)"
)


def build_parser() -> CommandParser[None]:
    """The command's arguments."""
    parser = CommandParser[None]("mrhubo retarget", DESCRIPTION, None)
    add_who_flags(parser)
    parser.add_argument("--method", metavar="METHOD", help=f"with --robot: {METHOD_MEANING}")
    what = parser.add_mutually_exclusive_group(required=True)
    motion = "motion files and videos, and folders of motion files"
    what.add_argument("--motion", metavar="FILE", nargs="+", help=motion)
    what.add_argument("--video", metavar="FILE", nargs="+", help="the same as --motion")
    out = "file to write; a folder with several motions, and where it ends in / or has no ending"
    parser.add_argument("--out", metavar="FILE", required=True, help=out)
    formats = "; ".join(f"{name}: {row.meaning}" for name, row in FORMATS.items())
    parser.add_argument("--format", metavar="FORMAT", help=f"default: by the ending of --out, else npz; {formats}")
    order = "joints in the order of this file: a MuJoCo model, a URDF, or a text with a name a line"
    parser.add_argument("--joint-order", metavar="FILE", help=order)
    add_motion_flags(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def add_motion_flags(parser: CommandParser[None]) -> None:
    """The flags that say how human motion is read and answered: `read_request` and `choose_answerer` take them."""
    parser.add_argument("--from", metavar="SECONDS", type=number(0), help="begin there; default: at the beginning")
    parser.add_argument("--to", metavar="SECONDS", type=number(0), help="end there; default: at the end")
    parser.add_argument("--rate", metavar="HERTZ", type=number(0), help="frames per second of files that do not tell")
    out_rate = "frames per second of the robot's motion; default: those of the human's"
    parser.add_argument("--out-rate", metavar="HERTZ", type=number(0), help=out_rate)
    parser.add_argument("--mirror", action="store_true", help="exchange left and right of the human")
    person = "which of several people in a file, by the name or number that it has for them; default: seen longest"
    parser.add_argument("--person", metavar="PERSON", help=person)
    animation = "which of several animations of an FBX or glTF file, by its name; default: the longest"
    parser.add_argument("--animation", metavar="NAME", help=animation)
    bvh_map = "YAML file that says which joint of a BVH, FBX or glTF file is which"
    parser.add_argument("--bvh-map", metavar="FILE", help=bvh_map)
    model = "which model finds the body in a video: lite, full (default) or heavy"
    parser.add_argument("--pose-model", metavar="MODEL", default="full", help=model)
    add_whole_body_flag(parser)
    avoid = "whether frames in which the robot would touch itself give way, by its URDF's collision shapes"
    parser.add_argument("--avoid-collisions", action=BooleanOptionalAction, default=True, help=avoid)


def main(argv: list[str]) -> int:
    """The command; 2 where some of the motions could not be retargeted."""
    options = build_parser().parse_args(argv)
    from mrhubo.retargeting import find_files, of_package, plan_places, retarget_files, table

    if options.method is not None:
        check_method(options.method, METHODS, options.retargeter is not None)
    check_whole_body(options)
    files = find_files([Path(name) for name in options.motion or options.video])
    others = (options.robot, options.retargeter, options.joint_order, options.bvh_map)
    places = plan_places(options.out, options.format, files, others)
    request = read_request(options, options.joint_order)
    if options.retargeter is not None:
        answerer = of_package(options.retargeter, options.avoid_collisions)
    else:
        from mrhubo.describing.run import open_robot

        robot = open_robot(options.robot, options.whole_body)
        answerer = choose_answerer(robot, options.method, options.avoid_collisions)
    print(answerer.described)
    outcome = retarget_files(files, answerer, places, request, Reporter(options.quiet or len(files) == 1))
    if outcome.summaries:
        print(f"\n{table(outcome.summaries, is_told=options.retargeter is None)}")
    if not outcome.failures:
        return 0
    sentences = list(outcome.failures.values())
    if len(files) == 1:
        raise UserError(sentences[0])
    for sentence in sentences:
        print_error(sentence)
    names = ", ".join(map(str, outcome.failures))
    return print_error(f"{len(sentences)} of {len(files)} motions could not be retargeted: {names}")


def check_method(method: str, known: Sequence[str], of_package: bool) -> None:
    """Refuses a method that is not among the known ones, or one beside a package."""
    if method not in known:
        raise UserError(f"command line: --method: {unknown_name('method', method, known)}")
    if of_package:
        raise UserError("command line: --method goes with --robot alone; a package answers by the networks it has")


def read_request(options: Namespace, joint_order: str | None = None) -> Request:
    """What `add_motion_flags` ask of every motion."""
    from mrhubo.motion import ReadOptions
    from mrhubo.retargeting import Request

    bvh_map = None if options.bvh_map is None else Path(options.bvh_map)
    return Request(
        options=ReadOptions(options.rate, options.person, bvh_map, options.pose_model, options.animation),
        start=getattr(options, "from") or 0.0,
        end=options.to,
        rate=options.out_rate,
        mirrored=options.mirror,
        joint_order=None if joint_order is None else read_joint_order(Path(joint_order)),
    )


def choose_answerer(robot: Robot, method: str | None, avoid_collisions: bool) -> Answerer:
    """Who answers for a robot without a package."""
    from mrhubo.retargeting import of_reference, of_universal

    stands = robot.keypoints is not None and bool(robot.keypoints.standing)
    of_robot = {"universal": of_universal, "reference": of_reference}[method or METHODS[stands]]
    return of_robot(robot, avoid_collisions)


if __name__ == "__main__":
    run_command(main, resumes=False)
