"""The pictures of docs/pairing.md: best, median and worst pairs, and the distributions of three solvers' measures.

    python benchmarks/pair_pictures.py [--robots nao,coman,reachy] [--poses 2000] [--out docs/images] [key=value ...]

All solvers get the same robot poses. The pictures of pairs are those of `fine`.
"""

from __future__ import annotations

import copy
import sys
from pathlib import Path

from common import print_header, print_table, read_options

from mrhubo.config import load_config
from mrhubo.fitting.preparation import prepare_pairs
from mrhubo.pairing import PairGenerator
from mrhubo.view import contact_sheet, distributions, save_png
from mrhubo.view.pictures import PAIR_MEASURES, PAIR_TITLES, Artist

SOLVERS = ("fine", "fast", "paper")


def main(argv: list[str]) -> None:
    """Draws a picture a robot and prints the means."""
    options, argv = read_options(argv, robots="nao,coman,reachy", poses="2000", out="docs/images")
    print_header()
    rows = []
    for robot in options["robots"].split(","):
        config = load_config(Path(f"conf/{robot}.yaml"), [*argv, "pairs.solver=fine", "trainer.accelerator=cpu"])
        setup = prepare_pairs(config)
        first = PairGenerator(setup.body_map, setup.prior, config)
        first.prepare(setup.store)
        found = {}
        for solver in SOLVERS:
            own = copy.deepcopy(config)
            own.pairs.solver, own.pairs.shard_size = solver, int(options["poses"])
            maker = PairGenerator(setup.body_map, setup.prior, own)
            maker.amortiser = first.amortiser
            found[solver] = maker.shard("forward", 0)
        series = {
            solver: {name: unit * pairs[name].numpy() for name, unit in PAIR_MEASURES.items()}
            for solver, pairs in found.items()
        }
        for solver, measures in series.items():
            rows.append([robot, solver, *(f"{values.mean():.3g}" for values in measures.values())])
        figures = Artist(setup.body_map.robot, setup.body_map.skeleton).ranked_pairs(found["fine"])
        charts = distributions(series, PAIR_TITLES, (figures.width, 300))
        path = save_png(contact_sheet([[figures], [charts]], gap=0), Path(options["out"]) / f"pairs_{robot}.png")
        print(path)
    print()
    print_table(["robot", "solver", *(f"mean {title}" for title in PAIR_TITLES.values())], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
