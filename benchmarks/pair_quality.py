"""How the link error on the validation clips depends on the pairs: number, solver, filter, weight of the prior,
and how many of them start from a human pose.

    python benchmarks/pair_quality.py [--robots nao,coman,reachy] [--only WORD] [--seeds 1]
        [--counts 12500,50000,200000] [--results FILE] [key.sub=value ...]

`--only reverse` makes the rows whose name holds that word; all rows but those by count have the second of the counts.

Trains a network for every row, with all other settings as shipped. Trainings whose result is in FILE (JSON lines) are
not done again, so an interrupted table goes on where it stopped.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from common import print_header, print_table, read_options

from mrhubo.config import load_config
from mrhubo.fitting.preparation import prepare
from mrhubo.fitting.references import make_references
from mrhubo.fitting.training import train
from mrhubo.runtime.progress import SILENT
from mrhubo.runtime.tables import mean_and_spread

FILTERS = {
    "linear, k 0.5": ["pairs.filter_k=0.5"],
    "linear, k 1": [],
    "linear, k 2": ["pairs.filter_k=2"],
    "hard, k 1": ["pairs.filter=hard"],
    "none": ["pairs.filter=none"],
}
WEIGHTS = (0.003, 0.01)
REVERSE_SHARES = (0.25, 0.5, 0.75, 1.0)


def rows(counts: Sequence[int]) -> list[tuple[str, list[str]]]:
    """Name and settings of every row: solver by count, solver by filter, weights of the prior, reverse pairs."""
    table, middle = [], counts[1]
    for solver in ("fine", "fast"):
        for count in counts:
            for name, change in FILTERS.items() if count == middle else [("linear, k 1", FILTERS["linear, k 1"])]:
                settings = [f"pairs.solver={solver}", f"pairs.count={count}", "pairs.reverse_share=0", *change]
                table.append((f"{solver}, {count:,}, {name}", settings))
    changes = {
        **{f"w_prior {w}": [f"pairs.w_prior={w}", "pairs.reverse_share=0"] for w in WEIGHTS},
        "not aligned": ["pairs.align=false", "pairs.reverse_share=0"],
        **{f"{share:.0%} of them reverse": [f"pairs.reverse_share={share}"] for share in REVERSE_SHARES},
    }
    base = f"fine, {middle:,}, linear, k 1"
    return table + [(f"{base}, {name}", [f"pairs.count={middle}", *change]) for name, change in changes.items()]


def link_error(robot: str, settings: list[str], results: Path) -> float:
    """Best link error [cm] on the validation clips, read from the results or trained for."""
    prepared = prepare(load_config(Path(f"conf/{robot}.yaml"), settings))
    done = [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
    for result in done:
        if result["fingerprint"] == prepared.fingerprint:
            return result["link_cm"]
    validation, _ = make_references(prepared, SILENT)
    with tempfile.TemporaryDirectory() as folder:
        link = train(prepared, SILENT, validation, Path(folder)).best_link_cm
    with results.open("a") as file:
        file.write(json.dumps({"fingerprint": prepared.fingerprint, "link_cm": link}) + "\n")
    print(f"{robot} {' '.join(settings)}: {link:.3f} cm", file=sys.stderr, flush=True)
    return link


def main(argv: list[str]) -> None:
    """Prints the table."""
    options, argv = read_options(
        argv,
        robots="nao,coman,reachy",
        only="",
        seeds="1",
        counts="12500,50000,200000",
        results="mlruns/pair_quality.jsonl",
    )
    robots, results = options["robots"].split(","), Path(options["results"])
    results.parent.mkdir(parents=True, exist_ok=True)
    table = []
    for name, change in rows([int(count) for count in options["counts"].split(",")]):
        if options["only"] not in name:
            continue
        cells = []
        for robot in robots:
            found = [
                link_error(robot, [*argv, *change, f"trainer.seed={seed}"], results)
                for seed in range(int(options["seeds"]))
            ]
            cells.append(mean_and_spread(found, 2))
        table.append([name, *cells])
    print_header()
    print_table(["pairs", *(f"{robot} [cm]" for robot in robots)], table)


if __name__ == "__main__":
    main(sys.argv[1:])
