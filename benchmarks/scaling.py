"""How making pairs, and training on them, gain from a second process.

    python benchmarks/scaling.py [--config conf/nao.yaml] [--pairs 100000] [--steps 1000] [--torchrun 2,4]
        [key.sub=value ...]

Every row starts commands as a user would; the amortised solver is trained before, and the time to start is in the
figures. That all rows made the same bytes is checked. `--torchrun` lists numbers of processes (by default 2 and one a
core; "" leaves torchrun out), `--steps 0` leaves training out.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from common import print_header, print_table, read_options

from mrhubo.config import load_config
from mrhubo.fast.side_by_side import available_cores
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.fitting.preparation import prepare_pairs

TORCHRUN = ["-m", "torch.distributed.run", "--nproc-per-node"]


def main(argv: list[str]) -> None:
    """Prints both tables."""
    options, argv = read_options(
        argv, config="conf/nao.yaml", pairs="100000", steps="1000", torchrun=f"2,{available_cores()}"
    )
    print_header()
    cores, counts = available_cores(), sorted({int(n) for n in options["torchrun"].split(",") if n})
    with tempfile.TemporaryDirectory() as folder:
        first = Path(folder) / "amortiser"
        argv = ["pairs.solver=fine", *argv]  # the slowest, which is worth several processes
        given = ["--config", options["config"], "--quiet", "trainer.accelerator=cpu", *argv]
        run(["-m", "mrhubo.pair", *given, "pairs.count=100", f"pairs.dir={first}"])
        ways = {
            "one process": ["-m", "mrhubo.pair", "pairs.workers=1"],
            f"one command, {cores} worker processes": ["-m", "mrhubo.pair"],
            **{f"torchrun, {n} processes": [*TORCHRUN, str(n), "-m", "mrhubo.pair"] for n in counts},
        }
        rows, made = [], set()
        for index, (name, command) in enumerate(ways.items()):
            place = Path(folder) / str(index)
            more = [f"pairs.count={options['pairs']}", f"pairs.dir={place}"]
            copy_amortiser(options["config"], argv, first, place)
            seconds = run([*command, *given, *more])
            rows.append([name, seconds, int(options["pairs"]) / seconds])
            made.add(digest(place))
        show("pairs", "pairs/s", rows)
        print(f"\nthe same bytes: {'yes' if len(made) == 1 else 'NO'}\n")
        rows, steps = [], int(options["steps"])
        if not steps:
            return
        fit = ["-m", "mrhubo.fit", *given, f"pairs.count={options['pairs']}", f"pairs.dir={Path(folder) / '1'}"]
        run([*fit, "trainer.max_steps=1", f"tracking.dir={Path(folder) / 'references'}"])  # makes the clips' references
        for name, command in {"one process": [], "torchrun, 2 processes": [*TORCHRUN, "2"]}.items():
            place = f"tracking.dir={Path(folder) / name.replace(' ', '-')}"
            # Two lengths: their difference is training alone.
            short, long = (run([*command, *fit, place, f"trainer.max_steps={n}"]) for n in (1, 1 + steps))
            rows.append([name, long - short, steps / (long - short)])
        show("training", "steps/s", rows)


def copy_amortiser(config: str, overrides: Sequence[str], source: Path, place: Path) -> None:
    """Puts a trained amortised solver where a pairing with the same settings looks for it."""
    paths = [
        prepare_pairs(load_config(Path(config), [*overrides, f"pairs.dir={folder}"])).store.amortiser_path
        for folder in (source, place)
    ]
    write_tensors(paths[1], *read_tensors(paths[0]))


def run(arguments: Sequence[str]) -> float:
    """Seconds that a Python command takes."""
    environment = {k: v for k, v in os.environ.items() if k != "OMP_NUM_THREADS"}
    start = time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(arguments)}\n{done.stderr}")
    return time.perf_counter() - start


def digest(folder: Path) -> str:
    """Of all files below a folder."""
    whole = hashlib.sha256()
    for path in sorted(folder.rglob("*.safetensors")):
        whole.update(path.name.encode() + path.read_bytes())
    return whole.hexdigest()


def show(what: str, unit: str, rows: Sequence[Sequence]) -> None:
    """A table with the speed-up over its first row."""
    base = rows[0][2]
    print_table(
        [what, "seconds", unit, "times one process"],
        [[name, f"{seconds:.1f}", f"{rate:,.1f}", f"{rate / base:.2f}"] for name, seconds, rate in rows],
    )


if __name__ == "__main__":
    main(sys.argv[1:])
