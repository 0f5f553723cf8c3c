"""The step of a fit that makes the pairs, and what can be asked about pairs that are there."""

from __future__ import annotations

from mrhubo.errors import UserError
from mrhubo.files.arrays import DamagedFile
from mrhubo.fitting.preparation import device_of, make_places
from mrhubo.pairing import PairGenerator, PairingReport, PairSetup, generate_pairs
from mrhubo.pairing.verify import PairSummary, summarise, verify
from mrhubo.runtime.progress import Reporter
from mrhubo.runtime.ranks import Ranks


def make_pairs(setup: PairSetup, report: Reporter, ranks: Ranks | None = None) -> PairingReport:
    """Makes the pairs that are not there yet; several ranks share them out.

    Raises:
        UserError: the folder cannot be used, or a shard cannot be written.
        KeyboardInterrupt: the user stopped it; the same call goes on.
    """
    ranks = ranks or Ranks()
    make_places(setup)
    device = ranks.device or device_of(setup.config)
    generator = PairGenerator(setup.body_map.to(device), setup.prior.to(device), setup.config)
    made = generate_pairs(setup.config, generator, setup.store, report, ranks)
    setup.body_map.to("cpu")
    setup.prior.to("cpu")
    return made


def summarise_pairs(setup: PairSetup) -> PairSummary:
    """The pairs in numbers.

    Raises:
        DamagedFile: a shard is missing, or not of these settings.
    """
    return summarise(setup.store, setup.config.pairs.filter, setup.config.pairs.filter_k)


def verify_pairs(setup: PairSetup, report: Reporter) -> str:
    """Reads every shard again; returns what there is to say if all are well.

    Raises:
        UserError: shards are missing or damaged; it names the first.
    """
    store = setup.store
    if not store.folder.is_dir():
        raise UserError(
            f"{store.folder}: there are no pairs of these settings; run the same command without --verify to make them"
        )
    problems = verify(store, setup.body_map.robot, report)
    if problems:
        more = f" (and {len(problems) - 1:,} more shards of {store.shards:,})" if len(problems) > 1 else ""
        raise UserError(f"{problems[0]}{more}; run the same command without --verify to make them again")
    return f"all {store.shards:,} shards are whole: {store.folder}"


def inspect_pairs(setup: PairSetup) -> str:
    """Sums up the pairs that are there and draws `pairs.png` into their folder; returns text and path.

    Raises:
        UserError: there are no such pairs, or not all of them.
    """
    from mrhubo.view import save_png
    from mrhubo.view.pictures import Artist

    store = setup.store
    try:
        summary = summarise_pairs(setup)
        shown = store.read(0)
    except DamagedFile as error:
        raise UserError(f"{error}; run the same command without --inspect to make what is missing") from error
    artist = Artist(setup.body_map.robot, setup.body_map.skeleton)
    path = save_png(artist.pair_sheet(shown, summary.measures), store.folder / "pairs.png")
    return f"{summary.table()}\n\npairs:   {store.folder}\npicture: {path}"
