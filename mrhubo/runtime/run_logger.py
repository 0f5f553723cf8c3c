"""Lightning's metrics in an MLflow run that is open already.

Lightning's own logger opens and closes runs by itself, and stops the training where the server does not answer.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from lightning.pytorch.loggers.logger import Logger
from mlflow.entities import Param

from mrhubo.runtime.client import TrackingClient
from mrhubo.runtime.names import parameters
from mrhubo.runtime.runs import log_all

_AT_ONCE = 100
"""Parameters that MLflow takes in one go."""


class RunLogger(Logger):
    """Writes to one run; whoever opened it closes it."""

    def __init__(self, client: TrackingClient, run_id: str) -> None:
        super().__init__()
        self.experiment, self.run_id = client, run_id

    @property
    def name(self) -> str:
        """Of the program."""
        return "mrhubo"

    @property
    def version(self) -> str:
        """The id of the run."""
        return self.run_id

    def log_metrics(self, metrics: Mapping[str, float], step: int | None = None) -> None:
        """All of them in one go."""
        log_all(self.experiment, self.run_id, metrics, step=step or 0)

    def log_parameters(self, plain: Mapping[str, Any], there: Mapping[str, str]) -> None:
        """Nested plain values as parameters, but for those that are there: a start may have been killed anywhere."""
        found = parameters(plain)
        missing = [Param(name, value) for name, value in found.items() if name not in there]
        for first in range(0, len(missing), _AT_ONCE):
            self.experiment.log_batch(self.run_id, params=missing[first : first + _AT_ONCE])

    def log_hyperparams(self, params: dict[str, Any] | Namespace, *_: Any, **__: Any) -> None:
        """Nothing: whoever opened the run has written the settings."""
