"""One body through a video: its points at a fixed rate.

Legend: T frames, S frames of the fixed rate, K = 33 points.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot_motion.clock import STEADY, at_rate, rate_of_step, rate_of_times, seconds, uneven_steps
from mrhubo.video.estimator import PoseEstimator
from mrhubo.video.frames import MAX_FRAMES, frames


@dataclass(frozen=True)
class Track:
    """A body's points over time, as `mrhubo.video.estimator.Estimate` has them for each frame."""

    rate: float
    """Frames per second."""
    point_TK3: np.ndarray
    """[m]; NaN where nobody is there."""
    visibility_TK: np.ndarray
    notes: tuple[str, ...] = ()
    """What is to be known about it, a sentence each."""

    @property
    def seen_T(self) -> np.ndarray:
        """Whether somebody is there."""
        return np.asarray(np.isfinite(self.point_TK3).all((1, 2)))


def track_body(path: Path, estimator: PoseEstimator) -> Track:
    """Follows one body through a video file. Where frames do not follow each other at a fixed rate, points are on the
    straight line between those of the two frames around, at the rate at which most frames follow each other.

    Raises:
        UserError: the file is no video, or damaged (`mrhubo.video.frames`); it has one frame, or nobody is in it.
    """
    estimator.reset()
    times, points, visible = [], [], []
    for time, image_HW3 in frames(path):
        found = estimator.landmarks(image_HW3)
        times.append(time)
        points.append(found.point_K3)
        visible.append(found.visibility_K)
    if len(times) < 2:
        raise UserError(f"{path}: has one frame; a motion needs two at least")
    seen = sum(bool(np.isfinite(point_K3).all()) for point_K3 in points)
    if not seen:
        raise UserError(f"{path}: nobody is found in any of its {len(times):,} frames")
    notes = [] if seen == len(times) else [f"nobody is found in {len(times) - seen:,} of {len(times):,} frames"]
    time_T, point_TK3, visibility_TK = np.array(times), np.stack(points), np.stack(visible)
    rate = rate_of_times(time_T, seconds)
    if np.abs(time_T * rate - np.arange(len(time_T))).max() > STEADY:
        rate = rate_of_step(f"{np.median(np.diff(time_T)):.3g}") or rate  # files round times to 1 ms
        notes.append(
            f"its {len(time_T):,} frames follow each other after {uneven_steps(time_T)} ms: points are interpolated to"
            f" {rate:.4g} frames per second"
        )
        if time_T[-1] * rate > MAX_FRAMES:
            raise UserError(f"{path}: its {len(times):,} frames are spread over {time_T[-1]:.3g} s; that is no film")
        point_TK3, visibility_TK = (at_rate(time_T, value, rate) for value in (point_TK3, visibility_TK))
    return Track(rate, point_TK3, visibility_TK, tuple(notes))
