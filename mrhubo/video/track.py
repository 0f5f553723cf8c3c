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
from mrhubo.video.people import tell_apart
from mrhubo.video.sides import EXCHANGED, HIPS, SHOULDERS, exchanged_points

_LOOK_S = 0.5
"""How often it is looked who else is there [s]."""
_SMALL = 120.0
"""Pixels: smaller people are often missed, or taken for turned or mirrored ones."""
_TRUNK = [*SHOULDERS, *HIPS]


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
    who_T: np.ndarray | None = None
    """Who it is, people counted as they come, -1 where nobody is there; None: it is one throughout."""

    def only(self, who: int) -> Track:
        """One of the people, from the first frame in which they are seen to the last."""
        seen_T = np.ones(len(self.point_TK3), bool) if self.who_T is None else self.who_T == who
        first, last = np.flatnonzero(seen_T)[[0, -1]].tolist()
        part, hidden = slice(first, last + 1), ~seen_T[first : last + 1]
        point_TK3, visibility_TK = self.point_TK3[part].copy(), self.visibility_TK[part].copy()
        point_TK3[hidden], visibility_TK[hidden] = np.nan, 0.0
        return Track(self.rate, point_TK3, visibility_TK, self.notes)

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
    times, points, pixels, visible = [], [], [], []
    looks = list[bool]()
    for time, image_HW3 in frames(path):
        found = estimator.landmarks(image_HW3)
        if time >= _LOOK_S * len(looks):
            looks.append(estimator.sees_others(image_HW3))
        pixels.append(found.pixel_K2)
        times.append(time)
        points.append(found.point_K3)
        visible.append(found.visibility_K)
    if len(times) < 2:
        raise UserError(f"{path}: has one frame; a motion needs two at least")
    seen = sum(bool(np.isfinite(point_K3).all()) for point_K3 in points)
    if not seen:
        raise UserError(
            f"{path}: nobody is found in any of its {len(times):,} frames; a person has to be as tall as a sixth of"
            " the picture's shorter side, and a film of smaller ones to be cut to them"
        )
    notes = [] if seen == len(times) else [f"nobody is found in {len(times) - seen:,} of {len(times):,} frames"]
    if any(looks):
        notes.append(
            f"several people are seen in {sum(looks):,} of {len(looks):,} pictures that were looked through: one is"
            " followed, the surest one at first, and may be mistaken for another where one covers the other"
        )
    tall = float(np.nanmedian(np.ptp(np.stack(pixels), axis=1).max(1)))
    if 0 < tall < _SMALL:
        notes.append(
            f"the person is {tall:.0f} pixels tall: limbs may be far off, a larger picture of them would be better"
        )
    time_T, point_TK3, visibility_TK = np.array(times), np.stack(points), np.stack(visible)
    who_T = tell_apart(time_T, point_TK3, np.stack(pixels), _TRUNK)
    exchanged_TK = exchanged_points(time_T, point_TK3, who_T)
    if exchanged_TK.any():
        point_TK3 = np.where(exchanged_TK[..., None], point_TK3[:, EXCHANGED], point_TK3)
        visibility_TK = np.where(exchanged_TK, visibility_TK[:, EXCHANGED], visibility_TK)
        notes.append(
            f"left and right are exchanged for a moment, in {int(exchanged_TK.any(1).sum()):,} of {seen:,} frames: they"
            " are put back"
        )
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
        place_T = at_rate(time_T, np.arange(len(who_T)), rate)
        before_T, after_T = (who_T[end(place_T).astype(int)] for end in (np.floor, np.ceil))
        who_T = np.where(before_T == after_T, before_T, -1)
        point_TK3[who_T < 0], visibility_TK[who_T < 0] = np.nan, 0.0
    return Track(rate, point_TK3, visibility_TK, tuple(notes), who_T)
