"""The steps of a fit, one function each: check, pairs, training, test, package. `mrhubo.fit` strings them together.

Everything a user can get wrong is checked by `prepare`, before any work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import lightning
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.loggers import Logger
from torch import Tensor

from mrhubo.callbacks import ClipMetrics
from mrhubo.callbacks.progress import TrainingProgress
from mrhubo.config import Config, fingerprint, to_plain
from mrhubo.errors import UserError
from mrhubo.evaluation import Clip, Evaluation, Motions, evaluate_clips, load_motions, solve_references
from mrhubo.fitting.data import PairData, PairTable
from mrhubo.fitting.module import LOG_EVERY, RetargetModule
from mrhubo.pairing import (
    PairFilter,
    PairGenerator,
    PairingReport,
    PairSetup,
    generate_pairs,
    make_filter,
    pose_settings,
)
from mrhubo.retargeter import RetargetNetwork, build_network
from mrhubo.runtime.locations import default_motions, default_pairs
from mrhubo.runtime.progress import Progress
from mrhubo.runtime.ranks import Ranks
from mrhubo.runtime.trainer import quiet_lightning, run_trainer

_SHOWN = {"val/joint_rad": "validation joint rad", "val/link_cm": "link cm"}
"""Metrics on a training's progress line, and what they are called there."""


@dataclass
class Prepared(PairSetup):
    """A config whose every part has been checked."""

    motions: Motions

    @property
    def fingerprint(self) -> str:
        """Of everything that decides the result of a fit."""
        plain = to_plain(self.config)
        for key in ("tracking", "evaluation", "body"):  # the checksums of prior and skeleton are in the store's header
            plain.pop(key)
        plain["robot"] = [pose_settings(self.config), self.config.robot.key_links]  # wherever the URDF lies
        for key in ("dir", "workers"):
            plain["pairs"].pop(key)
        clips = {motion.name: motion.checksum for motion in self.motions.all}
        evaluation = [sorted(m.name for m in self.motions.validation), self.config.evaluation.smoothness]
        return fingerprint([plain, self.store.header, clips, evaluation])


def prepare_pairs(config: Config, search: bool = False) -> PairSetup:
    """Fills in the default folder and opens everything that making pairs needs; `search`: the caller can do
    `robot.scale: search`.

    Raises:
        UserError: anything in the config, the URDF or the prior is wrong.
    """
    if config.robot.scale == "search" and not search:
        raise UserError(
            "robot.scale: 'search' is done by mrhubo.fit alone, in one process; take what it found, config.yaml in its "
            "run, or 'manual' or 'auto'"
        )
    config.pairs.dir = config.pairs.dir or default_pairs()
    setup = PairSetup.open(config)
    if config.trainer.accelerator == "gpu" and not torch.cuda.is_available():
        raise UserError("trainer.accelerator: 'gpu' is asked for, but torch finds no CUDA device; use 'auto' or 'cpu'")
    return setup


def prepare(config: Config, search: bool = False) -> Prepared:
    """Fills in default folders and opens everything that the run will need; `search` as for `prepare_pairs`.

    Raises:
        UserError: anything in the config, the URDF, the prior or the motions is wrong.
    """
    config.evaluation.motions = config.evaluation.motions or default_motions()
    setup = prepare_pairs(config, search)
    build_network(config, setup.body_map)
    return Prepared(config, setup.body_map, setup.prior, setup.store, load_motions(config))


def device_of(config: Config) -> torch.device:
    """The device that `trainer.accelerator` stands for."""
    return torch.device("cuda" if config.trainer.accelerator != "cpu" and torch.cuda.is_available() else "cpu")


def make_pairs(setup: PairSetup, quiet: bool, ranks: Ranks | None = None) -> PairingReport:
    """Makes the pairs that are not there yet; several ranks share them out."""
    ranks = ranks or Ranks()
    device = ranks.device or device_of(setup.config)
    size, count = setup.store.shard_size, setup.store.count
    generator = PairGenerator(setup.body_map.to(device), setup.prior.to(device), setup.config.pairs)
    steps = setup.config.pairs.amortiser_steps
    with Progress("amortised solver", steps, "steps", quiet) as first, Progress("pairs", count, quiet=quiet) as second:

        def shards(done: int, total: int, means: dict[str, float]) -> None:
            second.total = min(total * size, count)  # of this rank
            second.update(min(done * size, count), _quality(means))

        report = generate_pairs(
            setup.config,
            generator,
            setup.store,
            lambda step, cost: first.update(step, f"mean cost {cost:.3f}"),
            shards,
            ranks,
        )
    setup.body_map.to("cpu")
    setup.prior.to("cpu")
    return report


def _quality(means: dict[str, float]) -> str:
    return f"keypoints {1000 * means['residual_m']:.1f} mm off" if "residual_m" in means else ""


def make_references(prepared: Prepared, quiet: bool) -> tuple[list[Clip], list[Clip]]:
    """Validation and test clips with the reference retargeter's joint angles."""
    folder = prepared.store.folder.parent / "reference"
    count = len(prepared.motions.all)
    with Progress("reference", count, "clips", quiet) as progress:
        return solve_references(
            prepared.config,
            prepared.body_map,
            prepared.motions,
            folder,
            lambda done, total, name: progress.update(done, name),
        )


@dataclass
class Training:
    """A trained network and what it was trained on."""

    network: RetargetNetwork
    pairs: dict[str, Tensor]
    filter: PairFilter
    best_checkpoint: Path
    best_link_cm: float


def train(
    prepared: Prepared,
    validation: list[Clip],
    logger: Logger | bool,
    checkpoints: Path,
    resume: Path | None,
    quiet: bool,
    ranks: Ranks | None = None,
    watchers: Sequence[lightning.Callback] = (),
) -> Training:
    """Trains on the pairs and returns the network of the best validation link error.

    Args:
        prepared: the checked config; its pairs are on disk.
        validation: clips that choose the checkpoint.
        logger: Lightning's logger, or False for none.
        checkpoints: folder for `last.ckpt` and the best one, written at every validation.
        resume: checkpoint to go on from, or None.
        quiet: no progress line.
        ranks: the processes that train together (DDP), each on its share of every batch; default: this one alone.
        watchers: callbacks that look at every validation.

    Raises:
        KeyboardInterrupt: the user stopped it; the last checkpoint is there.
    """
    ranks = ranks or Ranks()
    pairs = prepared.store.read_all()
    pair_filter = _filter(prepared.config, pairs)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(prepared.config.trainer.seed)
        network = build_network(prepared.config, prepared.body_map)
    data = _data(prepared.config, network, pairs, pair_filter, ranks)
    module = RetargetModule(network, prepared.config.trainer, prepared.config.model.detach_student)
    saver = ModelCheckpoint(
        dirpath=checkpoints,
        filename="best",
        monitor="val/link_cm",
        mode="min",
        save_last=True,
        save_top_k=1,
        save_on_train_epoch_end=True,
        enable_version_counter=False,
    )
    metrics = ClipMetrics(validation, prepared.body_map.robot, prepared.config.robot.key_links)
    progress = TrainingProgress(prepared.config.trainer.max_steps, _SHOWN, quiet)
    with quiet_lightning():
        trainer = _trainer(prepared.config, logger, [metrics, *watchers, progress, saver], ranks)
        run_trainer(trainer, module, resume, datamodule=data)
    best = torch.load(saver.best_model_path, map_location="cpu", weights_only=True)["state_dict"]
    network.to("cpu").load_state_dict({k.removeprefix("network."): v for k, v in best.items()})
    network.requires_grad_(False).eval()
    score = saver.best_model_score
    return Training(
        network, pairs, pair_filter, Path(saver.best_model_path), float("nan") if score is None else float(score)
    )


def _filter(config: Config, pairs: dict[str, Tensor]) -> PairFilter:
    pair_filter = make_filter(pairs["phi"], config.pairs.filter, config.pairs.filter_k, pairs["reverse"])
    if not bool((pair_filter.probability_P > 0).any()):
        raise UserError(f"pairs.filter_k: {config.pairs.filter_k} drops every pair; raise it")
    return pair_filter


@torch.no_grad()
def _data(
    config: Config, network: RetargetNetwork, pairs: dict[str, Tensor], pair_filter: PairFilter, ranks: Ranks
) -> PairData:
    settings = config.trainer
    features = torch.cat([network.features(part) for part in pairs["H"].split(16_384)])
    return PairData(
        PairTable(features, pairs["R"], pairs["q"]),
        pair_filter,
        settings.batch_size,
        min(settings.validate_every, settings.max_steps),
        settings.seed,
        (ranks.rank, ranks.count),
    )


def _trainer(
    config: Config, logger: Logger | bool, callbacks: list[lightning.Callback], ranks: Ranks
) -> lightning.Trainer:
    settings = config.trainer
    return lightning.Trainer(
        accelerator=settings.accelerator if settings.accelerator != "auto" else device_of(config).type,
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
    )


def score_test(
    prepared: Prepared, predict: Callable[[Tensor], Tensor], clips: list[Clip]
) -> tuple[list[Tensor], list[Evaluation]]:
    """Answers (T, N) of `predict` and their measures on the test clips, means over clips and over frames last."""
    predictions = [predict(clip.motion.pose_TJ6) for clip in clips]
    return predictions, evaluate_clips(predictions, clips, prepared.body_map, prepared.config.robot.key_links)
