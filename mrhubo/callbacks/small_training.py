"""What the trainings of networks for all robots share, the body prior's and the universal network's: a run in MLflow
and Lightning's trainer, which goes on from where it was stopped.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lightning

from mrhubo.callbacks.checkpoints import CheckedFiles, Checkpoints
from mrhubo.callbacks.progress import TrainingProgress
from mrhubo.config import changed_settings, to_plain
from mrhubo.runtime.provenance import git_commit
from mrhubo.runtime.run_logger import RunLogger
from mrhubo.runtime.runs import ending, take_up_run
from mrhubo.runtime.tracking import open_client
from mrhubo.runtime.workspace import Workspace


@contextmanager
def tracked(config: Any, workspace: Workspace, experiment: str) -> Iterator[RunLogger]:
    """The run of a workspace, with all settings of a config, whose `tracking_dir` has the database; closed at the end
    as finished, killed or failed.
    """
    name = ", ".join(f"{k}={v}" for k, v in changed_settings(config).items()) or "defaults"
    client = open_client(config.tracking_dir, experiment)
    run, _ = take_up_run(client, experiment, workspace, name, {"git_commit": git_commit(Path(__file__).parent)})
    client.keep_in(workspace.unsent)
    with ending(client, run.info.run_id):
        logger = RunLogger(client, run.info.run_id)
        logger.log_parameters(to_plain(config), run.data.params)
        yield logger


def small_trainer(
    steps: int, epoch: int, logger: RunLogger, log_every: int, accelerator: str, progress: TrainingProgress,
    saver: Checkpoints,
) -> lightning.Trainer:  # fmt: skip
    """A trainer on one device; `epoch`: steps between validations and checkpoints."""
    return lightning.Trainer(
        max_epochs=-(-steps // epoch),  # max_steps would break exact resumption
        logger=logger,
        log_every_n_steps=log_every,
        accelerator=accelerator,
        devices=1,
        gradient_clip_val=1.0,
        enable_model_summary=False,
        enable_progress_bar=False,
        num_sanity_val_steps=0,
        callbacks=[progress, saver],
        plugins=[CheckedFiles()],
    )
