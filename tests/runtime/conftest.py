"""Tracking folders, and MLflow on bad days."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from mrhubo.runtime.client import TrackingClient
from mrhubo.runtime.tracking import open_client


@pytest.fixture
def folder(empty_tracking: Path, tmp_path: Path) -> Path:
    """A tracking folder of its own, with a database of no runs."""
    return Path(shutil.copytree(empty_tracking, tmp_path / "mlruns"))


@pytest.fixture
def opened(folder: Path) -> TrackingClient:
    """Its client."""
    return open_client(folder, "mrhubo")


@pytest.fixture
def fail(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Lets methods of MLflow's client raise, each for so many calls (default: for ever): `fail(error, "log_batch")`."""
    import mlflow

    def make(error: Exception, *names: str, times: int = 10**9) -> None:
        for name in names:
            method, left = getattr(mlflow.MlflowClient, name), [times]

            def failing(self: object, *given: object, method=method, left: list[int] = left, **named: object) -> object:
                if left[0] > 0:
                    left[0] -= 1
                    raise error
                return method(self, *given, **named)

            monkeypatch.setattr(mlflow.MlflowClient, name, failing)

    return make
