"""The flags of commands that answer by a package, or for a robot without one."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

from mrhubo.config.arguments import CommandParser
from mrhubo.errors import UserError


def add_who_flags(parser: CommandParser[Any]) -> None:
    """`--retargeter` or `--robot`; one of them must be given."""
    who = parser.add_mutually_exclusive_group(required=True)
    package = "the package that a fit ended with, or a version in the registry: models:/mrhubo-nao/1"
    who.add_argument("--retargeter", metavar="FOLDER", help=package)
    robot = "a robot without a package: its YAML file, the name of one that ships with mrhubo, or its URDF alone"
    who.add_argument("--robot", metavar="ROBOT", help=robot)


def add_whole_body_flag(parser: CommandParser[Any]) -> None:
    """`--whole-body`, of which `check_whole_body` tells where it does not belong."""
    whole = "with the URDF of --robot: its legs, feet and waist move too, and not its arms and head alone"
    parser.add_argument("--whole-body", action="store_true", help=whole)


def check_whole_body(options: Namespace) -> None:
    """Refuses `--whole-body` of a package.

    Raises:
        UserError: both are given.
    """
    if options.whole_body and options.retargeter is not None:
        raise UserError("command line: --whole-body goes with --robot alone; a package answers what it was trained for")
