"""`mrhubo pair nao`: makes, checks or shows the pairs of robot and human poses."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import CommandParser, Config, parse_arguments, run_command
from mrhubo.errors import UserError

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


def pair(config: Config, quiet: bool = False) -> str:
    """Makes the pairs that are missing; returns the text that sums them up ('' on all ranks but the first).

    Raises:
        UserError: anything in the config or the files it names is wrong (before any work), or the disk is full.
        KeyboardInterrupt: the user stopped it; the same call resumes.
    """
    from mrhubo.fitting import pipeline
    from mrhubo.pairing.verify import summarise
    from mrhubo.runtime.ranks import Ranks

    setup = pipeline.prepare_pairs(config)
    ranks = Ranks.join(config.trainer.accelerator)
    report = pipeline.make_pairs(setup, quiet or ranks.rank > 0, ranks)
    if ranks.rank > 0:
        return ""
    summary = summarise(setup.store, config.pairs.filter, config.pairs.filter_k)
    made = f"made {report.made:,} pairs in {report.seconds:,.1f} s" if report.made else "made nothing: all were there"
    return f"{summary.table()}\n\n{made}\npairs: {setup.store.folder}"


def check(config: Config, quiet: bool = False) -> str:
    """Reads every shard again; returns what there is to say if all are well.

    Raises:
        UserError: shards are missing or damaged; it names the first.
    """
    from mrhubo.fitting import pipeline
    from mrhubo.pairing.verify import verify
    from mrhubo.runtime.progress import Progress

    setup = pipeline.prepare_pairs(config)
    store = setup.store
    if not store.folder.is_dir():
        raise UserError(_nothing_there(store.folder))
    with Progress("verify", store.shards, "shards", quiet) as progress:
        problems = verify(store, setup.body_map.robot, lambda done, bad: progress.update(done, f"{bad} bad"))
    if problems:
        more = f" (and {len(problems) - 1:,} more shards of {store.shards:,})" if len(problems) > 1 else ""
        raise UserError(f"{problems[0]}{more}; run the same command without --verify to make them again")
    return f"all {store.shards:,} shards are whole: {store.folder}"


def inspect(config: Config) -> str:
    """Sums up the pairs that are there and draws `pairs.png` into their folder; returns text and path.

    Raises:
        UserError: there are no such pairs, or not all of them.
    """
    from mrhubo.files.storage import DamagedFile
    from mrhubo.fitting import pipeline
    from mrhubo.pairing.verify import summarise
    from mrhubo.view import save_png
    from mrhubo.view.pictures import Artist

    setup = pipeline.prepare_pairs(config)
    store = setup.store
    try:
        summary = summarise(store, config.pairs.filter, config.pairs.filter_k)
        shown = store.read(0)
    except DamagedFile as error:
        raise UserError(f"{error}; run the same command without --inspect to make what is missing") from error
    artist = Artist(setup.body_map.robot, setup.body_map.skeleton)
    path = save_png(artist.pair_sheet(shown, summary.measures), store.folder / "pairs.png")
    return f"{summary.table()}\n\npairs:   {store.folder}\npicture: {path}"


def _nothing_there(folder: Path) -> str:
    return f"{folder}: there are no pairs of these settings; run the same command without --verify to make them"


def main(argv: list[str]) -> None:
    """The command."""
    config, options = parse_arguments(build_parser(), argv)
    if options.verify:
        text = check(config, options.quiet)
    elif options.inspect:
        text = inspect(config)
    else:
        text = pair(config, options.quiet)
    if text:
        print(text)


if __name__ == "__main__":
    run_command(main)
