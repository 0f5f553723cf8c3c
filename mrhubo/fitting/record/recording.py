"""A fit's MLflow run: opened or taken up again, and closed as finished, failed or killed."""

from __future__ import annotations

import functools
from types import TracebackType
from typing import TYPE_CHECKING

import xxhash
from PIL.Image import Image

from mrhubo.config import to_plain, to_yaml
from mrhubo.config.secrets import without_secrets
from mrhubo.fitting.preparation import Prepared
from mrhubo.fitting.record.inputs import mlflow_datasets
from mrhubo.fitting.record.naming import run_name
from mrhubo.runtime.locations import project_root
from mrhubo.runtime.names import writable
from mrhubo.runtime.provenance import git_commit, library_versions
from mrhubo.runtime.runs import close_run, log_file, take_up_run
from mrhubo.runtime.tracking import open_client
from mrhubo.runtime.workspace import Workspace
from mrhubo.view import save_png
from mrhubo.view.pictures import Artist

if TYPE_CHECKING:
    from mrhubo.runtime.client import TrackingClient
    from mrhubo.runtime.run_logger import RunLogger


class Recording:
    """One MLflow run, open inside a `with` block: finished, failed or killed at its end.

    Inside, a server that goes away stops nothing: what it does not take is kept, and sent when it answers again.
    """

    def __init__(self, prepared: Prepared, client: TrackingClient, run_id: str) -> None:
        self.prepared, self.client, self.run_id = prepared, client, run_id
        self.whole = ""
        """What is done already, for whoever is told that the server is away."""
        self.artist = Artist(prepared.body_map.robot, prepared.body_map.skeleton)
        self.provenance = _provenance(prepared)
        """What the run was made from; its tags and the package's header say the same."""

    @classmethod
    def start(cls, prepared: Prepared, workspace: Workspace, parent: str | None = None) -> Recording:
        """Opens a new run, or the unfinished one that the workspace remembers; as part of the run `parent`.

        Raises:
            UserError: the tracking server or database cannot be reached.
        """
        config = prepared.config
        tags = {
            "robot": config.robot.name,
            **_provenance(prepared),
            "config_fingerprint": prepared.fingerprint,
            "motions": prepared.motions.folder.name,
            **({"mlflow.parentRunId": parent} if parent else {}),
            **{f"version.{name}": number for name, number in library_versions().items()},
        }
        name = config.tracking.run_name or run_name(config)
        client = open_client(prepared.tracking_dir, config.tracking.experiment, config.tracking.uri)
        run, new = take_up_run(client, config.tracking.experiment, workspace, name, tags)
        client.keep_in(workspace.unsent)
        try:
            recording = cls(prepared, client, run.info.run_id)
            recording.logger.log_parameters(to_plain(without_secrets(config)), run.data.params)
            if config.robot.scale != "search":
                recording.log_inputs()
            elif new:  # the pairs are not known yet
                recording._log_config()
        except BaseException as error:
            client.patient = True  # what is wrong already counts
            close_run(client, run.info.run_id, error)
            raise
        return recording

    @property
    def logger(self) -> RunLogger:
        """For Lightning's trainer."""
        from mrhubo.runtime.run_logger import RunLogger

        return RunLogger(self.client, self.run_id)

    def __enter__(self) -> Recording:
        from mlflow.system_metrics.system_metrics_monitor import SystemMetricsMonitor

        self.client.patient = True
        self._monitor = SystemMetricsMonitor(self.run_id, resume_logging=True, tracking_uri=self.client.uri)
        self._monitor.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self.client.away:  # else it would wait for an answer; its thread has ended by itself
            self._monitor.finish()
        close_run(self.client, self.run_id, error, self.whole)

    def deliver(self) -> None:
        """Sends what was kept while the server was away.

        Raises:
            UserError: it still is.
        """
        self.client.deliver(self.whole)

    def _log_config(self) -> None:
        self.client.log_text(self.run_id, writable(to_yaml(without_secrets(self.prepared.config))), "config.yaml")

    def go_on_with(self, prepared: Prepared) -> None:
        """From here on the run is that of another config than it was opened with."""
        self.prepared, self.provenance = prepared, _provenance(prepared)
        for name, value in self.provenance.items():
            self.client.set_tag(self.run_id, name, value)
        self.log_inputs()

    def log_inputs(self) -> None:
        """The config as a file, pairs and motions as MLflow's datasets."""
        self._log_config()
        self.client.log_inputs(self.run_id, mlflow_datasets(self.prepared))

    def log_picture(self, image: Image, name: str) -> None:
        """A PNG; `name` with its folder."""
        log_file(self.client, self.run_id, name, functools.partial(save_png, image))


def _provenance(prepared: Prepared) -> dict[str, str]:
    return {
        "git_commit": git_commit(project_root()),
        "urdf_xxh3": xxhash.xxh3_64(prepared.body_map.robot.description.text).hexdigest(),
        "prior_xxh3": prepared.store.header["prior_xxh3"],
        "pairs_fingerprint": prepared.store.header["fingerprint"],
    }
