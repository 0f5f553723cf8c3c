"""What a fit came to, in its run: measures of the test clips, answers and their pictures.

Legend: T frames, N robot joints.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

from torch import Tensor

from mrhubo.evaluation import Clip, mean_metrics, run_metrics
from mrhubo.fitting.measurement import Measured
from mrhubo.fitting.record.predictions import log_predictions
from mrhubo.fitting.record.recording import Recording
from mrhubo.runtime.tracking import log_file
from mrhubo.view import pictures, save_gif


def log_measures(recording: Recording, measured: Measured, best_link_cm: float) -> None:
    """Metrics and a table of the test clips; `best_link_cm` is the best validation link error."""
    client, run_id, networks = recording.client, recording.run_id, measured.networks
    metrics = run_metrics(networks, measured.networks_latency)
    metrics |= mean_metrics(measured.retarget, measured.retarget_latency, "test/retarget")
    recording.logger.log_metrics({"val/best_link_cm": best_link_cm, **metrics})
    rows = [dataclasses.asdict(score) for score in networks]
    client.log_table(run_id, {key: [row[key] for row in rows] for key in rows[0]}, "test/clips.json")
    client.log_text(run_id, measured.table + "\n", "test/clips.txt")


def log_answers(recording: Recording, clips: Sequence[Clip], predictions: Sequence[Tensor]) -> None:
    """Joint angles (T, N) [rad] of the test clips, a picture a clip of human, reference and prediction, and a GIF of
    the liveliest.
    """
    log_predictions(recording.client, recording.run_id, clips, predictions)
    for clip, q_TN in zip(clips, predictions, strict=True):
        sheet = recording.artist.key_poses(clip, {"mrhubo": q_TN})
        recording.log_picture(sheet, f"test/key_poses_{clip.name}.png")
    clip, q_TN = max(zip(clips, predictions, strict=True), key=lambda pair: pictures.liveliness(pair[0]))
    frames = recording.artist.animation(clip, {"mrhubo": q_TN})
    write = functools.partial(save_gif, frames, frame_rate=pictures.GIF_RATE)
    log_file(recording.client, recording.run_id, f"test/{clip.name}.gif", write)
