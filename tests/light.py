"""What small fits do without where it is not looked at: it takes most of their time, and has tests of its own."""

from __future__ import annotations

import functools
import sqlite3
from typing import Any

import numpy as np
import pytest
from PIL.Image import Image, new


def _leave_to_the_disk(connection: Any, _: object) -> None:
    if isinstance(connection, sqlite3.Connection):
        connection.execute("PRAGMA synchronous = OFF")


_drawn: list[Image] = []


def _first_histogram(phi: np.ndarray, threshold: float) -> Image:
    from mrhubo.view import phi_histogram

    if not _drawn:
        _drawn.append(phi_histogram(phi, threshold))
    return _drawn[0]


def lighten(patch: pytest.MonkeyPatch) -> None:
    """Confidence is calibrated on few poses, a frame's time is taken once and of few frames at a time, figures in
    pictures and pictures of studies are blank, a process draws one picture of pairs' errors, pages show a moment,
    MLflow does not compare the installed versions with those that it has just been told, and databases, from now on, do
    not wait until the disk has what they have written, which a killed process leaves whole.
    """
    import mlflow.utils.environment as environment
    from sqlalchemy import event
    from sqlalchemy.engine import Engine

    from mrhubo.evaluation import latency
    from mrhubo.fitting import fit, measurement
    from mrhubo.fitting.record import moving, pairs
    from mrhubo.search import plots
    from mrhubo.view import figures, pictures

    patch.setattr(fit, "calibrate", functools.partial(fit.calibrate, poses=200))
    patch.setattr(measurement, "latencies", functools.partial(measurement.latencies, seconds=0.0))
    patch.setattr(latency, "_MANY", 20)
    patch.setattr(environment, "warn_dependency_requirement_mismatches", lambda requirements: None)
    patch.setattr(pictures, "GIF_RATE", 1.0)
    patch.setattr(moving, "PAGE_SECONDS", 0.1)
    patch.setattr(figures, "render", lambda solids, size, *_, **__: new("RGB", size))
    patch.setattr(plots, "_image", lambda axes, width=8.0: (plots.close(axes), new("RGB", (80, 45)))[1])
    patch.setattr(pairs, "phi_histogram", _first_histogram)
    if not event.contains(Engine, "connect", _leave_to_the_disk):
        event.listen(Engine, "connect", _leave_to_the_disk)


def lighten_pairs(patch: pytest.MonkeyPatch) -> None:
    """The amortised solver learns from few robot poses: in tests it takes ten steps, and what it needs besides them
    took most of their time. Processes whose pairs are compared all need this.
    """
    from mrhubo.pairing import amortiser

    for name, value in {"_BATCH": 32, "_BLOCK": 8, "_CONDITIONED_ON": 256, "_MEASURED_ON": 32}.items():
        patch.setattr(amortiser, name, value)
