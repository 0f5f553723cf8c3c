"""A fit's MLflow run: opened or taken up again, and closed as finished, failed or killed."""

from __future__ import annotations

import functools
import time
from types import TracebackType
from typing import TYPE_CHECKING

from PIL.Image import Image

from mrhubo.config import to_plain, to_yaml
from mrhubo.files.storage import checksum_file
from mrhubo.fitting.preparation import Prepared
from mrhubo.fitting.record.inputs import mlflow_datasets
from mrhubo.fitting.record.naming import run_name
from mrhubo.runtime.locations import project_root
from mrhubo.runtime.tracking import (
    database_uri,
    git_commit,
    library_versions,
    log_file,
    open_logger,
    resumable_run,
    run_status,
)
from mrhubo.runtime.workspace import Workspace
from mrhubo.view import save_png
from mrhubo.view.pictures import Artist

if TYPE_CHECKING:
    from lightning.pytorch.loggers import MLFlowLogger


class Recording:
    """One MLflow run, open inside a `with` block: finished, failed or killed at its end."""

    def __init__(self, prepared: Prepared, logger: MLFlowLogger) -> None:
        self.prepared, self.logger, self.client = prepared, logger, logger.experiment
        self.run_id = str(logger.run_id)
        self.artist = Artist(prepared.body_map.robot, prepared.body_map.skeleton)
        self.provenance = _provenance(prepared)
        """What the run was made from; its tags and the package's header say the same."""

    @classmethod
    def start(cls, prepared: Prepared, workspace: Workspace, parent: str | None = None) -> Recording:
        """Opens a new run, or the unfinished one that the workspace remembers; as part of the run `parent`."""
        config, folder = prepared.config, prepared.tracking_dir
        run_id = resumable_run(folder, config.tracking.uri, workspace.run_id)
        tags = {
            "robot": config.robot.name,
            **_provenance(prepared),
            "config_fingerprint": prepared.fingerprint,
            "motions": prepared.motions.folder.name,
            **({"mlflow.parentRunId": parent} if parent else {}),
            **{f"version.{name}": number for name, number in library_versions().items()},
        }
        name = config.tracking.run_name or run_name(config)
        logger = open_logger(folder, config.tracking.experiment, name, tags, config.tracking.uri, run_id)
        recording = cls(prepared, logger)
        workspace.start(recording.run_id)
        if run_id is None:
            logger.log_hyperparams(to_plain(config))
            if config.robot.scale == "search":  # the pairs are not known yet
                recording.client.log_text(recording.run_id, to_yaml(config), "config.yaml")
            else:
                recording.log_inputs()
        else:
            recording.client.set_tag(recording.run_id, "resumed", time.strftime("%Y-%m-%d %H:%M:%S"))
            if "ended_by" in recording.client.get_run(recording.run_id).data.tags:
                recording.client.delete_tag(recording.run_id, "ended_by")
        return recording

    def __enter__(self) -> Recording:
        from mlflow.system_metrics.system_metrics_monitor import SystemMetricsMonitor

        self.resume_after_training()
        uri = self.prepared.config.tracking.uri or database_uri(self.prepared.tracking_dir)
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

    def go_on_with(self, prepared: Prepared) -> None:
        """From here on the run is that of another config than it was opened with."""
        self.prepared, self.provenance = prepared, _provenance(prepared)
        for name, value in self.provenance.items():
            self.client.set_tag(self.run_id, name, value)
        self.log_inputs()

    def log_inputs(self) -> None:
        """The config as a file, pairs and motions as MLflow's datasets."""
        self.client.log_text(self.run_id, to_yaml(self.prepared.config), "config.yaml")
        self.client.log_inputs(self.run_id, mlflow_datasets(self.prepared))

    def log_picture(self, image: Image, name: str) -> None:
        """A PNG; `name` with its folder."""
        log_file(self.client, self.run_id, name, functools.partial(save_png, image))


def _provenance(prepared: Prepared) -> dict[str, str]:
    return {
        "git_commit": git_commit(project_root()),
        "urdf_xxh3": checksum_file(prepared.config.robot.urdf),
        "prior_xxh3": prepared.store.header["prior_xxh3"],
        "pairs_fingerprint": prepared.store.header["fingerprint"],
    }
