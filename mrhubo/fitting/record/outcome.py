"""What a fit came to, in its run: measures of the test clips, answers and their pictures.

Legend: T frames, N robot joints.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from torch import Tensor

from mrhubo.evaluation import Clip, Evaluation
from mrhubo.fitting.first_look import FirstLook
from mrhubo.fitting.measurement import Measured
from mrhubo.fitting.record.moving import log_moving
from mrhubo.fitting.record.predictions import log_predictions
from mrhubo.fitting.record.recording import Recording
from mrhubo.runtime.progress import Reporter
from mrhubo.view.pictures import liveliness

_TABLE = "test/clips.json"
_DIGITS = 10
"""After the point."""


def log_look(recording: Recording, look: FirstLook) -> None:
    """What the reference made of the mapping before the fit."""
    recording.logger.log_metrics(look.metrics)
    recording.client.log_text(recording.run_id, "\n".join([str(look), *look.doubts]) + "\n", "mapping.txt")


def log_measures(recording: Recording, measured: Measured, best_link_cm: float) -> None:
    """Metrics and a table of the test clips; `best_link_cm` is the validation link error of the
    checkpoint that was taken.
    """
    networks = measured.networks
    recording.logger.log_metrics({"val/best_link_cm": best_link_cm, **measured.metrics})
    log_rows(recording, [_row(score) for score in networks])
    recording.client.log_text(recording.run_id, measured.table + "\n", "test/clips.txt")


def _row(score: Evaluation) -> dict[str, Any]:
    """A score's numbers, a joint's share at a limit among them each in a column of its own."""
    row = dataclasses.asdict(score)
    shares = row.pop("joints_at_limit")
    return {**row, **{f"at a limit: {joint}": share for joint, share in shares}}


def log_rows(recording: Recording, rows: Sequence[Mapping[str, Any]]) -> None:
    """A table that the dashboard shows; unlike MLflow's own `log_table` it replaces that of a broken-off start."""
    values = [[_written(value) for value in row.values()] for row in rows]
    recording.client.log_text(recording.run_id, json.dumps({"columns": list(rows[0]), "data": values}), _TABLE)
    shown = json.dumps([{"path": _TABLE, "type": "table"}])
    recording.client.set_tag(recording.run_id, "mlflow.loggedArtifacts", shown)


def _written(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, _DIGITS) if math.isfinite(value) else None
    return value


def log_answers(recording: Recording, report: Reporter, clips: Sequence[Clip], predictions: Sequence[Tensor]) -> None:
    """Joint angles (T, N) [rad] of the test clips, a picture a clip of human, reference and prediction, and the
    liveliest in motion.
    """
    log_predictions(recording.client, recording.run_id, clips, predictions)
    for clip, q_TN in zip(clips, predictions, strict=True):
        sheet = recording.artist.key_poses(clip, {"mrhubo": q_TN})
        recording.log_picture(sheet, f"test/key_poses_{clip.name}.png")
    log_moving(recording, report, *max(zip(clips, predictions, strict=True), key=lambda pair: liveliness(pair[0])))
