"""From whoever is seen in each frame, with their SMPL parameters, to people over time.

Legend: S frames in which somebody is seen.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.motion.readers.frame_bodies import Body
from mrhubo.motion.readers.linking import LINKED, link_in
from mrhubo.motion.readers.rotations import WITH_ROOT
from mrhubo.motion.readers.tracks import SmplArrays, Track

_METRES, _BOXES = 1.0, 0.5
"""How far anybody gets from one frame to the next: in metres, and in heights of the box around them."""


def body_tracks(path: Path, seen: list[tuple[int, Body]], notes: list[str]) -> list[Track]:
    """People, as the file calls them, or else followed by where they are.

    Args:
        path: the file or folder, for sentences.
        seen: frames and who is in them; one at least.
        notes: is told that they were followed.

    Raises:
        UserError: they are told in different ways, or nothing tells who is who.
    """
    first = seen[0][1]
    for name in ("source", "family", "key", "form"):
        if any(getattr(body, name) != getattr(first, name) for _, body in seen):
            raise UserError(
                f"{path}: its frames tell SMPL parameters in different ways ({name}); keep those of one kind"
            )
    people: dict[str, list[tuple[int, Body]]] = {}
    for person, one in zip(_who(path, seen, notes), seen, strict=True):
        people.setdefault(person, []).append(one)
    return [Track(name, len(those), lambda those=those: _arrays(those)) for name, those in people.items()]


def _who(path: Path, seen: list[tuple[int, Body]], notes: list[str]) -> list[str]:
    """Who is seen, of each sighting: as files call them, or else followed by where they are."""
    called = [body.person for _, body in seen]
    times = {(frame, body.person) for frame, body in seen}
    if all(person is not None for person in called) and len(times) == len(seen):
        return [str(person) for person in called]
    frames: dict[int, list[int]] = {}
    for row, (frame, _) in enumerate(seen):
        frames.setdefault(frame, []).append(row)
    boxed = all(body.box is not None for _, body in seen)
    where = [body.box if boxed else body.place for _, body in seen]
    several = max(map(len, frames.values())) > 1
    if several and any(place is None for place in where):
        raise UserError(f"{path}: several people are in a frame, and nothing tells who is who")
    points = [np.zeros(3) if place is None else place for place in where]
    order = sorted(frames)
    reach = _BOXES if boxed else _METRES
    names = [""] * len(seen)
    followed = link_in(path, [np.stack([points[row] for row in frames[frame]]) for frame in order], reach, order)
    for frame, numbers in zip(order, followed, strict=True):
        for row, number in zip(frames[frame], numbers, strict=True):
            names[row] = str(number) if several else ""
    if several:
        notes.append(LINKED)
    return names


def _arrays(seen: list[tuple[int, Body]]) -> SmplArrays:
    """Somebody's parameters in all frames in which they are seen."""
    bodies = [body for _, body in seen]
    first = bodies[0]
    root = _in_all([body.root for body in bodies])
    place, betas = _in_all([body.place for body in bodies]), _in_all([body.betas for body in bodies])
    with_root = 1 if first.form.joints in WITH_ROOT else 0
    frames = np.array([frame for frame, _ in seen])
    return SmplArrays(
        first.key, np.stack([body.pose for body in bodies]), first.form, with_root, root, place, betas, frames
    )


def _in_all(rows: list[np.ndarray | None]) -> np.ndarray | None:
    """Rows of all frames as one array; None where some frame has none, or one of another length."""
    told = [row for row in rows if row is not None]
    return np.stack(told) if len(told) == len(rows) and len({len(row) for row in told}) == 1 else None
