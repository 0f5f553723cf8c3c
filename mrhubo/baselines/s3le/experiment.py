"""S3LE trained, measured and tracked as a fit is."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from mrhubo.baselines.s3le.model import S3LE
from mrhubo.baselines.s3le.training import S3LEData, human_directions, make_data, train_s3le
from mrhubo.body.prior_training.poses import load_training_poses, plausible_frames
from mrhubo.config import BaselineConfig, S3LEConfig, to_plain
from mrhubo.errors import UserError
from mrhubo.evaluation import Clip, evaluate_clips, latencies, mean_score, run_metrics, score_clip, table
from mrhubo.fitting.measurement import refuse_useless
from mrhubo.fitting.preparation import Prepared, make_places, prepare
from mrhubo.fitting.record import log_predictions
from mrhubo.fitting.references import make_references
from mrhubo.rotation import stack_columns
from mrhubo.runtime.locations import default_capture, project_root
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.provenance import git_commit
from mrhubo.runtime.runs import ending, log_all, start_run
from mrhubo.runtime.tracking import open_client

if TYPE_CHECKING:
    from mrhubo.runtime.client import TrackingClient

_MAX_EXCESS_DEG = 10.0
"""Frames in which a joint is further outside its anatomical range are defects of the recording."""


def capture_of(config: BaselineConfig) -> Path:
    """The file of human motion capture that S3LE learns from.

    Raises:
        UserError: it is not there.
    """
    path = config.s3le.poses or default_capture()
    if not path.is_file():
        raise UserError(f"s3le.poses: {path} does not exist; the baseline learns from human motion capture")
    return path


@dataclass
class Baseline:
    """Everything that is the same for all settings of S3LE."""

    prepared: Prepared
    data: S3LEData
    validation: list[Clip]
    test: list[Clip]

    @classmethod
    def open(cls, config: BaselineConfig, report: Reporter) -> Baseline:
        """Reads motions and motion capture, and makes the glue pairs.

        Raises:
            UserError: a file is missing or cannot be used, or the config is wrong.
        """
        prepared, path = prepare(config), capture_of(config)
        make_places(prepared)
        pose_FJ6 = load_training_poses(path)[0]
        generator = torch.Generator().manual_seed(config.s3le.seed)
        chosen = pose_FJ6[torch.randint(len(pose_FJ6), (2 * config.s3le.glue,), generator=generator)]
        chosen = chosen[plausible_frames(chosen, _MAX_EXCESS_DEG)][: config.s3le.glue]
        if not len(chosen):
            raise UserError(f"s3le.poses: {path} holds no pose that a human can strike")
        data = make_data(prepared.body_map, stack_columns(chosen), config.s3le, report)
        validation, test = make_references(prepared, report)
        return cls(prepared, data, validation, test)

    @functools.cached_property
    def client(self) -> TrackingClient:
        """Where runs are kept."""
        tracking = self.prepared.config.tracking
        return open_client(self.prepared.tracking_dir, tracking.experiment, tracking.uri)

    def train(self, settings: S3LEConfig, report: Reporter) -> S3LE:
        """A trained model."""
        return train_s3le(self.prepared.body_map, self.data, settings, report)

    def predict(self, model: S3LE, settings: S3LEConfig, clips: Sequence[Clip]) -> list[Tensor]:
        """Joint angles (T, N) for each clip."""
        return [self.answer(model, settings, clip.motion.local_TJ33) for clip in clips]

    def answer(self, model: S3LE, settings: S3LEConfig, local_TJ33: Tensor) -> Tensor:
        """Joint angles (T, N) of human poses (T, 21, 3, 3)."""
        codes = model.human_codes(human_directions(self.prepared.body_map, local_TJ33))
        return model.answer(codes, settings.neighbours, settings.width, self.data.collision)

    def validation_link_cm(self, model: S3LE, settings: S3LEConfig) -> float:
        """Mean link error on the validation clips."""
        robot, links = self.prepared.body_map.robot, self.prepared.config.robot.key_links
        predictions = self.predict(model, settings, self.validation)
        scores = [score_clip(c, q_TN, robot, links) for c, q_TN in zip(self.validation, predictions, strict=True)]
        return mean_score(scores).link_cm


def run_baseline(config: BaselineConfig, report: Reporter = SILENT, parent: str | None = None) -> str:
    """Trains S3LE, measures it on the test clips, tracks it, and returns the table.

    Raises:
        UserError: a file is missing or cannot be used, or the config is wrong.
    """
    baseline = Baseline.open(config, report)
    client, tags = baseline.client, {"config_fingerprint": baseline.prepared.fingerprint}
    run = open_run(baseline, config.s3le, parent, "S3LE", tags)
    with ending(client, run):
        model = baseline.train(config.s3le, report)
        predictions = baseline.predict(model, config.s3le, baseline.test)
        scores = evaluate_clips(predictions, baseline.test, baseline.prepared.body_map, config.robot.key_links)
        latency = latencies(functools.partial(baseline.answer, model, config.s3le), baseline.test)
        best_link_cm = baseline.validation_link_cm(model, config.s3le)
        log_all(client, run, {"val/best_link_cm": best_link_cm, **run_metrics(scores, latency)})
        log_predictions(client, run, baseline.test, predictions)
        client.log_text(run, table(scores) + "\n", "test/clips.txt")
        robot, remedy = baseline.prepared.body_map.robot, f"a lower s3le.lr than {config.s3le.lr:g} helps"
        refuse_useless(baseline.test, predictions, robot, remedy)
    return table(scores)


def open_run(baseline: Baseline, settings: S3LEConfig, parent: str | None, name: str, tags: Mapping[str, str]) -> str:
    """The id of a new run with these settings and tags, as part of the run `parent`."""
    config, client = baseline.prepared.config, baseline.client
    tags = {
        "robot": config.robot.name,
        "method": "S3LE",
        "git_commit": git_commit(project_root()),
        **({"mlflow.parentRunId": parent} if parent else {}),
        **tags,
    }
    run = start_run(client, config.tracking.experiment, f"{config.robot.name} {name}", tags).info.run_id
    log_all(client, run, {}, {f"s3le/{key}": value for key, value in to_plain(settings).items()})
    return run
