"""Motions in folders with a file of SMPL parameters a frame, or a file a person and frame.

Who writes such folders, and what is in their files, is said in `mrhubo.motion.readers.frame_bodies`. Of `00012_1.npz`
the first number is that of the frame, and the second that of a person in it, who in the next frame may be another.

Legend: S frames in which somebody is seen.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_bodies import Body, bodies_in
from mrhubo.motion.readers.frame_files import read_frame_tree
from mrhubo.motion.readers.frame_numbers import frame_numbers_in
from mrhubo.motion.readers.linking import LINKED, link_in
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate
from mrhubo.motion.readers.tracks import Kind, SmplArrays, Track, choose, motion_of
from mrhubo.motion.readers.world import ANY_WORLD, CAMERAS

_METRES, _BOXES = 1.0, 0.5
"""How far anybody gets from one frame to the next: in metres, and in heights of the box around them."""
_DETECTION = re.compile(r"(.*[0-9].*?)[_-]([0-9]{1,3})")
_AT_MOST = 100
"""People in a frame."""


def read_pose_files(folder: Path, files: list[Path], options: ReadOptions) -> Motion:
    """Reads one of the people in a folder.

    Args:
        folder: what the motion is called after.
        files: of its frames.
        options: person, rate.

    Raises:
        NoMotion: nobody is there.
        UserError: a file is damaged, or of another kind than others; the order of the frames or the rate is not known.
    """
    notes: list[str] = []
    seen: list[tuple[int, Body]] = []
    for frame, file in zip(_frames(folder, [file.stem for file in files]), files, strict=True):
        bodies = bodies_in(read_frame_tree(file))
        if bodies is None:
            raise UserError(f"{file}: has no SMPL parameters of one frame, as other files of its folder have")
        seen += [(frame, body) for body in bodies]
    if not seen:
        raise NoMotion(f"{folder}: nobody is seen in its {len(files):,} frames")
    first = seen[0][1]
    for name in ("source", "family", "key", "form"):
        if any(getattr(body, name) != getattr(first, name) for _, body in seen):
            raise UserError(
                f"{folder}: its files tell SMPL parameters in different ways ({name}); keep those of one kind"
            )
    people: dict[str, list[tuple[int, Body]]] = {}
    for person, one in zip(_who(folder, seen, notes), seen, strict=True):
        people.setdefault(person, []).append(one)
    tracks = [Track(name, len(those), lambda those=those: _arrays(those)) for name, those in people.items()]
    worlds = CAMERAS if first.source == "FrankMocap" else ANY_WORLD
    kind = Kind(f"{first.source}, a file a frame", first.family, worlds)
    arrays = choose(folder, tracks, options, notes).read()
    return motion_of(folder, arrays, kind, asked_rate(folder, options), notes)


def _frames(folder: Path, stems: list[str]) -> list[int]:
    """The number of each file's frame; several files have the same, where the last number in a name is a person's."""
    parts = [_DETECTION.fullmatch(stem) for stem in stems]
    heads = [part[1] for part in parts if part is not None]
    tails = {part[2] for part in parts if part is not None}
    if len(heads) < len(stems) or not 1 < len(set(heads)) >= len(tails) or len(tails) > _AT_MOST:
        return frame_numbers_in(folder, stems)
    once = sorted(set(heads))
    numbers = dict(zip(once, frame_numbers_in(folder, once), strict=True))
    return [numbers[head] for head in heads]


def _who(folder: Path, seen: list[tuple[int, Body]], notes: list[str]) -> list[str]:
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
        raise UserError(f"{folder}: several people are in a frame, and nothing tells who is who")
    points = [np.zeros(3) if place is None else place for place in where]
    order = sorted(frames)
    reach = _BOXES if boxed else _METRES
    names = [""] * len(seen)
    followed = link_in(folder, [np.stack([points[row] for row in frames[frame]]) for frame in order], reach, order)
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
    with_root = 1 if first.form.joints in (22, 24, 52, 55) else 0
    frames = np.array([frame for frame, _ in seen])
    return SmplArrays(
        first.key, np.stack([body.pose for body in bodies]), first.form, with_root, root, place, betas, frames
    )


def _in_all(rows: list[np.ndarray | None]) -> np.ndarray | None:
    """Rows of all frames as one array; None where some frame has none, or one of another length."""
    told = [row for row in rows if row is not None]
    return np.stack(told) if len(told) == len(rows) and len({len(row) for row in told}) == 1 else None
