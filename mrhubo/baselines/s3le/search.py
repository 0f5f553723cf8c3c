"""The search of S3LE's settings: a sweep whose trials train S3LE."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from mrhubo.baselines.s3le.experiment import Baseline, capture_of, open_run
from mrhubo.config import BaselineConfig, SweepConfig, load_config, to_yaml
from mrhubo.fitting.preparation import Prepared
from mrhubo.fitting.sweeping import Sweep, SweepResult, SweepTrial
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.runs import ending, log_all

SPACE: dict[str, Any] = {
    "s3le.latent": [8, 16, 32, 64],
    "s3le.normal_weight": {"low": 1e-3, "high": 1.0, "log": True},
    "s3le.pair_weight": {"low": 1.0, "high": 100.0, "log": True},
    "s3le.projection_weight": {"low": 0.1, "high": 100.0, "log": True},
    "s3le.lr": {"low": 3e-4, "high": 3e-3, "log": True},
    "s3le.beyond": {"low": 0.0, "high": 0.5},
}
"""What varies. Neighbours and kernel width need no training: every trial tries all of NEIGHBOURS and WIDTHS."""
NEIGHBOURS, WIDTHS = (1, 3, 10, 30, 100), (0.2, 0.5, 1.0)


class S3LETrials:
    """Trainings of S3LE; the glue pairs and the random poses are made once and shared by all of a process."""

    schema = BaselineConfig

    def __init__(self, config: BaselineConfig, report: Reporter) -> None:
        self.config, self.report = config, report

    @cached_property
    def baseline(self) -> Baseline:
        """What is the same for all trials."""
        return Baseline.open(self.config, self.report)

    def train(self, prepared: Prepared, trial: SweepTrial) -> float:
        """Trains, and takes the look-up that has the smallest link error on the validation clips."""
        assert isinstance(prepared.config, BaselineConfig)
        settings = prepared.config.s3le
        run_id = open_run(self.baseline, settings, trial.parent, f"S3LE, trial {trial.trial.number}", {})
        trial.begin(run_id)
        with ending(trial.client, run_id):
            trial.show("training")
            model = self.baseline.train(settings, SILENT)
            errors: dict[tuple[int, float], float] = {}
            for neighbours in NEIGHBOURS:
                for width in WIDTHS if neighbours > 1 else WIDTHS[:1]:
                    tried = replace(settings, neighbours=neighbours, width=width)
                    errors[neighbours, width] = self.baseline.validation_link_cm(model, tried)
            log_all(trial.client, run_id, {f"val/link_cm_{n}_{width}": link for (n, width), link in errors.items()})
            neighbours, width = min(errors, key=lambda pair: errors[pair])
            settled = {"s3le.neighbours": str(neighbours), "s3le.width": str(width)}
            return trial.conclude(prepared.fingerprint, errors[neighbours, width], settled)


def search_settings(config: BaselineConfig, report: Reporter, trials: int) -> SweepResult:
    """Trials until there are `trials` of them, over all starts and all processes; the best settings for `config`.

    Raises:
        UserError: anything in the config or the files it names is wrong, or three trials in a row failed.
        KeyboardInterrupt: the user stopped it; the same call goes on.
    """
    capture_of(config)
    settings = SweepConfig("s3le", SPACE, trials=trials, pruner="none", seed=config.s3le.seed)
    method = S3LETrials(config, report)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "config.yaml"
        file.write_text(to_yaml(config))

        def load(changes: Sequence[str]) -> BaselineConfig:
            return load_config(file, changes, BaselineConfig)

        return Sweep(load, (), settings, method, report).run()
