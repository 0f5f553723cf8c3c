"""Human motions from OptiTrack's Motive: the bones of a skeleton, of which no line says which carries which.

A bone turns about where it begins, and that keeps its place on the bone that carries it. Where somebody stands in a
T-pose, all bones are turned as the world is.

Legend: T frames, F some of them, B bones, N bones in an order in which parents come before children.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, listed, shortened
from mrhubo.motion.gaps import fill_numbers, fill_rotations
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.markers.convert import motion_of_labelled
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate, rate_of_seconds, told_rate
from mrhubo.motion.readers.scene.convert import scene_motion
from mrhubo.motion.readers.scene.motive_bones import carriers, farther
from mrhubo.motion.readers.scene.motive_file import BEGINS, MotiveTable, read_motive_table
from mrhubo.motion.readers.scene.nodes import Animation, Node, Rest, Scene, affine
from mrhubo.motion.readers.tracks import Person, check_span, choose
from mrhubo.motion.readers.tree.people import FEWEST_JOINTS
from mrhubo.motion.readers.tree.world import AT_REST

_KIND = "table of OptiTrack Motive"
_TOPMOST = ("", "hip", "hips", "pelvis", "root", "reference")
"""What the bone that carries all others is called, after the skeleton's name, which may be all that it has."""
_OFTEN = 0.5
"""Share of the frames in which a bone must be tracked not to be left out."""
_SAMPLES = 64
"""Frames by which it is told which bone carries which."""


def is_motive(content: Content) -> bool:
    """Whether a text begins as Motive's tables do."""
    return content.text is not None and content.text.startswith((BEGINS, f'"{BEGINS}'))


def read_motive(path: Path, options: ReadOptions) -> Motion:
    """Reads the motion of a skeleton, or of markers where a file has no skeletons.

    Raises:
        NoMotion: there are no bones and no markers, or they are none of a body.
        UserError: the file is missing, damaged or too large, or has nobody of the name that is asked for.
    """
    table, notes = read_motive_table(path), list[str]()
    if not table.turns:
        return _motion_of_markers(path, table, options)
    name, bones, known_T = _chosen(path, table, options, notes)
    seen_S = np.flatnonzero(known_T)
    span = slice(int(seen_S[0]), int(seen_S[-1]) + 1)
    check_span(path, len(seen_S), span.stop - span.start)
    known_T, told = known_T[span], _told_rate(table)
    rate = asked_rate(path, options) if told is None else told_rate(path, *told, options, notes)
    scene = _scene(table, bones, span, known_T, name, rate)
    kind = f"table of OptiTrack Motive, skeleton '{name}'" if name else _KIND
    options = dataclasses.replace(options, person=None, animation=None, rate=None)
    motion = scene_motion(path, scene, kind, options, notes)
    if known_T.all():
        return motion
    sure_TJ = np.repeat(known_T[-len(motion) :, None].astype(np.float32), motion.arrays.local_TJ33.shape[1], axis=1)
    return motion.changed(confidence_TJ=sure_TJ)


def _motion_of_markers(path: Path, table: MotiveTable, options: ReadOptions) -> Motion:
    """The motion of a body with markers, of a file without bones."""
    told = _told_rate(table)
    found = Keypoints(table.place_TB3, list(table.bones), None, None if told is None else told[1], "the table")
    return motion_of_labelled(path, found, _KIND, options)


def _chosen(
    path: Path, table: MotiveTable, options: ReadOptions, notes: list[str]
) -> tuple[str, list[int], np.ndarray]:
    """The skeleton that is asked for, or tracked longest: its name, its bones that are tracked often, and the frames
    (T,) in which they all are.

    Raises:
        UserError: nobody is tracked, or nobody of that name.
    """
    skeletons, left_out = _skeletons(table.bones), list[int]()
    for name, bones in skeletons.items():
        skeletons[name] = _often(table, bones)
        left_out += sorted({*bones} - {*skeletons[name]})
    if left_out:
        names = shortened(listed(table.bones[bone] for bone in left_out), 100)
        notes.append(f"bones that are tracked in less than half of the frames are left out: {names}")
    known = {name: _known(table, bones) for name, bones in skeletons.items()}
    tracks = [Person(name, int(known_T.sum())) for name, known_T in known.items() if known_T.any()]
    if len(tracks) > 1 or options.person in skeletons:
        name = choose(path, tracks, options, notes).person
    elif tracks:
        notes += options.of_one()
        name = tracks[0].person
    else:
        raise UserError(f"{path}: nobody is tracked with all bones in any frame")
    return name, skeletons[name], known[name]


def _skeletons(bones: Sequence[str]) -> dict[str, list[int]]:
    """The places of bones by the name of their skeleton, which is before a colon, or, in old files, a line."""
    if not any(":" in bone for bone in bones):
        old = _by_heads(bones, "_")
        return old if all(len(places) >= FEWEST_JOINTS for places in old.values()) else {"": list(range(len(bones)))}
    return _by_heads(bones, ":")


def _by_heads(bones: Sequence[str], mark: str) -> dict[str, list[int]]:
    """The places of bones by what is before a mark in their names; one that is called so itself is of them."""
    heads = {head for bone in bones if (head := bone.rpartition(mark)[0])}
    found: dict[str, list[int]] = {}
    for place, bone in enumerate(bones):
        found.setdefault(bone if bone in heads else bone.rpartition(mark)[0], []).append(place)
    return found


def _often(table: MotiveTable, bones: list[int]) -> list[int]:
    """Bones that are tracked in half as many frames as the one that is most; toes and fingers may not be."""
    count = {bone: int(_known(table, [bone]).sum()) for bone in bones}
    return [bone for bone in bones if count[bone] >= _OFTEN * max(count.values())]


def _known(table: MotiveTable, bones: list[int]) -> np.ndarray:
    """Frames (T,) in which all of some bones are tracked."""
    return np.logical_and(
        np.isfinite(table.place_TB3[:, bones]).all((1, 2)), np.isfinite(table.turns[0][:, bones]).all((1, 2, 3))
    )


def _told_rate(table: MotiveTable) -> tuple[str, float] | None:
    """What tells frames per second, for a sentence, and how many: the header of the export, or of the recording, or
    times.
    """
    for key in ("Export Frame Rate", "Capture Frame Rate"):
        with contextlib.suppress(ValueError):
            return f"'{key}' is", float(table.told.get(key.lower(), ""))
    rate = rate_of_seconds(table.time_T)
    return None if rate is None else ("its times are at", rate)


def _scene(table: MotiveTable, bones: list[int], span: slice, known_T: np.ndarray, skeleton: str, rate: float) -> Scene:
    """What is tracked of a skeleton in a span of frames, of which some are known, and filled in between."""
    names, place_TB3, turn_TB33, parents = _ordered(table, bones, span, known_T, skeleton)
    nodes = tuple(Node(name, parent, True) for name, parent in zip(names, parents, strict=True))
    animation = _animation(place_TB3, turn_TB33, parents, rate)
    return Scene(nodes, (_t_pose(place_TB3, turn_TB33, parents),), (animation,), up=AT_REST)


def _ordered(
    table: MotiveTable, bones: list[int], span: slice, known_T: np.ndarray, skeleton: str
) -> tuple[list[str], np.ndarray, np.ndarray, list[int]]:
    """Bones, parents before children: names, where they begin, how they are turned, and the places of their parents.

    Of two ways to read angles, the one is taken in which bones keep their places better on those that carry them.
    """
    names = [table.bones[place] for place in bones]
    plain = [name.removeprefix(skeleton).lstrip(":_").lower() for name in names]
    top = next((i for i, name in enumerate(plain) if name in _TOPMOST), 0)
    farther_BB = farther(plain, top)
    place_TB3 = fill_numbers(table.place_TB3[span][:, bones], known_T)
    some_F = np.flatnonzero(known_T)[np.linspace(0, known_T.sum() - 1, _SAMPLES).astype(int)]
    ways = [turn_TB33[span][:, bones] for turn_TB33 in table.turns]
    found = [carriers(place_TB3[some_F], turn_TB33[some_F], farther_BB, top) for turn_TB33 in ways]
    best = min(range(len(ways)), key=lambda way: found[way][2])
    order, parents, _ = found[best]
    turn_TB33 = np.stack([fill_rotations(ways[best][:, bone], known_T) for bone in order], axis=1)
    return [names[bone] for bone in order], place_TB3[:, order], turn_TB33, parents


def _t_pose(place_TN3: np.ndarray, turn_TN33: np.ndarray, parents: list[int]) -> Rest:
    """The pose in which all bones are turned as the world is."""
    local_TN34 = _local(place_TN3, turn_TN33, parents)
    world_N3 = np.median(local_TN34[..., 3], axis=0)
    for node, parent in enumerate(parents):
        if parent >= 0:
            world_N3[node] += world_N3[parent]
    count = len(parents)
    return Rest(
        "the pose in which its bones are turned as the world",
        affine(world_N3, np.tile(np.eye(3), (count, 1, 1)), np.ones((count, 3))),
    )


def _local(place_FN3: np.ndarray, turn_FN33: np.ndarray, parents: list[int]) -> np.ndarray:
    """Where bones are in their parents: maps (F, N, 3, 4)."""
    local_FN34 = np.concatenate([turn_FN33, place_FN3[..., None]], axis=-1)
    for node, parent in enumerate(parents):
        if parent >= 0:
            back_F33 = turn_FN33[:, parent].mT
            local_FN34[:, node, :, :3] = back_F33 @ turn_FN33[:, node]
            local_FN34[:, node, :, 3] = (back_F33 @ (place_FN3[:, node] - place_FN3[:, parent])[..., None])[..., 0]
    return local_FN34


def _animation(place_TN3: np.ndarray, turn_TN33: np.ndarray, parents: list[int], rate: float) -> Animation:
    """The motion, frame by frame."""

    def local_FN34(time_F: np.ndarray) -> np.ndarray:
        frames = np.clip(np.rint(time_F * rate).astype(int), 0, len(place_TN3) - 1)
        return _local(place_TN3[frames], turn_TN33[frames], parents)

    return Animation("", 0.0, (len(place_TN3) - 1) / rate, rate, local_FN34)
