"""S3LE trained, measured and tracked as a fit is, and the search of its settings."""

from __future__ import annotations

import copy
import functools
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mrhubo.config import BaselineConfig, S3LEConfig, fingerprint, to_plain
from mrhubo.errors import UserError

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from torch import Tensor

    from mrhubo.baselines.s3le.model import S3LE
    from mrhubo.baselines.s3le.training import S3LEData
    from mrhubo.evaluation import Clip
    from mrhubo.fitting.pipeline import Prepared

NEIGHBOURS, WIDTHS = (1, 3, 10, 30, 100), (0.2, 0.5, 1.0)


@dataclass
class Baseline:
    """Everything that is the same for all settings of S3LE."""

    prepared: Prepared
    data: S3LEData
    validation: list[Clip]
    test: list[Clip]

    @classmethod
    def open(cls, config: BaselineConfig, quiet: bool = False) -> Baseline:
        """Reads motions and motion capture, and makes the glue pairs.

        Raises:
            UserError: a file is missing or cannot be used, or the config is wrong.
        """
        import torch

        from mrhubo.baselines.s3le.training import make_data
        from mrhubo.body.prior_training.poses import load_training_poses, plausible_frames
        from mrhubo.fitting import pipeline
        from mrhubo.runtime.locations import default_capture
        from mrhubo.runtime.progress import Progress

        prepared = pipeline.prepare(config)
        path = config.s3le.poses or default_capture()
        if not path.is_file():
            raise UserError(f"s3le.poses: {path} does not exist; the baseline learns from human motion capture")
        pose_FJ6 = load_training_poses(path)[0]
        generator = torch.Generator().manual_seed(config.s3le.seed)
        chosen = pose_FJ6[torch.randint(len(pose_FJ6), (2 * config.s3le.glue,), generator=generator)]
        chosen = chosen[plausible_frames(chosen, 10.0)][: config.s3le.glue]
        if not len(chosen):
            raise UserError(f"s3le.poses: {path} holds no pose that a human can strike")
        with Progress("glue pairs", len(chosen), quiet=quiet) as progress:
            data = make_data(prepared.body_map, chosen, config.s3le, progress.update)
        validation, test = pipeline.make_references(prepared, quiet)
        return cls(prepared, data, validation, test)

    @functools.cached_property
    def client(self) -> MlflowClient:
        """Where runs are kept."""
        from mrhubo.fitting.record.recording import Recording
        from mrhubo.runtime.tracking import open_client

        config = self.prepared.config
        return open_client(Recording.folder(config), config.tracking.experiment, config.tracking.uri)

    def train(self, settings: S3LEConfig, quiet: bool = False) -> S3LE:
        """A trained model."""
        from mrhubo.baselines.s3le.training import train_s3le
        from mrhubo.runtime.progress import Progress

        with Progress("S3LE", settings.steps, "steps", quiet) as progress:
            return train_s3le(self.prepared.body_map, self.data, settings, progress.update)

    def predict(self, model: S3LE, settings: S3LEConfig, clips: Sequence[Clip]) -> list[Tensor]:
        """Joint angles (T, N) for each clip."""
        return [self.answer(model, settings, clip.motion.pose_TJ6) for clip in clips]

    def answer(self, model: S3LE, settings: S3LEConfig, pose_TJ6: Tensor) -> Tensor:
        """Joint angles (T, N) of human poses (T, 21, 6)."""
        codes = model.human_codes(self.prepared.body_map.human_directions(pose_TJ6))
        return model.answer(codes, settings.neighbours, settings.width, self.data.collision)

    def validation_link_cm(self, model: S3LE, settings: S3LEConfig) -> float:
        """Mean link error on the validation clips."""
        from mrhubo.evaluation import mean_score, score_clip

        robot, links = self.prepared.body_map.robot, self.prepared.config.robot.key_links
        predictions = self.predict(model, settings, self.validation)
        scores = [score_clip(c, q_TN, robot, links) for c, q_TN in zip(self.validation, predictions, strict=True)]
        return mean_score(scores).link_cm


def run_baseline(config: BaselineConfig, quiet: bool = False, parent: str | None = None) -> str:
    """Trains S3LE, measures it on the test clips, tracks it, and returns the table."""
    from mrhubo.evaluation import evaluate_clips, latencies, run_metrics, table
    from mrhubo.fitting.record.predictions import log_predictions
    from mrhubo.runtime.tracking import ending, log_all

    baseline = Baseline.open(config, quiet)
    client = baseline.client
    run = _open_run(baseline, config.s3le, parent, "S3LE")
    with ending(client, run):
        model = baseline.train(config.s3le, quiet)
        predictions = baseline.predict(model, config.s3le, baseline.test)
        scores = evaluate_clips(predictions, baseline.test, baseline.prepared.body_map, config.robot.key_links)
        latency = latencies(functools.partial(baseline.answer, model, config.s3le), baseline.test)
        best_link_cm = baseline.validation_link_cm(model, config.s3le)
        log_all(client, run, {"val/best_link_cm": best_link_cm, **run_metrics(scores, latency)})
        log_predictions(client, run, baseline.test, predictions)
        client.log_text(run, table(scores) + "\n", "test/clips.txt")
    return table(scores)


def search(config: BaselineConfig, trials: int, quiet: bool = False) -> str:
    """Random settings on the validation clips; the best first, as overrides of `config`."""
    from mrhubo.runtime.tracking import ending, find_run, log_all

    baseline = Baseline.open(config, quiet)
    client, found = baseline.client, []
    for trial in range(trials):
        settings = draw_settings(config.s3le, trial)
        tags = {"s3le_trial": fingerprint([baseline.prepared.fingerprint, to_plain(settings)])}
        run = find_run(client, config.tracking.experiment, tags, finished=True)
        if run is None:
            run_id = _open_run(baseline, settings, None, f"S3LE, trial {trial}", tags)
            with ending(client, run_id):
                model = baseline.train(settings, quiet)
                metrics = {}
                for neighbours in NEIGHBOURS:
                    for width in WIDTHS if neighbours > 1 else WIDTHS[:1]:
                        settings.neighbours, settings.width = neighbours, width
                        link_cm = baseline.validation_link_cm(model, settings)
                        metrics[f"val/link_cm_{neighbours}_{width}"] = link_cm
                log_all(client, run_id, metrics)
            run = client.get_run(run_id)
        errors = {name: v for name, v in run.data.metrics.items() if name.startswith("val/link_cm_")}
        best = min(errors, key=lambda name: errors[name])
        neighbours, width = best.removeprefix("val/link_cm_").split("_")
        changed = {name: run.data.params[f"s3le/{name}"] for name in _SEARCHED}
        changed |= {"neighbours": neighbours, "width": width}
        found.append((errors[best], " ".join(f"s3le.{name}={value}" for name, value in changed.items())))
        if not quiet:
            print(f"trial {trial}: {errors[best]:.3f} cm", flush=True)
    return "\n".join(f"{link_cm:.3f} cm  {overrides}" for link_cm, overrides in sorted(found))


_SEARCHED = ("latent", "normal_weight", "pair_weight", "projection_weight", "lr", "beyond")


def draw_settings(base: S3LEConfig, trial: int) -> S3LEConfig:
    """Settings of one trial; the same for the same seed and trial."""
    draw, settings = random.Random(base.seed * 1_000_003 + trial), copy.deepcopy(base)

    def logarithmic(low: float, high: float) -> float:
        return float(f"{math.exp(draw.uniform(math.log(low), math.log(high))):.3g}")

    settings.latent = draw.choice([8, 16, 32, 64])
    settings.normal_weight = logarithmic(1e-3, 1.0)
    settings.pair_weight = logarithmic(1.0, 100.0)
    settings.projection_weight = logarithmic(0.1, 100.0)
    settings.lr = logarithmic(3e-4, 3e-3)
    settings.beyond = round(draw.uniform(0.0, 0.5), 2)
    return settings


def _open_run(
    baseline: Baseline, settings: S3LEConfig, parent: str | None, name: str, trial: dict[str, str] | None = None
) -> str:
    from mrhubo.runtime.locations import project_root
    from mrhubo.runtime.tracking import git_commit, log_all, start_run

    config, client = baseline.prepared.config, baseline.client
    tags = {
        "robot": config.robot.name,
        "method": "S3LE",
        "git_commit": git_commit(project_root()),
        **({"mlflow.parentRunId": parent} if parent else {}),
        **(trial or {"config_fingerprint": baseline.prepared.fingerprint}),
    }
    run = start_run(client, config.tracking.experiment, f"{config.robot.name} {name}", tags).info.run_id
    log_all(client, run, {}, {f"s3le/{key}": value for key, value in to_plain(settings).items()})
    return run
