"""`mrhubo show --motion FILE --robot ROBOT`: a person and robots side by side, in the browser or as a file."""

from __future__ import annotations

import webbrowser
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from mrhubo.config import CommandParser, run_command, whole_number
from mrhubo.errors import UserError, encodable, listed
from mrhubo.files.regular import refuse_input
from mrhubo.lazy import import_optional
from mrhubo.retarget import (
    METHOD_MEANING,
    METHODS,
    add_motion_flags,
    check_method,
    choose_answerer,
    read_request,
)

if TYPE_CHECKING:
    from mrhubo.motion import Motion
    from mrhubo.robot import Robot
    from mrhubo.viewer import Performance, Stage

DESCRIPTION = (
    "Shows a human motion and what robots make of it side by side in the browser: figures that can be looked at from"
    " all sides, a timeline, how sure each answer is, and joint angles against their limits. With --save it writes a"
    " page that needs no server, a film or a picture instead, without a display."
)
_NONE = "none"
_ENDINGS = {
    ".html": "a page that plays in any browser", ".mp4": "a film", ".gif": "a film", ".png": "a sheet of six moments"
}  # fmt: skip
_PORT = 8080


def build_parser() -> CommandParser[None]:
    """The command's arguments."""
    parser = CommandParser[None]("mrhubo show", DESCRIPTION, None)
    parser.add_argument("--motion", metavar="FILE", help="human motion, as for mrhubo retarget")
    package = "packages that fits ended with, or versions in the registry"
    parser.add_argument("--retargeter", metavar="FOLDER", nargs="+", default=[], help=package)
    robot = "robots without a package: YAML files, names of those that ship with mrhubo, or URDFs"
    parser.add_argument("--robot", metavar="ROBOT", nargs="+", default=[], help=robot)
    method = f"with --robot: {METHOD_MEANING}; several stand side by side; `{_NONE}`: robots are for --robot-motion"
    parser.add_argument("--method", metavar="METHOD", nargs="+", help=method)
    given = "files of robot motion, anybody's; each is shown on the first of the robots that has its joints"
    parser.add_argument("--robot-motion", metavar="FILE", nargs="+", default=[], help=given)
    order = "names the joints of --robot-motion files that do not: a URDF, a MuJoCo model, or a name a line"
    parser.add_argument("--joint-order", metavar="FILE", help=order)
    add_motion_flags(parser)
    size = "robots are as large as they are, and not as tall as the human"
    parser.add_argument("--true-size", action="store_true", help=size)
    endings = "; ".join(f"{ending}: {meaning}" for ending, meaning in _ENDINGS.items())
    parser.add_argument("--save", metavar="FILE", help=f"writes a file and opens no page; {endings}")
    port = f"of the page on 127.0.0.1, or the next that is free; default: {_PORT}"
    parser.add_argument("--port", metavar="PORT", type=whole_number(1, 65_535), default=_PORT, help=port)
    parser.add_argument("--open", action="store_true", help="opens the page in the browser, too")
    return parser


def main(argv: list[str]) -> int:
    """The command."""
    options = build_parser().parse_args(argv)
    out = _check(options)
    stage, title = _stage(options)
    if out is not None:
        _save(stage, out, title)
        return 0
    from mrhubo.viewer.live import serve

    def ready(address: str) -> None:
        print(f"{address}  (Ctrl-C ends it)", flush=True)
        if options.open:
            webbrowser.open(address)

    serve(stage, options.port, ready)
    return 0


def _check(options: Namespace) -> Path | None:
    """Refuses what cannot be shown before anything takes time; the file to write, if one is asked for."""
    if not options.motion and not options.robot_motion:
        raise UserError("command line: --motion FILE is missing, or --robot-motion FILE, which can be shown alone")
    if options.robot_motion and not (options.robot or options.retargeter):
        raise UserError("command line: --robot-motion needs --robot ROBOT, whose links it moves")
    for method in options.method or []:
        check_method(method, (*METHODS, _NONE), not options.robot)
    if options.save is None:
        needed = "viser"
    else:
        out = Path(options.save)
        if out.suffix.lower() not in _ENDINGS:
            raise UserError(f"--save {out}: the name must end in {', '.join(_ENDINGS)}")
        if out.is_dir():
            raise UserError(f"--save {out}: is a folder; name a file in it")
        refuse_input("--save", out, (options.motion, *options.robot_motion))
        needed = {".html": "viser", ".mp4": "av"}.get(out.suffix.lower())
    if needed is not None:
        what = "a page in the browser" if needed == "viser" else "an .mp4 file"
        import_optional(needed, f"{what} needs the package {needed}: pip install 'mrhubo[view]'")
    return None if options.save is None else Path(options.save)


def _stage(options: Namespace) -> tuple[Stage, str]:
    """Who is to be seen, and what the page or file is called."""
    from mrhubo.motion import read_motion
    from mrhubo.viewer import arrange, read_person

    motion = None
    if options.motion:
        file, request = Path(options.motion), read_request(options)
        motion = request.prepare(read_motion(file, request.options))
        print(f"{file}: {motion.source}; {len(motion)} frames at {motion.frame_rate:g} per second")
        for note in motion.notes:
            print(f"  {note}")
    robots, performances = _answers(options, motion)
    performances += _given(options, robots, motion)
    person = None if motion is None else read_person(motion)
    title = (motion.description or motion.name) if motion is not None else performances[0].motion.name
    return arrange(person, performances), encodable(title).rstrip(".") or "mrhubo"


def _answers(options: Namespace, motion: Motion | None) -> tuple[list[Robot], list[Performance]]:
    """All robots that are named, and what they make of the motion."""
    import mrhubo
    from mrhubo.describing.run import open_robot
    from mrhubo.retargeter import read_package_robot
    from mrhubo.retargeting import of_package
    from mrhubo.viewer import perform

    robots, found = [], []
    for package in options.retargeter:
        folder = mrhubo.package_folder(package)
        answerer = of_package(folder, options.avoid_collisions)
        robots.append(read_package_robot(folder))
        if motion is not None:
            print(answerer.described)
            label = f"{robots[-1].name}: {folder.resolve().name}"
            found.append(perform(label, robots[-1], answerer.answer(motion), true_size=options.true_size))
    for name in options.robot:
        robot = open_robot(name, options.whole_body)
        robots.append(robot)
        for method in options.method or [None]:
            if motion is None or method == _NONE:
                continue
            answerer = choose_answerer(robot, method, options.avoid_collisions)
            print(answerer.described)
            label = robot.name if method is None else f"{robot.name}: {method}"
            found.append(perform(label, robot, answerer.answer(motion), true_size=options.true_size))
    return robots, found


def _given(options: Namespace, robots: list[Robot], motion: Motion | None) -> list[Performance]:
    """The robot motions that are there already."""
    from mrhubo.robot_motion import read_joint_order, read_robot_motion, trim_robot_motion
    from mrhubo.viewer import perform

    names = () if options.joint_order is None else read_joint_order(Path(options.joint_order)).names
    rate, request, found = options.rate or (None if motion is None else motion.frame_rate), read_request(options), []
    for file in map(Path, options.robot_motion):
        answer = read_robot_motion(file, names, rate)
        if request.start or request.end is not None:
            answer = trim_robot_motion(answer, request.start, request.end, rate)
        robot = next((r for r in robots if set(answer.joint_names) <= set(r.description.joints)), None)
        if robot is None:
            lacking = set(answer.joint_names) - set(robots[0].description.joints)
            raise UserError(
                f"{file}: no robot that is given has all of its joints; {robots[0].name} lacks {listed(lacking)}"
            )
        print(f"{file}: {len(answer)} frames of {robot.name}")
        found.append(perform(f"{robot.name}: {file.name}", robot, answer, rate, options.true_size))
    return found


def _save(stage: Stage, out: Path, title: str) -> None:
    if out.suffix.lower() == ".html":
        from mrhubo.viewer.page import save_page

        save_page(stage, out, title)
        what = f"{stage.frames} frames"
    else:
        from mrhubo.viewer.pictures import save_pictures

        what = f"{save_pictures(stage, out, title)} pictures"
    print(f"written: {out}, {what}, {out.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    run_command(main, resumes=False)
