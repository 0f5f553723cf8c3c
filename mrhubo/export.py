"""`mrhubo export --retargeter FOLDER --to onnx --out nao.onnx`: networks for programs without mrhubo."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import CommandParser, run_command
from mrhubo.config.answering import add_who_flags, add_whole_body_flag, check_whole_body
from mrhubo.files.regular import refuse_input

DESCRIPTION = (
    "Writes the networks of a package as one ONNX file, or as a Python file that needs NumPy alone with its weights"
    " beside it, and compares their answers with mrhubo's own. For a robot without a package, and without any training,"
    " it writes the network that is the same for every robot. docs/export.md says what is in them."
)


def build_parser() -> CommandParser[None]:
    """The command's arguments."""
    parser = CommandParser[None]("mrhubo export", DESCRIPTION, None)
    add_who_flags(parser)
    add_whole_body_flag(parser)
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

    check_whole_body(options)
    out = Path(options.out)
    refuse_input("--out", out, [options.robot, options.retargeter])
    if options.retargeter is not None:
        retargeter = mrhubo.load(options.retargeter)
    else:
        retargeter = mrhubo.for_robot(options.robot, options.whole_body)
    off = write_onnx(retargeter, out, options.input) if options.to == "onnx" else write_numpy(retargeter, out)
    beside = f" and {out.with_suffix('.npz')}" if options.to == "numpy" else ""
    print(f"{out}{beside}: {len(retargeter.joint_names)} joints of '{retargeter.body_map.robot.name}'")
    print(f"its answers are at most {off:.1e} rad from mrhubo's")


if __name__ == "__main__":
    run_command(main, resumes=False)
