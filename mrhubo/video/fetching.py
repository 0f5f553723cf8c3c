"""The command that fetches the models, under its two names: `mrhubo models` and `mrhubo live --setup`."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import CommandParser

DESCRIPTION = (
    "Fetches the models that find a human body in the pictures of a camera or a video, once: npm's @mediapipe/pose"
    " (Apache-2.0, 40 MB). docs/camera.md says what they are."
)


def build_parser(name: str) -> CommandParser[None]:
    """The arguments of the command of that name."""
    parser = CommandParser[None](name, DESCRIPTION, None)
    archive = "the package's archive (.tgz), in place of a download; `npm pack @mediapipe/pose@0.5.1675469404` saves it"
    parser.add_argument("--from", metavar="FILE", help=archive)
    folder = "where they go, if MRHUBO_POSE_MODELS then names it too; default: in the user's cache"
    parser.add_argument("--out", metavar="FOLDER", help=folder)
    return parser


def fetch(argv: list[str], name: str) -> None:
    """The command of that name."""
    options = build_parser(name).parse_args(argv)
    from mrhubo.video import set_up

    archive, out = getattr(options, "from"), options.out
    folder = set_up(None if archive is None else Path(archive), None if out is None else Path(out))
    print(f"models: {folder}")
