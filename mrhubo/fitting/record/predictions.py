"""Joint angles that a trained method gave the test clips, kept with its MLflow run: pictures compare methods by them.

Legend: T frames, N robot joints.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from torch import Tensor

from mrhubo.evaluation import Clip
from mrhubo.files.arrays import DamagedFile
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.runtime.runs import log_file

if TYPE_CHECKING:
    from mrhubo.runtime.client import TrackingClient

_ARTIFACT = "test/predictions.safetensors"


def log_predictions(client: TrackingClient, run_id: str, clips: Sequence[Clip], predictions: Sequence[Tensor]) -> None:
    """Writes joint angles (T, N) [rad] of every clip to a run."""
    answers = {clip.name: q_TN.float() for clip, q_TN in zip(clips, predictions, strict=True)}
    log_file(client, run_id, _ARTIFACT, lambda path: write_tensors(path, answers, {}))


def read_predictions(client: TrackingClient, run_id: str) -> Mapping[str, Tensor]:
    """Joint angles (T, N) [rad] by clip; empty if the run has none that can be read."""
    if _ARTIFACT not in {entry.path for entry in client.list_artifacts(run_id, str(Path(_ARTIFACT).parent))}:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        try:
            return read_tensors(Path(client.download_artifacts(run_id, _ARTIFACT, folder)))[0]
        except DamagedFile:
            return {}
