"""People in a file, each seen in some of its frames, and the motion of one of them.

Legend: T frames, S frames in which somebody is seen, X numbers of a row, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.tree import Tree
from mrhubo.motion.far_places import kept_places
from mrhubo.motion.gaps import fill_numbers, fill_rotations
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.assemble import (
    BLOCK,
    LARGEST_BETA,
    MAX_FRAMES,
    MAX_ROOT_TURN,
    in_metres,
    to_our_rest,
    upright,
)
from mrhubo.motion.readers.family import rest_in_words
from mrhubo.motion.readers.names import motion_name, several
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rotations import JOINTS, Form, read_local, rows_of, to_matrices

_SCARCEST = 0.02
"""Who is seen in a smaller share of the frames from their first to their last makes no motion."""

_NOBODY_M = 100.0
"""So far [m] from a camera nobody's pose is estimated."""


@dataclass(frozen=True)
class SmplArrays:
    """A person's SMPL parameters as a file has them."""

    key: str
    """Where the pose is in the file."""
    pose: np.ndarray
    """Rotations of joints (S, ...)."""
    form: Form
    """Of the pose."""
    first: int
    """Which of the pose's joints is SMPL's joint 1: after the root, if that is there."""
    root: np.ndarray | None = None
    """Rotations of the root (S, ...), axis-angle or matrices; where the pose has none."""
    position: np.ndarray | None = None
    """Places of the root (S, ...) [m]."""
    betas: np.ndarray | None = None
    """Shape of the body, once or (S, ...)."""
    frames: np.ndarray | None = None
    """Numbers of the frames (S,); None where they follow each other."""


@dataclass(frozen=True)
class Person:
    """One person in a file."""

    person: str
    """A name or a number that the file has for them; empty where it has none."""
    length: int
    """In how many frames they are seen."""


@dataclass(frozen=True)
class Track(Person):
    """One person, of whom the file has SMPL parameters."""

    read: Callable[[], SmplArrays]
    """Reads what the file has of them."""
    homes: tuple[Tree, ...] = ()
    """Dictionaries that are theirs, which may tell the frame rate."""


@dataclass(frozen=True)
class Kind:
    """What is known of the parameters in a file."""

    source: str
    """What the file was taken for."""
    family: str
    """Of body models; empty where it is not known."""
    worlds: tuple[str, ...]
    """Which way may be up, names of `mrhubo.motion.readers.world`."""


@dataclass(frozen=True)
class Layout:
    """What a file was found to hold."""

    kind: Kind
    tracks: list[Track]
    notes: tuple[str, ...] = ()
    camera_beside: bool = False
    """Whether its writer keeps the camera's way through the world in a file of its own."""


Chosen = TypeVar("Chosen", bound=Person)


def choose(path: Path, tracks: Sequence[Chosen], options: ReadOptions, notes: list[str]) -> Chosen:
    """The person that is asked for, or whoever is seen in most frames; of those, the first.

    Raises:
        UserError: there is nobody, or nobody of that name.
    """
    if not tracks:
        raise UserError(f"{path}: nobody is seen in any frame")
    told = [(track.person, f"{track.length:,} frames") for track in sorted(tracks, key=lambda track: -track.length)]
    if options.person is None:
        chosen = max(tracks, key=lambda track: track.length)
        if len(tracks) > 1:
            notes.append(
                f"'{shortened(chosen.person, 40)}' is seen longest and was taken; there are {several(told)}; --person"
                " or ReadOptions(person=...) takes another"
            )
        return chosen
    chosen = next((track for track in tracks if track.person == options.person), None)
    if chosen is None and len(tracks) == 1 and not tracks[0].person:
        notes += options.of_one()
        return tracks[0]
    if chosen is None:
        present = several(told, options.person)
        raise UserError(f"{path}: there is no person '{shortened(options.person, 40)}'; there are {present}")
    return chosen


def choose_or_only(path: Path, tracks: Sequence[Chosen], options: ReadOptions, notes: list[str]) -> Chosen:
    """As `choose`; but whoever is there alone is taken whatever name is asked for, and a note says so."""
    if len(tracks) != 1 or options.person == tracks[0].person:
        return choose(path, tracks, options, notes)
    notes += options.of_one()
    return tracks[0]


def motion_of(path: Path, arrays: SmplArrays, kind: Kind, frame_rate: float, notes: list[str]) -> Motion:
    """A person's motion, from the first frame in which they are seen to the last; between, where they are not, it goes
    from one frame to the next with a confidence of 0.

    Raises:
        UserError: something that is needed is no rotation, in degrees, or seen too seldom.
    """
    seen = len(arrays.pose)
    if not 0 < seen <= MAX_FRAMES:
        raise UserError(f"{path}: '{arrays.key}' has {seen:,} frames; expected 1 to {MAX_FRAMES:,}")
    rows_SX = arrays.pose.reshape(seen, arrays.form.width)
    blocks = ((start, rows_SX[start : start + BLOCK].astype(np.float64)) for start in range(0, seen, BLOCK))
    local_SJ33 = read_local(path, arrays.key, seen, blocks, arrays.form, arrays.first)
    root_S33 = _root(arrays, notes)
    position_S3 = _position(arrays, notes)
    local_TJ33, root_T33, position_T3, known_T = _filled(path, arrays, local_SJ33, root_S33, position_S3, notes)
    confidence_TJ = None
    if known_T is not None:
        missing, frames = int((~known_T).sum()), len(known_T)
        notes.append(f"not seen in {missing:,} of {frames:,} frames: filled in, confidence 0")
        confidence_TJ = np.repeat(known_T.astype(np.float32)[:, None], JOINTS, axis=1)
    if position_T3 is not None and root_T33 is None:
        notes.append("where the root goes is left out: without its rotation the up axis is not known")
    name = motion_name(path)
    motion = Motion.of(
        name=name,
        local_TJ33=local_TJ33,
        frame_rate=frame_rate,
        description=name,
        root_rotation_T33=root_T33,
        root_position_T3=position_T3,
        betas=_betas(arrays, notes),
        source=f"{kind.source}, '{arrays.key}'",
        family=kind.family,
        notes=tuple(notes),
        confidence_TJ=confidence_TJ,
    )
    motion = upright(motion, kind.worlds, rest_in_words(kind.family))
    return to_our_rest(in_metres(motion, "where the root is", _NOBODY_M))


def check_span(path: Path, seen: int, frames: int) -> None:
    """Refuses somebody who is seen in too few of the frames from their first to their last, before arrays are made.

    Raises:
        UserError: they are, or there are too many frames.
    """
    if frames * _SCARCEST > seen or frames > MAX_FRAMES:
        raise UserError(f"{path}: somebody who is seen in {seen:,} of {frames:,} frames makes no motion")


def _root(arrays: SmplArrays, notes: list[str]) -> np.ndarray | None:
    """Rotations (S, 3, 3) of the root; None, and a note, where they cannot be used."""
    seen, form = len(arrays.pose), arrays.form
    if arrays.root is not None:
        rows_SX = rows_of(arrays.root)
        matrices = rows_SX.shape[1] == 9
        if len(rows_SX) != seen or rows_SX.shape[1] not in (3, 9):
            notes.append(f"the root's rotation is left out: its shape is {arrays.root.shape}")
            return None
    elif arrays.first > 0:
        rows_SX, matrices = arrays.pose.reshape(seen, form.width)[:, : form.numbers], form.matrices
    else:
        return None
    rotation_S133 = to_matrices(rows_SX, Form(1, matrices), MAX_ROOT_TURN)
    if rotation_S133 is None:
        notes.append(
            "the root's rotation is left out: it holds NaN, infinite numbers, or what is no rotation in radians"
        )
        return None
    return rotation_S133[:, 0]


def _position(arrays: SmplArrays, notes: list[str]) -> np.ndarray | None:
    """Places (S, 3) of the root; None, and a note, where they cannot be used."""
    if arrays.position is None:
        return None
    rows_SX = rows_of(arrays.position)
    if len(rows_SX) != len(arrays.pose) or rows_SX.shape[1] != 3:
        notes.append(f"where the root goes is left out: its shape is {arrays.position.shape}")
        return None
    return kept_places(rows_SX, "where the root goes", notes)


def _betas(arrays: SmplArrays, notes: list[str]) -> tuple[float, ...] | None:
    """The body's shape; the mean, where the file has one a frame."""
    betas = arrays.betas
    if betas is None:
        return None
    if betas.ndim >= 2:
        betas = rows_of(betas).astype(np.float64).mean(axis=0) if len(betas) else betas.reshape(0)
    if betas.ndim != 1 or len(betas) > 400 or not (np.abs(betas) < LARGEST_BETA).all():
        notes.append(f"the body's shape is left out: expected up to 400 finite numbers, found {betas.shape}")
        return None
    return tuple(float(number) for number in betas)


def _filled(
    path: Path,
    arrays: SmplArrays,
    local_SJ33: np.ndarray,
    root_S33: np.ndarray | None,
    position_S3: np.ndarray | None,
    notes: list[str],
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None, np.ndarray | None]:
    """All frames from the first to the last, and in which (T,) somebody is seen: None where in all of them."""
    if arrays.frames is None:
        return local_SJ33, root_S33, position_S3, None
    numbers = arrays.frames.reshape(-1)
    if len(numbers) != len(local_SJ33):
        raise UserError(f"{path}: {len(numbers):,} numbers of frames for {len(local_SJ33):,} poses")
    if not (np.abs(numbers) < 2**53).all():
        raise UserError(f"{path}: the numbers of frames are not whole numbers")
    order, places = np.unique(numbers.astype(np.int64), return_index=True)
    if len(order) < len(numbers):
        notes.append(f"{len(numbers) - len(order):,} poses of frames that are told before are left out")
    frames = int(order[-1] - order[0]) + 1
    check_span(path, len(order), frames)
    index_S, known_T = order - order[0], np.zeros(frames, bool)
    known_T[index_S] = True

    def spread(values_SX: np.ndarray) -> np.ndarray:
        values_TX = np.zeros((frames, *values_SX.shape[1:]), values_SX.dtype)
        values_TX[index_S] = values_SX[places]
        return values_TX

    local_TJ33 = spread(local_SJ33)
    root_T33 = None if root_S33 is None else spread(root_S33)
    position_T3 = None if position_S3 is None else spread(position_S3)
    if frames == len(order):
        return local_TJ33, root_T33, position_T3, None
    for joint in range(JOINTS):
        local_TJ33[:, joint] = fill_rotations(local_TJ33[:, joint], known_T)
    return (
        local_TJ33,
        None if root_T33 is None else fill_rotations(root_T33, known_T),
        None if position_T3 is None else fill_numbers(position_T3, known_T),
        known_T,
    )
