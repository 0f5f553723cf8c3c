"""`mrhubo describe my.urdf`: a robot's config from its URDF, and a picture of the robot beside the human."""

from __future__ import annotations

import shlex
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from mrhubo.config import CommandParser, find_config, is_config, load_config, print_error, run_command
from mrhubo.errors import InputWarning, UserError

if TYPE_CHECKING:
    from mrhubo.describing.run import Described

DESCRIPTION = (
    "Finds out from a robot's model which of its links and joints stand for which part of a human body, by geometry"
    " first and by names last, and writes a config that says how sure every entry is, with a picture beside it: the"
    " robot and the human in five poses. Of a config, hand-written or not, it draws the picture alone."
)


_OPEN = 3
"""What the command returns where all is written, and guesses are left which a fit refuses until they are answered."""


def build_parser() -> CommandParser[None]:
    """The command's arguments."""
    file = (
        "the robot: a URDF file, a MuJoCo model (MJCF), or the name of a robot of the package robot_descriptions; or a"
        " config, a YAML file or the name of one that ships with mrhubo"
    )
    parser = CommandParser[None]("mrhubo describe", DESCRIPTION, None, word=("FILE", file))
    out = "config to write (default: conf/NAME.yaml), and its picture beside it; of a config, the picture to write"
    parser.add_argument("--out", metavar="OUT", help=out)
    tree = "print the joints as a tree, with axes, positions and limits, and nothing else; works for any URDF"
    parser.add_argument("--tree", action="store_true", help=tree)
    whole = "legs, feet and waist too, and not arms, hands and head alone (docs/whole-body.md)"
    parser.add_argument("--whole-body", action="store_true", help=whole)
    parser.add_argument("--force", action="store_true", help="replace files that are there already")
    return parser


def main(argv: list[str]) -> int:
    """The command; 2 where a config was written, or drawn, that cannot be right, 3 where it leaves open what must be
    answered before a fit.
    """
    options = build_parser().parse_args(argv)
    word, out = options.word, None if options.out is None else Path(options.out)
    kinds = (".png",) if is_config(word) else (".yaml", ".yml")
    if out is not None and out.suffix not in kinds:
        what = "the picture of a config" if is_config(word) else "a config"
        raise UserError(f"command line: --out: {what} is a {kinds[0]} file, '{out}' is none")
    if options.tree:
        return _show_tree(word)
    if is_config(word):
        if options.whole_body:
            raise UserError("command line: --whole-body: a config says itself what of a body it has")
        return _draw_config(word, out, options.force)
    from mrhubo.describing.run import describe_model
    from mrhubo.describing.yaml_file import next_command
    from mrhubo.robot.unsure import needed_answers

    described = describe_model(word, out, options.force, options.whole_body)
    open_ = needed_answers(described.doubts)
    status = tell(described) or _OPEN * bool(open_)
    answer = ", answer what is not decided" if open_ else ""
    print(f"next:     look at the picture{answer}, then  {next_command(described.found, described.file)}")
    if described.more:
        parts = "the waist moves" if described.more == ("waist",) else f"{' and '.join(described.more)} move"
        print(f"          {parts} too with  mrhubo describe {shlex.quote(word)} --whole-body")
    return status


def tell(described: Described) -> int:
    """Prints what was found and draws it; 2 where a fit would refuse it."""
    from mrhubo.describing.report import report

    print(report(described.found, described.file))
    for note in described.notes:
        print(f"note: {note}")
    print(f"\nconfig:   {described.file}\npicture:  {described.picture}")
    return _draw(described.file, described.picture)


def _show_tree(word: str) -> int:
    from mrhubo.describing.run import read_model
    from mrhubo.describing.tree_text import tree_text

    model = str(load_config(find_config(word)).robot.urdf) if is_config(word) else word
    print(tree_text(read_model(model), model))
    return 0


def _draw_config(word: str, out: Path | None, force: bool) -> int:
    from mrhubo.describing.run import refuse_foreign

    file = find_config(word)
    beside = file.with_suffix(".png") if str(file) == word else Path(f"{file.stem}.png")
    picture = out or beside
    if not force:
        refuse_foreign(picture)
    print(f"picture:  {picture}")
    status = _draw(file, picture)
    from mrhubo.robot.unsure import needed_answers

    if status == 0 and (open_ := needed_answers(load_config(file).robot.unsure)):
        print(f"open:     {', '.join(open_)}: answer these before a fit, and take their names out of `unsure`")
        return _OPEN
    return status


def _draw(file: Path, picture: Path) -> int:
    """Draws a config, and says what a fit would refuse or doubt about it."""
    from mrhubo.describing.run import draw_config

    fault = draw_config(file, picture)
    if fault is not None:
        return print_error(fault)
    _try(file)
    return 0


def _try(file: Path) -> None:
    """Tries a config on a motion, as a fit does first."""
    from mrhubo.fitting.first_look import look_at
    from mrhubo.robot import build_body_map

    with warnings.catch_warnings(action="ignore"):  # told when it was drawn
        body_map = build_body_map(load_config(file).robot)
    look = look_at(body_map)
    print(look)
    for doubt in look.doubts:
        warnings.warn(doubt, InputWarning, stacklevel=2)


if __name__ == "__main__":
    run_command(main, resumes=False)
