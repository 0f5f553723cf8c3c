"""`mrhubo pair nao`: makes, checks or shows the pairs of robot and human poses."""

from __future__ import annotations

from mrhubo.config import CommandParser, Config, parse_arguments, run_command
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Makes pairs of robot and human poses from a robot's URDF, and nothing else; a fit with the same settings finds"
    " them. Interrupt it at any time: the same command goes on where it stopped. Started by torchrun or SLURM, all"
    " processes share the work (docs/scaling.md)."
)


def build_parser() -> CommandParser[Config]:
    """The command's arguments."""
    parser = CommandParser("mrhubo pair", DESCRIPTION, Config)
    instead = parser.add_mutually_exclusive_group()
    verify = "make nothing; read every file again: checksum, shapes, finite numbers, joint limits, kinematics"
    instead.add_argument("--verify", action="store_true", help=verify)
    inspect = "make nothing; print a summary of the pairs that are there and draw pairs.png beside them"
    instead.add_argument("--inspect", action="store_true", help=inspect)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    from mrhubo.fitting.pairs import inspect_pairs, make_pairs, summarise_pairs, verify_pairs
    from mrhubo.fitting.preparation import prepare_pairs
    from mrhubo.runtime.ranks import Ranks

    report, setup = Reporter(options.quiet), prepare_pairs(config)
    if options.verify:
        print(verify_pairs(setup, report))
    elif options.inspect:
        print(inspect_pairs(setup))
    else:
        ranks = Ranks.join(config.trainer.accelerator)
        made = make_pairs(setup, report if ranks.rank == 0 else Reporter.silent(), ranks)
        if ranks.rank == 0:
            print(f"{summarise_pairs(setup).table()}\n\n{made}\npairs: {setup.store.folder}")


if __name__ == "__main__":
    run_command(main)
