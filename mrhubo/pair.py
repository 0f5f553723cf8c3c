"""`python -m mrhubo.pair --config conf/nao.yaml`: makes, checks or shows the pairs of robot and human poses."""

from __future__ import annotations

from mrhubo.config import parse_arguments, run_command
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

DESCRIPTION = (
    "Makes pairs of robot and human poses from a robot's URDF, and nothing else; a fit with the same settings finds"
    " them. Interrupt it at any time: the same command goes on where it stopped. Started by torchrun or SLURM, all"
    " processes share the work (docs/scaling.md)."
)
FLAGS = {
    "verify": "make nothing; read every file again: checksum, shapes, finite numbers, joint limits, kinematics",
    "inspect": "make nothing; print a summary of the pairs that are there and draw pairs.png beside them",
    "quiet": "no progress lines",
}


def main(argv: list[str]) -> None:
    """The command."""
    config, flags = parse_arguments(argv, "mrhubo.pair", DESCRIPTION, flags=FLAGS)
    if flags["verify"] and flags["inspect"]:
        raise UserError("command line: --verify and --inspect are two commands; give one of them")
    from mrhubo.fitting.pairs import inspect_pairs, make_pairs, summarise_pairs, verify_pairs
    from mrhubo.fitting.preparation import prepare_pairs
    from mrhubo.runtime.ranks import Ranks

    report, setup = Reporter(flags["quiet"]), prepare_pairs(config)
    if flags["verify"]:
        print(verify_pairs(setup, report))
    elif flags["inspect"]:
        print(inspect_pairs(setup))
    else:
        ranks = Ranks.join(config.trainer.accelerator)
        made = make_pairs(setup, report if ranks.rank == 0 else Reporter.silent(), ranks)
        if ranks.rank == 0:
            print(f"{summarise_pairs(setup).table()}\n\n{made}\npairs: {setup.store.folder}")


if __name__ == "__main__":
    run_command(main)
