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
    film = _watch(path, estimator)
    notes, who_T = film.doubts(), tell_apart(film.time_T, film.point_TK3, film.pixel_TK2, _TRUNK)
    exchanged_TK = exchanged_points(film.time_T, film.point_TK3, who_T)
    point_TK3, visibility_TK = film.point_TK3, film.visibility_TK
    if exchanged_TK.any():
        point_TK3 = np.where(exchanged_TK[..., None], point_TK3[:, EXCHANGED], point_TK3)
        visibility_TK = np.where(exchanged_TK, visibility_TK[:, EXCHANGED], visibility_TK)
        notes.append(
            f"left and right are exchanged for a moment, in {int(exchanged_TK.any(1).sum()):,} of {film.seen:,} frames:"
            " they are put back"
        )
    rate = rate_of_times(film.time_T, seconds)
    track = Track(rate, point_TK3, visibility_TK, tuple(notes), who_T)
    uneven = np.abs(film.time_T * rate - np.arange(len(film.time_T))).max() > STEADY
    return _at_fixed_rate(track, film.time_T, who_T, path) if uneven else track


@dataclass(frozen=True)
class _Film:
    """What is found in each frame, as `mrhubo.video.estimator.Estimate` has it."""

    time_T: np.ndarray
    """[s]"""
    point_TK3: np.ndarray
    visibility_TK: np.ndarray
    pixel_TK2: np.ndarray
    looks: list[bool]
    """Whether others are there, in the pictures that were looked through for them."""
    seen: int
    """In how many frames somebody is found."""

    def doubts(self) -> list[str]:
        """What is to be known about it, a sentence each."""
        count, looks = len(self.time_T), self.looks
        notes = [] if self.seen == count else [f"nobody is found in {count - self.seen:,} of {count:,} frames"]
        if any(looks):
            notes.append(
                f"several people are seen in {sum(looks):,} of {len(looks):,} pictures that were looked through: one is"
                " followed, the surest one at first, and may be mistaken for another where one covers the other"
            )
        tall = float(np.nanmedian(np.ptp(self.pixel_TK2, axis=1).max(1)))
        if 0 < tall < _SMALL:
            notes.append(
                f"the person is {tall:.0f} pixels tall: limbs may be far off, a larger picture of them would be better"
            )
        return notes


def _watch(path: Path, estimator: PoseEstimator) -> _Film:
    """Looks at all of a film; UserError as `track_body`."""
    estimator.reset()
    times, found = [], []
    looks = list[bool]()
    for time, image_HW3 in frames(path):
        found.append(estimator.landmarks(image_HW3))
        if time >= _LOOK_S * len(looks):
            looks.append(estimator.sees_others(image_HW3))
        times.append(time)
    if len(times) < 2:
        raise UserError(f"{path}: has one frame; a motion needs two at least")
    point_TK3 = np.stack([each.point_K3 for each in found])
    if not (seen := int(np.isfinite(point_TK3).all((1, 2)).sum())):
        raise UserError(
            f"{path}: nobody is found in any of its {len(times):,} frames; a person has to be as tall as a sixth of"
            " the picture's shorter side, and a film of smaller ones to be cut to them"
        )
    visibility_TK, pixel_TK2 = np.stack([each.visibility_K for each in found]), np.stack([e.pixel_K2 for e in found])
    return _Film(np.array(times), point_TK3, visibility_TK, pixel_TK2, looks, seen)


def _at_fixed_rate(track: Track, time_T: np.ndarray, who_T: np.ndarray, path: Path) -> Track:
    """A track whose frames are at uneven times [s], at the rate at which most of them follow each other."""
    rate = rate_of_step(f"{np.median(np.diff(time_T)):.3g}") or track.rate  # files round times to 1 ms
    note = (
        f"its {len(time_T):,} frames follow each other after {uneven_steps(time_T)} ms: points are interpolated to"
        f" {rate:.4g} frames per second"
    )
    if time_T[-1] * rate > MAX_FRAMES:
        raise UserError(f"{path}: its {len(time_T):,} frames are spread over {time_T[-1]:.3g} s; that is no film")
    point_SK3, visibility_SK = (at_rate(time_T, value, rate) for value in (track.point_TK3, track.visibility_TK))
    place_S = at_rate(time_T, np.arange(len(who_T)), rate)
    before_S, after_S = (who_T[end(place_S).astype(int)] for end in (np.floor, np.ceil))
    who_S = np.where(before_S == after_S, before_S, -1)
    point_SK3[who_S < 0], visibility_SK[who_S < 0] = np.nan, 0.0
    return Track(rate, point_SK3, visibility_SK, (*track.notes, note), who_S)
