"""Human motion from a video, by an estimator of poses (`mrhubo.video`)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import told_rate
from mrhubo.motion.readers.sightings import sure_points
from mrhubo.motion.readers.tracks import Person, check_span, choose
from mrhubo.video.frames import video_kind
from mrhubo.video.track import Track, track_body


def is_video(content: Content) -> bool:
    """Whether a file is a video of a kind that is read."""
    return video_kind(content.start) is not None


def read_video(path: Path, options: ReadOptions) -> Motion:
    """Follows the body that is surest found through a video. Who is followed after them is another person.

    Points are smoothed as MediaPipe does it (`mrhubo.video.smoothing`). How the body is turned is as the camera sees
    it, level where the camera is; where it goes is not told.

    Raises:
        UserError: the file is damaged or too large; nobody is in it; what reads videos, or the models that find people,
            are not there.
    """
    from mrhubo.video.estimator import PoseEstimator
    from mrhubo.video.smoothing import smoothed

    track = track_body(path, PoseEstimator(options.pose_model))
    notes = [*track.notes]
    track = _one(path, track, options, notes)
    notes.append("where the person goes is not known: a single camera sees how limbs point")
    rate = told_rate(path, "has", track.rate, options, notes)
    source = f"a video, in which BlazePose's {options.pose_model} model finds a body"
    track = replace(track, rate=rate, point_TK3=smoothed(track.point_TK3, rate))
    return motion_of_track(motion_name(path), track, source, tuple(notes), str(path))


def _one(path: Path, track: Track, options: ReadOptions, notes: list[str]) -> Track:
    """The person who is asked for, or seen longest, among those who were followed one after the other."""
    count_P = np.zeros(1, int) if track.who_T is None else np.bincount(track.who_T[track.who_T >= 0])
    if len(count_P) < 2:
        notes += options.of_one()
        return track
    people = [Person(str(who), count) for who, count in enumerate(count_P.tolist()) if count]
    chosen = choose(path, people, options, notes)
    first, last = np.flatnonzero(track.who_T == int(chosen.person))[[0, -1]].tolist()
    check_span(path, chosen.length, last + 1 - first)
    notes.append(f"'{chosen.person}' is seen from {first / track.rate:.4g} to {last / track.rate:.4g} s of the film")
    return track.only(int(chosen.person))


def motion_of_track(name: str, track: Track, source: str, notes: tuple[str, ...], what: str = "") -> Motion:
    """The motion of a body that was followed; arguments as for `motion_from_points`."""
    point_TK3 = sure_points(track.point_TK3, track.visibility_TK)
    places = {our: place for place, our in enumerate(SETS["MediaPipe"]) if our != "-"}
    body = BodyPoints(
        {our: point_TK3[:, place] for our, place in places.items()},
        confidence={our: track.visibility_TK[:, place] for our, place in places.items()},
    )
    return motion_from_points(body, name, track.rate, source, notes, what).changed(root_position_T3=None)
