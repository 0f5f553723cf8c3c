"""What Trainer and MLflow cost over a bare training loop: same network, same batches, in one process.

    python benchmarks/training.py [--config conf/nao.yaml] [--steps 300] [--pairs 50000] [--repeats 4]
        [key.sub=value ...]

Random numbers stand in for pairs: the time does not depend on their values.
"""

from __future__ import annotations

import logging
import sys
import tempfile
import time
from pathlib import Path

import lightning
import torch
from common import print_header, print_table, read_options
from torch.utils.data import DataLoader

from mrhubo.callbacks.progress import TrainingProgress
from mrhubo.config import load_config
from mrhubo.fitting.datamodule import Batch, PairTable, batches_of
from mrhubo.fitting.module import LOG_EVERY, RetargetModule
from mrhubo.fitting.training import build_module
from mrhubo.fitting.tuning import TuningModule
from mrhubo.pairing import make_filter
from mrhubo.retargeter import build_network
from mrhubo.robot import build_body_map
from mrhubo.runtime.run_logger import RunLogger
from mrhubo.runtime.runs import start_run
from mrhubo.runtime.tracking import open_client


class Stopwatch(lightning.Callback):
    """Seconds from the first batch to the last, without the opening and closing of a run."""

    seconds = 0.0

    def on_train_start(self, *_: object) -> None:
        """Starts it."""
        self._start = time.perf_counter()

    def on_train_end(self, *_: object) -> None:
        """Stops it."""
        self.seconds = time.perf_counter() - self._start


def main(argv: list[str]) -> None:
    """Prints the table."""
    options, argv = read_options(argv, config="conf/nao.yaml", steps="300", pairs="50000", repeats="4")
    print_header()
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    config = load_config(Path(options["config"]), argv)
    steps, count = int(options["steps"]), int(options["pairs"])
    config.trainer.max_steps = steps
    body_map = build_body_map(config.robot)
    joints = len(body_map.robot.joint_names)

    def module() -> RetargetModule | TuningModule:
        torch.manual_seed(0)
        return build_module(build_network(config, body_map), config)

    def data() -> DataLoader[Batch]:
        generator = torch.Generator().manual_seed(0)
        size = module().network.features.size
        table = PairTable(*(torch.randn(count, *s, generator=generator) for s in ((size,), (joints, 6), (joints,))))
        chosen = make_filter(torch.rand(count, generator=generator), "linear", 1.0)
        return batches_of(table, chosen, config.trainer.batch_size, steps, 0)

    def bare() -> float:
        net, loader = module(), data()
        configured = net.configure_optimizers()
        optimizer, schedule = configured["optimizer"], configured["lr_scheduler"]["scheduler"]
        start = time.perf_counter()
        for batch in loader:
            loss = net.losses(*batch)["loss"]
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
        return time.perf_counter() - start

    def trainer(tracked: bool) -> float:
        with tempfile.TemporaryDirectory() as folder:
            logger = False
            if tracked:
                client = open_client(Path(folder), "benchmark")
                logger = RunLogger(client, start_run(client, "benchmark", "run", {}).info.run_id)
            fit = lightning.Trainer(
                max_epochs=1, accelerator="cpu", logger=logger, log_every_n_steps=LOG_EVERY, enable_progress_bar=False,
                enable_model_summary=False, enable_checkpointing=False,
                callbacks=[TrainingProgress(steps, {}), watch := Stopwatch()],
            )  # fmt: skip
            net, pairs = module(), data()
            fit.fit(net, pairs)
            return watch.seconds

    names = {"bare loop": bare, "Trainer": lambda: trainer(False), "Trainer + MLflow": lambda: trainer(True)}
    times: dict[str, list[float]] = {name: [] for name in names}
    for _ in range(int(options["repeats"])):  # in turn, so that a drift of the machine's speed meets all alike
        for name, run in names.items():
            times[name].append(run())
    rows = []
    best = [min(t) for t in times.values()]
    for name, seconds in zip(names, best, strict=True):
        rows.append([name, f"{1000 * seconds / steps:.1f}", f"{seconds / best[0] - 1:+.1%}"])
    print_table([f"loop (best of {options['repeats']})", "ms a step", "over the bare loop"], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
