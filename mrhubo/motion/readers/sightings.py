"""People whom a file shows frame by frame as points: which points are known, who is who, and one person's frames.

Legend: T frames, K keypoints, X any further axes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import naming
from mrhubo.motion.readers.linking import LINKED, link, link_in
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.tracks import Person, check_span, choose

UNSURE = 0.3
"""Points that their source is less sure of are taken as missing; detectors draw no point below it."""
_MAX_FRAMES = 500_000
"""Of points."""
_MOST_POINTS, _MOST_IN_ALL = 1_000, 2**23
"""In a frame, and in all frames."""
_FOLLOWED = 32
"""Points of a person by which they are followed, at most."""
_REACH = 0.5
"""How far anybody gets from one frame to the next, in heights of the body."""


@dataclass(frozen=True)
class Sighting:
    """Somebody in a frame."""

    frame: int
    """Its number."""
    person: str | None
    """What the file calls them; None where it does not."""
    point_K3: np.ndarray
    sure_K: np.ndarray | None = None
    """How sure the file is of each point, 0 to 1."""
    picture_2: np.ndarray | None = None
    """Where they are in a picture, in heights of the box around them."""


def person_called(value: object) -> str | None:
    """What a file calls somebody; None where it says nothing, or -1, as those do who told nobody apart. OpenPose keeps
    the number in a list.
    """
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int | str):
        return None
    return None if value in (-1, "-1", "") else shortened(value, 40)


def known_points(point_XK3: np.ndarray, sure_XK: np.ndarray | None = None) -> np.ndarray:
    """The points (..., K, 3) with NaN for those that are missing: of which the source is not sure, or which lie with
    others exactly at the origin.
    """
    point_XK3 = np.where(np.isfinite(point_XK3).all(-1, keepdims=True), point_XK3, np.nan)
    zero_XK = (point_XK3 == 0).all(-1)
    missing_XK = zero_XK & (zero_XK.sum(-1, keepdims=True) > 1)
    point_XK3 = np.where(missing_XK[..., None], np.nan, point_XK3)
    return point_XK3 if sure_XK is None else sure_points(point_XK3, sure_XK)


def sure_points(point_XK3: np.ndarray, sure_XK: np.ndarray) -> np.ndarray:
    """The points (..., K, 3) with NaN for those of which the source is not sure."""
    return np.where(sure_XK[..., None] < UNSURE, np.nan, point_XK3)


def check_size(path: Path, where: str, frames: int, points: int) -> None:
    """Refuses arrays of points that are larger than those of any motion, before they are made.

    Raises:
        UserError: there are too many frames, too many points in each, or in all of them.
    """
    if frames > _MAX_FRAMES:
        raise UserError(f"{path}: has {frames:,} frames; at most {_MAX_FRAMES:,} are read")
    if points > _MOST_POINTS:
        raise UserError(f"{path}: {where} has {points:,} points a frame; expected at most {_MOST_POINTS:,}")
    if frames * points > _MOST_IN_ALL:
        raise UserError(
            f"{path}: {where} has {frames:,} frames of {points:,} points; at most {_MOST_IN_ALL:,} points are read"
        )


def placed(path: Path, where: str, numbers: Sequence[int], row_TKX: np.ndarray) -> np.ndarray:
    """Rows of points by the numbers of their frames; NaN in frames that are missing.

    Raises:
        UserError: as for `check_size`.
    """
    frames = max(numbers) + 1
    check_size(path, where, frames, row_TKX.shape[1])
    found = np.full((frames, *row_TKX.shape[1:]), np.nan)
    found[list(numbers)] = row_TKX
    return found


def frames_of_one(
    path: Path, sightings: Sequence[Sighting], options: ReadOptions, notes: list[str]
) -> tuple[str, list[int | None]]:
    """One of the people, by what the file calls them or, where it does not, by following them.

    Args:
        path: the file or folder, for sentences.
        sightings: of all people in all frames.
        options: says which person; default: whoever is seen longest.
        notes: is told who else there is, and whether people were followed.

    Returns:
        the person, and for each frame from the first to the last in which they are seen the place of the sighting in
        the list, or None.

    Raises:
        UserError: there is nobody, or nobody of the name that is asked for, or they are seen too seldom.
    """
    people: dict[str, dict[int, int]] = {}
    for place, (person, one) in enumerate(zip(_told_apart(path, sightings, notes), sightings, strict=True)):
        if person is not None:
            people.setdefault(person, {})[one.frame] = place
    chosen = choose(path, [Person(name, len(seen)) for name, seen in people.items()], options, notes).person
    seen = people[chosen]
    first, frames = min(seen), max(seen) + 1 - min(seen)
    check_span(path, len(seen), frames)
    return chosen, [seen.get(first + frame) for frame in range(frames)]


def _told_apart(path: Path, sightings: Sequence[Sighting], notes: list[str]) -> list[str | None]:
    """Who is seen, of each sighting; None where no point of them is known."""
    times = Counter((one.frame, one.person) for one in sightings)
    vague = {person for (_, person), number in times.items() if number > 1}  # it is said of two people in one frame
    names = [None if one.person in vague else one.person for one in sightings]
    known: dict[int, np.ndarray] = {}
    nameless: dict[int, list[int]] = {}
    for place, (name, one) in enumerate(zip(names, sightings, strict=True)):
        point_K3 = known_points(one.point_K3, one.sure_K) if name is None else None
        if point_K3 is not None and np.isfinite(point_K3).any():
            known[place] = point_K3
            nameless.setdefault(one.frame, []).append(place)
    if not nameless:
        return names
    given = set(names)
    free = (str(number) for number in count() if str(number) not in given)
    frames, points, height = sorted(nameless), _alike(known), _height(known)
    pictures = {place: picture for place in known if (picture := sightings[place].picture_2) is not None}
    if len(pictures) == len(known):  # points may all be around one origin, whoever's they are
        points = {
            place: np.hstack([point_K3, np.tile(height * pictures[place], (len(point_K3), 1))])
            for place, point_K3 in points.items()
        }
    places = [np.stack([points[place] for place in nameless[frame]]) for frame in frames]
    reach = _REACH * height
    if given == {None}:
        numbers = link_in(path, places, reach, frames)
    else:  # those who have a name in other frames may be any of these
        with naming(path):
            numbers = link(places, reach, frames)
    if len(given) > 1 or max(map(len, places)) > 1:
        notes.append(LINKED)
    called: dict[int, str] = {}
    for frame, here in zip(frames, numbers, strict=True):
        for place, number in zip(nameless[frame], here, strict=True):
            if number not in called:
                called[number] = next(free)
            names[place] = called[number]
    return names


def _alike(known: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
    """Of each sighting the same few points, which are known most often; NaN where one is not."""
    times_K = np.zeros(max(map(len, known.values())), int)
    for point_K3 in known.values():
        times_K[: len(point_K3)] += np.isfinite(point_K3).all(-1)
    chosen_K = np.sort(np.argsort(-times_K, kind="stable")[:_FOLLOWED])
    found = {}
    for place, point_K3 in known.items():
        found[place] = np.full((len(chosen_K), 3), np.nan)
        there_K = chosen_K < len(point_K3)
        found[place][there_K] = point_K3[chosen_K[there_K]]
    return found


def _height(known: dict[int, np.ndarray]) -> float:
    """How high, or wide, whoever is seen is on the whole, in the file's unit."""
    return float(
        np.median([np.ptp(point_K3[np.isfinite(point_K3).all(-1)], axis=0).max() for point_K3 in known.values()])
    )
