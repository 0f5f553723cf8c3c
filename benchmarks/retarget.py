"""How long `Retargeter.retarget` takes for one frame and for 1,000 at once; with two checkouts, side by side.

    python benchmarks/retarget.py PACKAGE [--against CHECKOUT] [--frames 1,1000] [--rounds 100]

PACKAGE is the folder of a trained retargeter, CHECKOUT another state of this repository, which this one is compared to.
Each checkout has a process of its own with one thread; in every round all of them get the same poses, drawn from the
package's body prior, and take turns, so that a drift of the machine's speed meets all alike. Figures are medians over
rounds. Nothing but `Retargeter.load`, `.prior.decode` and `.retarget` is asked of a checkout.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

_WARM_UP = 3
"""Calls of each size that are not counted."""


def serve(package: str) -> None:
    """A process that answers each number of frames on standard input by the seconds that retargeting them takes."""
    answers, sys.stdout = sys.stdout, sys.stderr  # nothing else may come between the answers
    import torch

    import mrhubo
    from mrhubo import rotation
    from mrhubo.retargeter import Retargeter

    torch.set_num_threads(1)
    retargeter = Retargeter.load(package)
    # Checkouts from before poses were rotation matrices take 6D.
    decode = retargeter.prior.decode_matrices if hasattr(rotation, "orthonormal") else retargeter.prior.decode
    print(json.dumps(str(Path(mrhubo.__file__).resolve().parents[1])), file=answers, flush=True)
    generator = torch.Generator().manual_seed(0)
    for line in sys.stdin:
        z_TZ = 0.7 * torch.randn(int(line), retargeter.prior.latent, generator=generator)
        with torch.no_grad():
            poses = decode(z_TZ)
        start = time.perf_counter()
        retargeter.retarget(poses)
        print(json.dumps(time.perf_counter() - start), file=answers, flush=True)


@contextmanager
def server(checkout: Path, package: Path) -> Iterator[subprocess.Popen[str]]:
    """The process of one checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, str(Path(__file__).resolve()), "--serve", str(package.resolve())]
    process = subprocess.Popen(
        command, env=environment, cwd=checkout, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )
    try:
        found = answer(process)
        if found != str(checkout.resolve()):
            raise SystemExit(f"{checkout}: Python found mrhubo in {found} instead")
        yield process
    finally:
        process.kill()
        process.communicate()


def answer(process: subprocess.Popen[str]) -> str | float:
    """The next line of a process."""
    assert process.stdout
    line = process.stdout.readline()
    if not line:
        raise SystemExit(f"a process ended with exit code {process.wait()}; what it wrote stands above")
    return json.loads(line)


def ask(process: subprocess.Popen[str], frames: int) -> float:
    """Seconds that a process takes to retarget some frames."""
    assert process.stdin
    process.stdin.write(f"{frames}\n")
    return float(answer(process))


def measure(checkouts: Sequence[Path], package: Path, sizes: Sequence[int], rounds: int) -> list[list[list[float]]]:
    """Seconds of every call: by checkout, by size, by round."""
    with ExitStack() as stack:
        processes = [stack.enter_context(server(checkout, package)) for checkout in checkouts]
        seconds: list[list[list[float]]] = [[[] for _ in sizes] for _ in checkouts]
        for number in range(-_WARM_UP, rounds):
            order = range(len(processes)) if number % 2 else reversed(range(len(processes)))
            for which in order:
                for place, frames in enumerate(sizes):
                    taken = ask(processes[which], frames)
                    if number >= 0:
                        seconds[which][place].append(taken)
    return seconds


def cell(seconds: Sequence[float]) -> str:
    """Median and quartiles in ms."""
    if len(seconds) < 2:
        return f"{1e3 * seconds[0]:.3f}"
    low, middle, high = statistics.quantiles(seconds, n=4)
    return f"{1e3 * middle:.3f} ({1e3 * low:.3f} to {1e3 * high:.3f})"


def main(argv: list[str]) -> None:
    """Prints the table."""
    from common import print_header, print_table

    from mrhubo.runtime.locations import project_root
    from mrhubo.runtime.provenance import git_commit

    parser = argparse.ArgumentParser(description="How long retarget takes for one frame and for 1,000 at once.")
    parser.add_argument("package", type=Path, help="folder of a trained retargeter")
    parser.add_argument("--against", type=Path, help="another checkout of this repository")
    parser.add_argument("--frames", default="1,1000", help="frames a call (default: %(default)s)")
    parser.add_argument("--rounds", type=int, default=100, help="calls of each size (default: %(default)s)")
    given = parser.parse_args(argv)
    if not given.package.is_dir():
        parser.error(f"{given.package}: there is no such folder; it should be a trained retargeter's package")
    sizes = [int(size) for size in given.frames.split(",")]
    checkouts = [project_root(), *([given.against] if given.against else [])]
    print_header()
    found = measure(checkouts, given.package, sizes, max(1, given.rounds))
    rows = [
        [git_commit(checkout)[:8], *(cell(times) for times in of_checkout)]
        for checkout, of_checkout in zip(checkouts, found, strict=True)
    ]
    if len(found) == 2:
        pairs = zip(*found, strict=True)
        ratios = [statistics.median(a / b for a, b in zip(*both, strict=True)) for both in pairs]
        rows.append(["first over second", *(f"{ratio:.3f}" for ratio in ratios)])
    print_table(["commit", *(f"{size:,} frame{'s' * (size > 1)} [ms]" for size in sizes)], rows)
    print(f"\nmedian of {max(1, given.rounds)} calls, one thread (quartiles); the ratio is the median of the rounds'")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(sys.argv[2])
    else:
        main(sys.argv[1:])
