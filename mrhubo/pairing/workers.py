"""All missing shards of a store, by as many processes as there are cores, and by as many ranks as there are machines.

One process with n threads makes far fewer pairs than n processes with one: the arrays are small. Workers are fresh
interpreters that are told shard by shard what to make (`mrhubo.pairing.worker`), so nothing is forked, a script that
calls `generate_pairs` needs no main guard, and a worker ends when whoever started it ends.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import mrhubo
from mrhubo.config import Config, to_yaml
from mrhubo.errors import UserError
from mrhubo.fast.side_by_side import available_cores
from mrhubo.files.storage import remove_leftovers
from mrhubo.pairing.generate import PairGenerator
from mrhubo.pairing.store import PairStore
from mrhubo.pairing.worker import make_shard
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.ranks import Ranks

_MIN_PAIRS_PER_WORKER = 10_000
"""Fewer are made before a new interpreter has started."""


@dataclass(frozen=True)
class PairingReport:
    """How the pairs came about."""

    made: int
    """Pairs made now, by all ranks; the others were there already."""
    seconds: float
    """Time that took, the amortised solver's training included."""

    def __str__(self) -> str:
        """For a person: `made 50,000 pairs in 64.2 s`."""
        if not self.made:
            return "made nothing: all were there"
        return f"made {self.made:,} pairs in {self.seconds:,.1f} s"


def generate_pairs(
    config: Config,
    generator: PairGenerator,
    store: PairStore,
    report: Reporter = SILENT,
    ranks: Ranks | None = None,
) -> PairingReport:
    """Makes the shards that are missing, damaged or foreign; those that are whole stay.

    Args:
        config: what generator and store were built from; workers build the same.
        generator: makes the pairs.
        store: where they go.
        report: told of the amortised solver's steps, and of the pairs: with several ranks, of those of this rank.
        ranks: the processes that share the work; default: this one alone.

    Raises:
        UserError: a shard cannot be written.
    """
    ranks = ranks or Ranks()
    start = time.perf_counter()
    remove_leftovers(store.folder)
    mine = range(ranks.rank, store.shards, ranks.count)
    missing = ranks.gather(store.missing(mine), store.shards)
    indices = missing[ranks.rank :: ranks.count]
    for index in indices:
        store.path(index).unlink(missing_ok=True)
    if missing:
        if ranks.rank == 0:
            generator.prepare(store, report)
        ranks.wait()
        if ranks.rank > 0:
            generator.prepare(store)
    there = len(mine) - len(indices) if ranks.count == 1 else 0
    total = there + len(indices)
    with report.step("pairs", min(total * store.shard_size, store.count)) as progress:
        progress.update(min(there * store.shard_size, store.count))  # only now, so that the rate is that of the pairs
        for done, means in enumerate(_make(config, generator, store, indices, ranks), start=there + 1):
            progress.update(min(done * store.shard_size, store.count), _quality(means))
    ranks.wait()
    return PairingReport(len(missing) * store.shard_size, time.perf_counter() - start)


def _quality(means: dict[str, float]) -> str:
    return f"keypoints {1000 * means['residual_m']:.1f} mm off" if "residual_m" in means else ""


def _make(
    config: Config, generator: PairGenerator, store: PairStore, indices: Sequence[int], ranks: Ranks
) -> Iterator[dict[str, float]]:
    count = config.pairs.workers or (available_cores() if ranks.count == 1 else 1)
    count = min(count, len(indices) * store.shard_size // _MIN_PAIRS_PER_WORKER)
    if count < 2 or generator.device.type != "cpu":
        for index in indices:
            yield make_shard(generator, store, index)
        return
    try:
        with _workers(config, store.header["fingerprint"], count) as workers:
            yield from _dispatch(workers, indices)
    finally:
        remove_leftovers(store.folder)  # of those that were ended while they wrote


def _dispatch(workers: Sequence[subprocess.Popen[str]], indices: Sequence[int]) -> Iterator[dict[str, float]]:
    """Every index goes to the next worker that is free; yields the answers."""
    waiting: queue.SimpleQueue[int] = queue.SimpleQueue()
    answers: queue.SimpleQueue[dict[str, float] | str] = queue.SimpleQueue()
    for index in indices:
        waiting.put(index)

    def serve(worker: subprocess.Popen[str]) -> None:
        assert worker.stdin and worker.stdout
        while True:
            try:
                index = waiting.get_nowait()
            except queue.Empty:
                return
            try:
                worker.stdin.write(f"{index}\n")
                worker.stdin.flush()
            except OSError:
                pass  # it has ended; its last answer may say why
            line = worker.stdout.readline()
            answers.put(json.loads(line) if line else _ending(worker.wait()))
            if not line:
                return

    for worker in workers:
        threading.Thread(target=serve, args=(worker,), daemon=True).start()
    for _ in indices:
        answer = answers.get()
        if isinstance(answer, str):
            raise UserError(answer)
        if "error" in answer:
            raise UserError(str(answer["error"]))
        yield answer


def _ending(code: int) -> str:
    """What there is to say of a worker that did not answer."""
    resume = "the same command goes on; pairs.workers sets how many work at once"
    if code < 0:
        memory = ", perhaps because memory ran out" if code == -signal.SIGKILL else ""
        return f"pairs.workers: a process that makes pairs was killed ({_name(-code)}{memory}); {resume}"
    return (
        f"pairs.workers: a process that makes pairs ended with exit code {code}; what it wrote to standard error stands"
        f" above; {resume}"
    )


def _name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


@contextmanager
def _workers(config: Config, fingerprint: str, count: int) -> Iterator[list[subprocess.Popen[str]]]:
    """Fresh interpreters that know the config; ended on leaving, whatever they are doing: files are whole or absent."""
    package = str(Path(mrhubo.__file__).parent.parent)
    path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path}
    command = [sys.executable, "-c", "from mrhubo.pairing.worker import main; main()"]
    workers: list[subprocess.Popen[str]] = []
    try:
        for _ in range(count):
            workers.append(
                subprocess.Popen(
                    command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
                )
            )
        for worker in workers:
            assert worker.stdin
            with suppress(OSError):  # it has ended already; it is told when it does not answer
                worker.stdin.write(json.dumps([to_yaml(config), fingerprint]) + "\n")
                worker.stdin.flush()
        yield workers
    finally:
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.communicate()
