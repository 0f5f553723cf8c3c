"""What a fit writes to MLflow: settings, provenance, metrics, tables, pictures, the package."""

from __future__ import annotations

import dataclasses
import functools
import shlex
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from PIL.Image import Image
from torch import Tensor

from mrhubo.config import Config, changed_settings, to_plain, to_yaml
from mrhubo.evaluation import Clip, Evaluation, mean_metrics, run_metrics, table
from mrhubo.files.storage import checksum_file
from mrhubo.fitting.record.datasets import datasets
from mrhubo.fitting.record.predictions import log_predictions
from mrhubo.fitting.record.registry import register
from mrhubo.pairing import PairFilter, PairingReport
from mrhubo.retargeter import Retargeter
from mrhubo.runtime.locations import default_tracking, project_root
from mrhubo.runtime.tracking import (
    database_uri,
    git_commit,
    library_versions,
    log_all,
    log_file,
    open_logger,
    resumable_run,
    run_status,
)
from mrhubo.runtime.workspace import Workspace
from mrhubo.view import phi_histogram, save_gif, save_png
from mrhubo.view.pictures import GIF_RATE, Artist, liveliness

if TYPE_CHECKING:
    from lightning.pytorch.loggers import MLFlowLogger

    from mrhubo.callbacks.scale_search import ScaleResult
    from mrhubo.fitting.pipeline import Prepared


_SIZES = ("count", "max_steps", "seed")
"""Settings that lengthen or repeat a fit, rather than change what it does."""
_EXAMPLE = 8
"""Frames of a model's input example."""


class Recording:
    """One MLflow run, open inside a `with` block: finished, failed or killed at its end."""

    def __init__(self, prepared: Prepared, logger: MLFlowLogger, provenance: dict[str, str]) -> None:
        self.prepared, self.logger, self.client = prepared, logger, logger.experiment
        self.run_id = str(logger.run_id)
        self.files = self.folder(prepared.config) / "packages" / f"{prepared.config.robot.name}-{self.run_id[:8]}"
        self.artist = Artist(prepared.body_map.robot, prepared.body_map.skeleton)
        self.provenance = provenance

    @staticmethod
    def folder(config: Config) -> Path:
        """Folder of the tracking database, the packages, and unfinished fits."""
        return config.tracking.dir or default_tracking()

    @classmethod
    def start(cls, prepared: Prepared, workspace: Workspace, parent: str | None = None) -> Recording:
        """Opens a new run, or the unfinished one that the workspace remembers; as part of the run `parent`."""
        config, folder = prepared.config, cls.folder(prepared.config)
        run_id = resumable_run(folder, config.tracking.uri, workspace.run_id)
        provenance = _provenance(prepared)
        tags = {
            "robot": config.robot.name,
            **provenance,
            "config_fingerprint": prepared.fingerprint,
            "motions": prepared.motions.folder.name,
            **({"mlflow.parentRunId": parent} if parent else {}),
            **{f"version.{name}": number for name, number in library_versions().items()},
        }
        name = config.tracking.run_name or run_name(config)
        logger = open_logger(folder, config.tracking.experiment, name, tags, config.tracking.uri, run_id)
        recording = cls(prepared, logger, provenance)
        workspace.start(recording.run_id)
        if run_id is None:
            logger.log_hyperparams(to_plain(config))
            recording.client.log_text(recording.run_id, to_yaml(config), "config.yaml")
            if config.robot.scale != "search":  # else the pairs are not known yet
                recording.client.log_inputs(recording.run_id, datasets(prepared))
        else:
            recording.client.set_tag(recording.run_id, "resumed", time.strftime("%Y-%m-%d %H:%M:%S"))
            if "ended_by" in recording.client.get_run(recording.run_id).data.tags:
                recording.client.delete_tag(recording.run_id, "ended_by")
        return recording

    def __enter__(self) -> Recording:
        from mlflow.system_metrics.system_metrics_monitor import SystemMetricsMonitor

        self.resume_after_training()
        uri = self.prepared.config.tracking.uri or database_uri(self.folder(self.prepared.config))
        self._monitor = SystemMetricsMonitor(self.run_id, resume_logging=True, tracking_uri=uri)
        self._monitor.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._monitor.finish()
        finally:  # Lightning's logger has called an interrupted run failed; whatever else goes wrong, that is put right
            self.client.set_terminated(self.run_id, run_status(error))
        if error is not None:
            self.client.set_tag(self.run_id, "ended_by", f"{type(error).__name__}: {error}"[:500])

    def resume_after_training(self) -> None:
        """Lightning's logger closes the run when the training ends; the test is still to come."""
        self.client.update_run(self.run_id, status="RUNNING")

    def scale(self, prepared: Prepared, found: ScaleResult) -> None:
        """The scale factor that was found: from here on the run is that of `prepared`."""
        self.prepared, self.provenance = prepared, _provenance(prepared)
        for name, value in self.provenance.items():
            self.client.set_tag(self.run_id, name, value)
        log_all(self.client, self.run_id, {}, {f"scale_factor/{k}": value for k, value in found.values.items()})
        self.client.log_text(self.run_id, to_yaml(prepared.config), "config.yaml")
        self.client.log_inputs(self.run_id, datasets(prepared))
        for name, picture in found.pictures.items():
            self._picture(picture, f"scale/{name}.png")

    def pairs(self, pairs: dict[str, Tensor], pair_filter: PairFilter, report: PairingReport) -> None:
        """Metrics and pictures of the pairs."""
        count, reverse_P = len(pairs["phi"]), pairs["reverse"]
        metrics = {"pairs/count": float(count), "pairs/reverse_share": float(reverse_P.float().mean())}
        if bool(reverse_P.any()):
            metrics["pairs/reverse_residual_mm"] = 1000 * float(pairs["residual_m"][reverse_P].mean())
        if not bool(reverse_P.all()):  # phi and the filter are about the human poses that were made for robot poses
            pairs = {name: tensor[~reverse_P] for name, tensor in pairs.items()}
            pair_filter = PairFilter(pair_filter.probability_P[~reverse_P], pair_filter.threshold)
        metrics |= {
            "pairs/kept_share": pair_filter.kept_share,
            "pairs/mean_probability": float(pair_filter.probability_P.mean()),
            "pairs/ik_cost": float(pairs["cost"].mean()),
            "pairs/ik_residual_mm": 1000 * float(pairs["residual_m"].mean()),
            "pairs/phi_mean": float(pairs["phi"].mean()),
            "pairs/phi_threshold": pair_filter.threshold,
        }
        if report.made:
            metrics["pairs/per_second"] = report.made / report.seconds
        self.logger.log_metrics(metrics)
        self._picture(phi_histogram(pairs["phi"].numpy(), pair_filter.threshold), "pairs/phi_histogram.png")
        self._picture(self.artist.pairs(pairs, pair_filter, self.prepared.prior), "pairs/feasible_and_extreme.png")

    def scores(
        self,
        scores: Sequence[Evaluation],
        latency: Mapping[str, float],
        retarget: Sequence[Evaluation],
        retarget_latency: Mapping[str, float],
        best_link_cm: float,
    ) -> None:
        """What `evaluate_clips` and `latencies` gave for the test clips, of the networks alone and of `retarget`:
        metrics and a table.
        """
        metrics = run_metrics(scores, latency) | mean_metrics(retarget, retarget_latency, "test/retarget")
        self.logger.log_metrics({"val/best_link_cm": best_link_cm, **metrics})
        rows = [dataclasses.asdict(score) for score in scores]
        self.client.log_table(self.run_id, {key: [row[key] for row in rows] for key in rows[0]}, "test/clips.json")
        self.client.log_text(self.run_id, table(scores, retarget) + "\n", "test/clips.txt")

    def key_poses(self, clips: Sequence[Clip], predictions: Sequence[Tensor]) -> None:
        """The answers themselves, and a picture a test clip: human, reference and prediction."""
        log_predictions(self.client, self.run_id, clips, predictions)
        for clip, prediction in zip(clips, predictions, strict=True):
            self._picture(self.artist.key_poses(clip, {"mrhubo": prediction}), f"test/key_poses_{clip.name}.png")

    def animation(self, clips: Sequence[Clip], predictions: Sequence[Tensor]) -> None:
        """A GIF of the liveliest test clip."""
        clip, prediction = max(zip(clips, predictions, strict=True), key=lambda pair: liveliness(pair[0]))
        frames = self.artist.animation(clip, {"mrhubo": prediction})
        write = functools.partial(save_gif, frames, frame_rate=GIF_RATE)
        log_file(self.client, self.run_id, f"test/{clip.name}.gif", write)

    def package(self, retargeter: Retargeter, score: Evaluation, checkpoint: Path) -> Path:
        """Writes the package to `mlruns/packages`, and package and checkpoint to the run; returns the folder."""
        provenance = {
            "run_id": self.run_id,
            **self.provenance,
            "test_joint_rad": f"{score.joint_rad:.6f}",
            "test_link_cm": f"{score.link_cm:.6f}",
        }
        folder = retargeter.save(self.files, provenance)
        self.client.log_artifacts(self.run_id, str(folder), "package")
        self.client.log_artifact(self.run_id, str(checkpoint), "checkpoint")
        return folder

    def register(self, retargeter: Retargeter, score: Evaluation, clip: Clip) -> str:
        """Makes the package a version of the robot's model, with the start of a clip as the example.

        Returns:
            the version's URI, or why there is none: a server without a registry ends no fit.
        """
        tags = {
            "run_id": self.run_id,
            **self.provenance,
            "test_joint_rad": f"{score.joint_rad:.4f}",
            "test_link_cm": f"{score.link_cm:.3f}",
        }
        try:
            return register(self.client, self.run_id, self.files, retargeter, clip.motion.pose_TJ6[:_EXAMPLE], tags)
        except Exception as error:  # MLflow's own, the network's, the database's
            return f"not registered: {type(error).__name__}: {' '.join(str(error).split())[:200]}"

    def _picture(self, image: Image, name: str) -> None:
        log_file(self.client, self.run_id, name, functools.partial(save_png, image))


def _provenance(prepared: Prepared) -> dict[str, str]:
    """What a run was made from; the run's tags and the package's header say the same."""
    return {
        "git_commit": git_commit(project_root()),
        "urdf_xxh3": checksum_file(prepared.config.robot.urdf),
        "prior_xxh3": prepared.store.header["prior_xxh3"],
        "pairs_fingerprint": prepared.store.header["fingerprint"],
    }


def run_name(config: Config) -> str:
    """The robot's name and the settings that differ from the defaults: `nao stages=1 filter=none`."""
    sections = (config.body, config.pairs, config.model, config.trainer)
    changed = {name: value for section in sections for name, value in changed_settings(section).items()}
    changed.pop("workers", None)  # the result does not depend on it
    if config.robot.scale != "auto":
        changed["scale"] = config.robot.scale
    changed |= {name: changed.pop(name) for name in _SIZES if name in changed}  # last: tables cut long names off
    return " ".join([config.robot.name, *(f"{name}={value}" for name, value in changed.items())])


def dashboard_command(folder: Path, config: Config) -> str:
    """The command that opens the dashboard, on this machine only, light (one worker, no job runner)."""
    uri = shlex.quote(config.tracking.uri or database_uri(folder))
    command = f"{shlex.quote(sys.executable)} -m mlflow ui --backend-store-uri {uri} --host 127.0.0.1 --workers 1"
    return f"MLFLOW_SERVER_ENABLE_JOB_EXECUTION=false {command}"
