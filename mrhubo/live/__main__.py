"""`mrhubo live --robot nao --source replay:dance.bvh --sink ws`: a robot follows a person who is seen now."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrhubo.config import CommandParser, parse_arguments, run_command
from mrhubo.config.answering import add_who_flags, add_whole_body_flag, check_whole_body
from mrhubo.config.arguments import number
from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.video import fetching

if TYPE_CHECKING:
    from mrhubo.fast import FastRetargeter

SETUP = "--setup"
_SETTING_UP = f"mrhubo live {SETUP}"
DESCRIPTION = (
    "A robot follows a person who is seen now: frames come in, joint angles go out at a fixed rate, inside limits of"
    " position, speed and acceleration, and of a robot with legs where its base is. It moves only while somebody holds"
    " the button, or as long as a stream without one goes on. Ctrl-C stops the robot softly and ends. docs/live.md"
    " specifies all of it."
)


class _LiveParser(CommandParser[LiveConfig]):
    """With `--setup`, the arguments are those of the command that fetches models."""

    def parse_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:
        """As `CommandParser.parse_args`."""
        words = _after_setup(list(args or ()))
        if words is None:
            return super().parse_args(args, namespace)
        return fetching.build_parser(_SETTING_UP).parse_args(words)


def _after_setup(argv: list[str]) -> list[str] | None:
    """The arguments beside `--setup`; None: it is not there, or help is asked for."""
    if SETUP not in argv or "--help" in argv or "-h" in argv:
        return None
    return [word for word in argv if word != SETUP]


def build_parser() -> CommandParser[LiveConfig]:
    """The command's arguments."""
    from mrhubo.live.kinds import SINKS, SOURCES

    parser = _LiveParser("mrhubo live", DESCRIPTION, LiveConfig, takes_config=False)
    add_who_flags(parser)
    add_whole_body_flag(parser)
    source = f"where frames come from, may be given several times; {'; '.join(SOURCES.values())}"
    parser.add_argument("--source", metavar="SOURCE", action="append", required=True, help=source)
    sink = f"where joint angles go, may be given several times; {'; '.join(SINKS.values())}"
    parser.add_argument("--sink", metavar="SINK", action="append", required=True, help=sink)
    host = (
        "where to listen (default: 127.0.0.1, for this machine alone); elsewhere senders need a token, the one that is"
        " printed, or that of the environment variable MRHUBO_LIVE_TOKEN"
    )
    parser.add_argument("--host", metavar="HOST", default="127.0.0.1", help=host)
    https = (
        "the page by https, which browsers want before they give a camera to a page of another machine, as to a phone's"
    )
    parser.add_argument("--https", action="store_true", help=https)
    own = "with --https: your own certificate, a PEM file of it and its key; default: one that is made for this machine"
    parser.add_argument("--certificate", metavar="FILE", help=own)
    parser.add_argument("--seconds", metavar="SECONDS", type=number(0), help="end after so long; default: never")
    form = "compiled (default where numba is installed; the first start ever takes a minute) or numpy"
    parser.add_argument("--form", choices=("compiled", "numpy"), help=form)
    setup = "fetch the models that find a body in a camera's pictures, once, and end; the same as mrhubo models"
    parser.add_argument(SETUP, action="store_true", help=f"{setup}, whose flags it takes")
    return parser


def main(argv: list[str]) -> int:
    """The command; 128 and the signal's number where a signal other than Ctrl-C ended it."""
    words = _after_setup(argv)
    if words is not None:
        fetching.fetch(words, _SETTING_UP)
        return 0
    config, options = parse_arguments(build_parser(), argv)
    from mrhubo.config.interrupts import Terminated
    from mrhubo.fast.kept import FRAMES, STANDING, is_kept, note_kept, numba_is_there
    from mrhubo.live import LiveRobot
    from mrhubo.live.governor import brake_steps
    from mrhubo.live.loop import Session, run_session
    from mrhubo.live.plan import Plan

    certificate = None
    if options.certificate is not None and not options.https:
        raise UserError("--certificate goes with --https")
    check_whole_body(options)
    brake_steps(config)
    if options.https:
        from mrhubo.live.certificate import open_certificate

        certificate = open_certificate(options.certificate and Path(options.certificate), options.host)
    plan = Plan(options.host, certificate)
    for text in options.source:
        plan.add_source(text)
    for text in options.sink:
        plan.add_sink(text)
    plan.refuse_inputs([options.robot, options.retargeter, options.certificate])
    if certificate is not None and not plan.has_page:
        raise UserError("--https: there is no page to serve; add --source ws or --sink ws")
    plan.check()

    compiled: list[Callable[[], None]] = []

    def known(fast: FastRetargeter, urdf: Path | None) -> None:
        plan.check_robot(fast.joint_names, urdf)
        what = fast.description.universal is not None, FRAMES if fast.description.legs is None else STANDING
        if options.form != "numpy" and numba_is_there() and not is_kept(*what):
            print("the first session on a machine compiles, which takes a minute", flush=True)
            compiled.append(lambda: note_kept(fast.engine.kept_in, *what))

    if options.retargeter is None:
        robot = LiveRobot.of_robot(options.robot, config, options.form, options.whole_body, known)
    else:
        robot = LiveRobot.of_package(options.retargeter, config, options.form, known)
    for note in compiled:
        note()
    print(f"robot '{robot.facts.name}', {len(robot.joint_names)} joints; {config.rate:g} joint angles a second")

    def started() -> None:
        for sentence in plan.told():
            print(sentence, flush=True)
        print("Ctrl-C stops the robot and ends", flush=True)

    session = Session.of(robot, plan.sources, plan.sinks, config)
    status = 0
    try:
        run_session(session, options.seconds, started)
    except KeyboardInterrupt:
        status = 0 if Terminated.number is None else 128 + Terminated.number
    print(session.summary())
    return status


if __name__ == "__main__":
    run_command(main, resumes=False)
