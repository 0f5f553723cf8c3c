"""`mrhubo export --retargeter FOLDER --to onnx --out nao.onnx`: networks for programs without mrhubo."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import CommandParser, run_command
from mrhubo.errors import UserError

DESCRIPTION = (
    "Writes the networks of a package as one ONNX file, or as a Python file that needs NumPy alone with its weights"
    " beside it, and compares their answers with mrhubo's own. For a robot without a package, and without any training,"
    " it writes the network that is the same for every robot. docs/export.md says what is in them."
)


def build_parser() -> CommandParser[None]:
    """The command's arguments."""
    parser = CommandParser[None]("mrhubo export", DESCRIPTION, None)
    package = "the package that a fit ended with, or a version in the registry: models:/mrhubo-nao/1"
    who = parser.add_mutually_exclusive_group(required=True)
    who.add_argument("--retargeter", metavar="FOLDER", help=package)
    robot = "a robot without a package: its YAML file, the name of one that ships with mrhubo, or its URDF alone"
    who.add_argument("--robot", metavar="ROBOT", help=robot)
    whole = "with the URDF of --robot: its legs, feet and waist too, and not its arms and head alone"
    parser.add_argument("--whole-body", action="store_true", help=whole)
    parser.add_argument("--to", choices=("onnx", "numpy"), required=True, help="what to write")
    out = "file to write: NAME.onnx, or NAME.py, beside which NAME.npz will lie"
    parser.add_argument("--out", metavar="FILE", required=True, help=out)
    inputs = "what an ONNX file takes; a NumPy file takes both (default: %(default)s)"
    parser.add_argument("--input", choices=("poses", "directions"), default="poses", help=inputs)
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    options = build_parser().parse_args(argv)
    import mrhubo
    from mrhubo.exporting import write_numpy, write_onnx

    if options.whole_body and options.robot is None:
        raise UserError("command line: --whole-body goes with --robot alone; a package answers what it was trained for")
    out = Path(options.out)
    if options.robot is None:
        retargeter = mrhubo.load(options.retargeter)
    else:
        from mrhubo.describing.run import open_robot

        retargeter = mrhubo.for_robot(open_robot(options.robot, options.whole_body))
    off = write_onnx(retargeter, out, options.input) if options.to == "onnx" else write_numpy(retargeter, out)
    beside = f" and {out.with_suffix('.npz')}" if options.to == "numpy" else ""
    print(f"{out}{beside}: {len(retargeter.joint_names)} joints of '{retargeter.body_map.robot.name}'")
    print(f"its answers are at most {off:.1e} rad from mrhubo's")


if __name__ == "__main__":
    run_command(main)
