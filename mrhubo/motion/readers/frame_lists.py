"""Lists of frames, or dictionaries of them by the names of pictures, each with SMPL parameters of whoever is seen.

So they come from who calls an estimator on each picture of a video and keeps what it answers: Multi-HMR's people,
4D-Humans' HMR2, NLF. Who is in a frame is read by `mrhubo.motion.readers.frame_bodies`. NLF itself answers a batch of
pictures with a dictionary of lists, whose entries have a row for whoever is in each
(https://github.com/isarandi/nlf, `detect_smpl_batched`). NeuralAnnot's clips are dictionaries of such by action and
take, or subject and sequence, each frame with `pose`, `shape` and `trans` or SMPL-X's parameters; its pictures, by
their numbers, are no motion (https://github.com/mks0601/NeuralAnnot_RELEASE).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.assemble import MAX_ROOT_TURN
from mrhubo.motion.readers.body_tracks import body_tracks
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_bodies import Body, bodies_in
from mrhubo.motion.readers.frame_numbers import in_order
from mrhubo.motion.readers.rotations import Form, rows_of, to_matrices
from mrhubo.motion.readers.tracks import Kind, Layout, SmplArrays, Track
from mrhubo.motion.readers.world import ANY_WORLD, CAMERAS

_FEWEST, _NUMBERED = 2, 20
"""Frames of a list, and of a dictionary whose keys are numbers, which may be those of people."""
_MOST_PEOPLE = 20
"""Along an axis of an array of one frame; more are frames."""
_FRAMES = (
    "frame_id", "frame", "frame_idx", "frame_index", "frame_number", "image_id", "img_name", "image_name", "imgname",
    "img_path", "image_path",
)  # fmt: skip
_LISTS = ("frames", "results", "data", "predictions", "outputs")
"""What entries call the frame that they are of, and files a list of frames."""
_ROWS_OF_POSES = ("pose", "poses", "body_pose", "thetas", "smpl_thetas")
_DEEPEST, _MOST_CLIPS = 2, 10_000
"""Dictionaries above that of a clip's frames, and clips."""
_RESTLESS = 0.7
"""Nobody turns by so much [rad] from one frame to the next in half of them, as people in different pictures do."""
_PICTURE = re.compile(r".*\.(?:jpe?g|png|bmp|webp|tiff?)|.*frame.*[0-9].*", re.IGNORECASE)


def read_frame_list(tree: Tree) -> Layout | None:
    """A list of frames, each a dictionary with SMPL parameters, perhaps in one deeper, or a list of such. What sees
    nobody is `None`, or empty. Where all entries tell which frame they are of, several may be people in one.
    """
    if not tree.is_list or len(tree) < _FEWEST:
        return None
    entries = [entry for entry in tree if not entry.is_none]
    told = [_frame_of(entry) for entry in entries]
    if None in told or len(told) < _FEWEST:
        return _layout(tree, ((number, [frame]) for number, frame in enumerate(tree)), len(tree))
    if any(_here(entry, 2) is None for entry in entries[:_FEWEST]):
        return None
    frames: dict[str, list[Tree]] = {}
    for name, entry in zip(told, entries, strict=True):
        frames.setdefault(str(name), []).append(entry)
    return _layout(tree, in_order(tree.path, list(frames.items())), len(frames)) if len(frames) >= _FEWEST else None


def read_listed(tree: Tree) -> Layout | None:
    """The same under a key of a dictionary."""
    listed = tree.get(*_LISTS) if tree.is_mapping else None
    return None if listed is None else read_frame_list(listed)


def _frame_of(entry: Tree) -> str | None:
    """What an entry calls the frame that it is of; None where it does not."""
    told = entry.get(*_FRAMES)
    if told is None or told.is_none:
        return None
    if (text := told.text()) is not None:
        return text
    shape = told.shape()
    if shape is None or math.prod(shape) != 1 or not np.isfinite(told.array()).all():
        return None
    return f"{told.number():.0f}"


def read_pictures(tree: Tree) -> Layout | None:
    """The same in a dictionary by the names of pictures."""
    return _named(tree) if tree.is_mapping and all(map(_PICTURE.fullmatch, tree.keys)) else None


def read_numbered(tree: Tree) -> Layout | None:
    """The same in a dictionary by numbers."""
    return _named(tree) if tree.is_mapping and _are_numbered(tree) else None


def _are_numbered(tree: Tree) -> bool:
    return len(tree) > _NUMBERED and all(map(str.isdecimal, tree.keys))


def read_clips(tree: Tree) -> Layout | None:
    """Dictionaries of clips, by action and take say, each a dictionary of frames by numbers."""
    clips = dict(_clips(tree, _DEEPEST)) if tree.is_mapping else {}
    first = next(iter(clips.values()), None)
    layout = None if first is None else read_numbered(first)
    if layout is None:
        return None
    tracks = [Track(name, len(clip), lambda clip=clip: _read_clip(clip)) for name, clip in clips.items()]
    return Layout(replace(layout.kind, source="SMPL parameters of clips, frame by frame", worlds=ANY_WORLD), tracks)


def _clips(tree: Tree, deepest: int, before: str = "") -> Iterator[tuple[str, Tree]]:
    """Dictionaries of frames by numbers, and their names, in dictionaries up to some deep."""
    for name, child in islice(tree.items(), _MOST_CLIPS):
        if not child.is_mapping:
            continue
        if _are_numbered(child):
            yield before + name, child
        elif deepest > 1:
            yield from _clips(child, deepest - 1, f"{before}{name}/")


def _read_clip(clip: Tree) -> SmplArrays:
    """Whoever is seen longest in a clip.

    Raises:
        UserError: there is nobody.
    """
    layout = read_numbered(clip)
    if layout is None:
        raise UserError(f"{clip.named} holds no SMPL parameters of frames")
    return max(layout.tracks, key=lambda track: track.length).read()


def read_columns(tree: Tree) -> Layout | None:
    """A dictionary of lists with an entry a frame, whose arrays have a row for each of the people in it, in any order;
    more than one of them in some frame, or nobody.
    """
    poses = next((tree[key] for key in _ROWS_OF_POSES if key in tree.keys), None) if tree.is_mapping else None
    if poses is None or not poses.is_list or len(poses) < _FEWEST:
        return None
    shapes = [pose.shape() for pose in poses]
    counts = [shape[0] if shape is not None and len(shape) > 1 else -1 for shape in shapes]
    if min(counts) < 0 or set(counts) == {1} or not 0 < max(counts) < min(len(poses), _MOST_PEOPLE + 1):
        return None
    frames = (
        (number, [frame])
        for number, (frame, count) in enumerate(zip(tree.places(len(poses)), counts, strict=True))
        if count
    )
    return _layout(tree, frames, _MOST_PEOPLE + 1)


def _named(tree: Tree) -> Layout | None:
    entries = list(tree.items())
    if len(entries) < _FEWEST or not any(_here(frame, len(entries)) for _, frame in entries[:_NUMBERED]):
        return None
    layout = _layout(tree, ((number, [frame]) for number, frame in in_order(tree.path, entries)), len(entries))
    if layout is not None and len(layout.tracks) == 1:
        _refuse_pictures(tree, layout.tracks[0].read())
    return layout


def _refuse_pictures(tree: Tree, arrays: SmplArrays) -> None:
    """Refuses people of different pictures, in place of frames that follow each other.

    Raises:
        NoMotion: somebody turns more than anybody does.
    """
    root_SX = rows_of(arrays.pose if arrays.root is None else arrays.root)[:, : arrays.form.numbers]
    turn_S33 = to_matrices(root_SX, Form(1, root_SX.shape[1] == 9), MAX_ROOT_TURN)
    if turn_S33 is None or len(turn_S33) < _NUMBERED:
        return
    cosine_S = (np.trace(turn_S33[:-1, 0].mT @ turn_S33[1:, 0], axis1=-2, axis2=-1) - 1) / 2
    if np.median(np.arccos(np.clip(cosine_S, -1, 1))) > _RESTLESS:
        raise NoMotion(
            f"{tree.named}: holds SMPL parameters by number, in which people turn from one to the next as those in"
            " different pictures do, and no motion"
        )


def _layout(tree: Tree, frames: Iterable[tuple[int, list[Tree]]], count: int) -> Layout | None:
    seen: list[tuple[int, Body]] = []
    for number, entries in frames:
        for entry in entries:
            here = _here(entry, count)
            if here is None and seen:
                return None
            seen += [(number, body) for body in here or ()]
    if len({number for number, _ in seen}) < _FEWEST:
        return None
    # single frames with SMPL-X's 21 joints and no more are of estimators of SMPL-X
    seen = [(number, replace(body, source="", family=body.family or "smplx")) for number, body in seen]
    notes: list[str] = []
    tracks = body_tracks(tree.path, seen, notes)
    return Layout(Kind("SMPL parameters, frame by frame", seen[0][1].family, CAMERAS), tracks, tuple(notes))


def _here(frame: Tree, count: int) -> list[Body] | None:
    """Who is in one of some frames: nobody where it is empty; None where it is no frame."""
    if frame.is_none or ((frame.is_list or frame.is_mapping) and not len(frame)):
        return []
    return bodies_in(frame, most_rows=min(_MOST_PEOPLE, count - 1))
