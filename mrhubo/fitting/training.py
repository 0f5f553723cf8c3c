"""The step of a fit that trains: Lightning's trainer over `RetargetModule` and `PairData`.

The scale factor, where it is to be searched for, and the pairs are found and made on the way: by the callback
`ScaleFactorSearch` and by `PairData`, in the hooks that Lightning has for that.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import lightning
import torch
from lightning.pytorch.loggers import Logger
from torch import Tensor

from mrhubo.callbacks import BEST, LAST, CheckedFiles, Checkpoints, ClipMetrics, TrainingProgress, resumable
from mrhubo.config import Config, TrainerConfig
from mrhubo.evaluation import Clip
from mrhubo.fitting.branch_threads import branches_in_threads
from mrhubo.fitting.datamodule import PairData
from mrhubo.fitting.module import LOG_EVERY, RetargetModule
from mrhubo.fitting.preparation import Prepared, device_of
from mrhubo.fitting.tuning import TuningModule
from mrhubo.pairing import PairFilter, PairingReport
from mrhubo.retargeter import JointNetwork, Retargeter, RetargetNetwork, UniversalJoints, build_network
from mrhubo.runtime.progress import Reporter
from mrhubo.runtime.ranks import Ranks
from mrhubo.runtime.trainer import quiet_lightning, run_trainer

_SHOWN = {"val/joint_rad": "validation joint rad", "val/link_cm": "link cm"}
"""Metrics on a training's progress line, and what they are called there."""


@dataclass
class Training:
    """A trained network and what it was trained on."""

    prepared: Prepared
    """What the pairs were made from: where the scale factor was searched for, with the one that was found."""
    network: JointNetwork
    pairs: dict[str, Tensor]
    filter: PairFilter
    pairing: PairingReport
    """How the pairs came about."""
    best_checkpoint: Path
    best_link_cm: float
    """Validation link error of that checkpoint."""

    @property
    def retargeter(self) -> Retargeter:
        """The network with its robot."""
        prepared = self.prepared
        return Retargeter(self.network, prepared.body_map, prepared.prior, prepared.config, self.filter.threshold)


def train(
    prepared: Prepared,
    report: Reporter,
    validation: Sequence[Clip],
    checkpoints: Path,
    logger: Logger | bool = False,
    ranks: Ranks | None = None,
    callbacks: Sequence[lightning.Callback] = (),
) -> Training:
    """Makes the pairs that are missing, trains on them, and returns the network that is nearest to the person on the
    validation clips, its weights rounded to 16 bits.

    Args:
        prepared: the checked config; with `robot.scale: search` a `ScaleFactorSearch` must be among the callbacks.
        report: told of the steps.
        validation: clips that choose the checkpoint.
        checkpoints: folder for `last.ckpt` and `best.ckpt`, see `Checkpoints`. From the last that is there the training
            goes on. One that does not fit is passed over, with a sentence, and the best one is taken in its place, if
            that fits.
        logger: Lightning's logger, or False for none.
        ranks: the processes that train together (DDP), each on its share of every batch; default: this one alone.
        callbacks: more of them; they stand after the metrics of the validation clips.

    Raises:
        UserError: a shard or a checkpoint cannot be written, or the filter drops every pair.
        KeyboardInterrupt: the user stopped it; the last checkpoint is there.
    """
    ranks = ranks or Ranks()
    settings = prepared.config.trainer
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(settings.seed)
        network = build_network(prepared.config, prepared.body_map)
    data = PairData(prepared, network.features, report, ranks)
    module = build_module(network, prepared.config)
    saver = Checkpoints(checkpoints, "val/angle_deg", beside="val/link_cm")
    metrics = ClipMetrics(validation, prepared.body_map, prepared.config.robot.key_links)
    progress = TrainingProgress(settings.max_steps, _SHOWN, report)
    device = device_of(prepared.config).type
    # In bf16, autocast would have to be told to each thread; several ranks add up gradients as they come about.
    threads = device == "cpu" and ranks.count == 1 and settings.precision == "32"
    with quiet_lightning():
        trainer = _trainer(settings, device, ranks, logger, [metrics, *callbacks, progress, saver])
        start = _start(checkpoints, module, report)
        with branches_in_threads(module) if threads and isinstance(module, RetargetModule) else nullcontext():
            run_trainer(trainer, module, start, datamodule=data)
    best = torch.load(checkpoints / BEST, map_location="cpu", weights_only=True)["state_dict"]
    network.to("cpu").load_state_dict({k.removeprefix("network."): v for k, v in best.items()})
    network.requires_grad_(False).eval()
    if isinstance(network, RetargetNetwork):
        network.round_weights()
    return Training(
        data.prepared,
        network,
        data.pairs,
        data.filter,
        data.pairing,
        checkpoints / BEST,
        float("nan") if saver.best_beside is None else saver.best_beside,
    )


def build_module(network: JointNetwork, config: Config) -> RetargetModule | TuningModule:
    """Loss and optimiser for a network."""
    if isinstance(network, UniversalJoints):
        return TuningModule(network, config.trainer)
    assert isinstance(network, RetargetNetwork)
    return RetargetModule(network, config.trainer, config.model.detach_student)


def _start(checkpoints: Path, module: lightning.LightningModule, report: Reporter) -> Path | None:
    """The checkpoint that the training goes on from; says what is passed over, and what happens in place of that."""
    if not os.path.lexists(checkpoints / LAST):
        return None
    found, said = resumable(checkpoints, module)
    for sentence in said:
        report.say(f"{sentence}; the training goes on from {found.name if found else 'its beginning'}")
    return found


def _trainer(
    settings: TrainerConfig, device: str, ranks: Ranks, logger: Logger | bool, callbacks: list[lightning.Callback]
) -> lightning.Trainer:
    return lightning.Trainer(
        accelerator=settings.accelerator if settings.accelerator != "auto" else device,
        devices=ranks.count // ranks.nodes,
        num_nodes=ranks.nodes,
        strategy="ddp" if ranks.count > 1 else "auto",
        use_distributed_sampler=False,
        precision="bf16-mixed" if settings.precision == "bf16" else "32-true",
        # Not max_steps: with it Lightning takes a checkpoint of a finished epoch for one within the epoch, and a
        # resumed run goes on with other batches. The module stops at its last step.
        max_epochs=-(-settings.max_steps // settings.validate_every),
        logger=logger,
        log_every_n_steps=LOG_EVERY,
        num_sanity_val_steps=0,
        enable_progress_bar=False,
        enable_model_summary=False,
        callbacks=callbacks,
        plugins=[CheckedFiles()],
    )
