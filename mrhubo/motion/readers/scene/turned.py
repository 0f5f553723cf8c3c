"""Skeletons whose joints turn and keep their places, as simulators of characters have them.

Legend: N joints, T frames, F some of them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.scene.convert import scene_motion
from mrhubo.motion.readers.scene.nodes import Animation, Node, Rest, Scene, affine, in_world, parents_first


@dataclass(frozen=True)
class Skeleton:
    """Joints, the root first."""

    names: Sequence[str]
    parents: Sequence[int]
    """Their places; -1 for a root."""
    offset_N3: np.ndarray
    """From the parent, in its axes [m]; that of the root counts nothing."""
    rest: str
    """In words, the pose in which no joint turns."""
    body: Mapping[str, int] = dataclasses.field(default_factory=dict)
    """Their places by the names of our joints, where that need not be found out."""


def turned_motion(
    path: Path,
    skeleton: Skeleton,
    local_TN33: np.ndarray,
    root_T3: np.ndarray,
    rate: float,
    kind: str,
    options: ReadOptions,
    notes: list[str],
) -> Motion:
    """The motion of a skeleton.

    Args:
        path: the file, for sentences.
        skeleton: the joints.
        local_TN33: how each is turned in its parent's axes.
        root_T3: where the root is [m].
        rate: frames per second.
        kind: what the file is, for `Motion.source`.
        options: may ask for a person, and tell which joint is which.
        notes: what the reader has to say.

    Raises:
        NoMotion: no body is found.
        UserError: joints hang on each other in a circle, or the numbers are no motion.
    """
    order = parents_first(skeleton.parents)
    if order is None:
        raise UserError(f"{path}: its joints hang on each other in a circle, or too deep")
    number = {place: i for i, place in enumerate(order)}
    above = [number.get(skeleton.parents[place], -1) for place in order]
    nodes = tuple(Node(skeleton.names[place], parent, True) for place, parent in zip(order, above, strict=True))
    offset_N3, moved = skeleton.offset_N3[order].astype(np.float64), number[0]

    def local_FN34(time_F: np.ndarray) -> np.ndarray:
        frames = np.clip(np.rint(time_F * rate).astype(int), 0, len(local_TN33) - 1)
        turn_FN33 = local_TN33[frames][:, order].astype(np.float64)
        place_FN3 = np.repeat(offset_N3[None], len(frames), axis=0)
        place_FN3[:, moved] = root_T3[frames]
        return affine(place_FN3, turn_FN33, np.ones(3))

    still_N34 = affine(offset_N3, np.broadcast_to(np.eye(3), (len(order), 3, 3)), np.ones(3))
    rest = Rest(skeleton.rest, in_world(still_N34[None], above)[0])
    animation = Animation("", 0.0, (len(local_TN33) - 1) / rate, rate, local_FN34)
    options = dataclasses.replace(options, animation=None, rate=None)
    body = {joint: number[place] for joint, place in skeleton.body.items()}
    return scene_motion(path, Scene(nodes, (rest,), (animation,), body), kind, options, notes)


def in_parents(world_TN33: np.ndarray, parents: Sequence[int]) -> np.ndarray:
    """Rotations in the world as rotations in the parents' axes (T, N, 3, 3)."""
    local_TN33 = world_TN33.copy()
    for place, parent in enumerate(parents):
        if parent >= 0:
            local_TN33[:, place] = world_TN33[:, parent].mT @ world_TN33[:, place]
    return local_TN33
