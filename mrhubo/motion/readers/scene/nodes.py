"""A scene of nodes that move in each other, as FBX and glTF have them, to a tree of joints.

Nodes are turned, moved and scaled by their parents. What they do is told against a pose at rest, so that the tree's
angles are 0 there: that in which the skin was bound to the skeleton, for instance.

Legend: N nodes, T frames, F some of them. Frame: the scene's own world and unit.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrhubo.errors import shortened
from mrhubo.fast.plain.human import norm
from mrhubo.fast.rotations import orthonormal
from mrhubo.motion.readers.tree.hierarchy import Joint, JointTree, angles_zyx

MAX_NODES = 20_000
"""Of a scene."""
_MAX_JOINTS = 5_000
"""Nodes that may be joints."""
_MAX_DEPTH = 500
"""Nodes on the way from a root to an end."""
_MAX_NUMBERS = 100_000_000
_BLOCK_NUMBERS = 1_000_000
"""Numbers that are worked out at a time."""
_LARGEST = 1e7
"""No coordinate is beyond this."""
_FLAT = 1e-9
"""Scales that are as small as this, of the largest, leave no axes."""
_STILL = 1e-4
"""Turns [rad], and shares of the skeleton's size, that are none."""
_FEWEST_BONES = 10
"""A skeleton of a body has at least so many bones; where a scene has fewer, any node may be one."""


@dataclass(frozen=True)
class Node:
    """A node of a scene."""

    name: str
    parent: int
    """Place of its parent, which comes before it; -1 for a root."""
    is_bone: bool
    """Whether the file says that it is a part of a skeleton."""


@dataclass(frozen=True)
class Rest:
    """A pose in which a body may stand at rest."""

    name: str
    """In words, for instance `the pose in which its skin was bound`."""
    world_N34: np.ndarray
    """Where nodes are: affine maps from their axes to the world."""
    may_move: bool = False
    """Whether it may be a pose of the motion, such as its first, that a program left in the nodes."""
    up: str | None = None
    """The axis along which a body must stand in it; None where any will do."""


@dataclass(frozen=True)
class Animation:
    """A motion of a scene's nodes."""

    name: str
    start: float
    """Of its first key [s]."""
    end: float
    """Of its last key [s]."""
    rate: float
    """Keys a second, of most nodes; or a usual rate, with a note."""
    local_FN34: Callable[[np.ndarray], np.ndarray]
    """Times (F,) [s] to where nodes are in their parents: affine maps (F, N, 3, 4)."""
    note: str = ""
    """Why the rate is not told, for a sentence about the animation; empty where it is."""


@dataclass(frozen=True)
class Scene:
    """What a file holds."""

    nodes: tuple[Node, ...]
    """Parents before children."""
    rests: tuple[Rest, ...]
    """Poses at rest, the likeliest first; at least one."""
    animations: tuple[Animation, ...]
    body: Mapping[str, int] = dataclasses.field(default_factory=dict)
    """Nodes by the names of our joints, as far as the file itself says which is which."""
    up: str | None = None
    """The axis that is up, as the file says; `AT_REST` if it is the one along which a body stands at rest."""


def parents_first(parents: Sequence[int]) -> list[int] | None:
    """The places of nodes in an order in which parents come before children; None where they go round in a circle, or
    deeper than is read.
    """
    children: list[list[int]] = [[] for _ in parents]
    for place, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(place)
    order, level, depth = [], [place for place, parent in enumerate(parents) if parent < 0], 0
    while level and depth < _MAX_DEPTH:
        order += level
        level, depth = [child for place in level for child in children[place]], depth + 1
    return order if len(order) == len(parents) else None


def affine(translation_X3: np.ndarray, rotation_X33: np.ndarray, scale_X3: np.ndarray) -> np.ndarray:
    """Maps (..., 3, 4) that scale, then turn, then move."""
    return np.concatenate([rotation_X33 * scale_X3[..., None, :], translation_X3[..., None]], axis=-1)


def in_world(local_FN34: np.ndarray, parents: Sequence[int]) -> np.ndarray:
    """Where nodes (F, N, 3, 4) are in the world, of where they are in their parents, which come before them."""
    world_FN34 = local_FN34.copy()
    with np.errstate(all="ignore"):  # what is beyond all bounds is refused afterwards
        for place, parent in enumerate(parents):
            if parent >= 0:
                above_F34 = world_FN34[:, parent]
                world_FN34[:, place] = above_F34[..., :3] @ local_FN34[:, place]
                world_FN34[:, place, :, 3] += above_F34[..., 3]
    return world_FN34


def may_be_joints(nodes: Sequence[Node], every: bool) -> list[int]:
    """The places of nodes that may be joints: bones and what they hang on; all nodes where too few are bones, or every
    one is asked for. The rest of a large scene, a house for instance, need not be worked out.
    """
    bones = [place for place, node in enumerate(nodes) if node.is_bone]
    if every or len(bones) < _FEWEST_BONES:
        return list(range(len(nodes)))
    kept: set[int] = set()
    for bone in bones:
        place = bone
        while place >= 0 and place not in kept:
            kept.add(place)
            place = nodes[place].parent
    return sorted(kept)


class BadScene(ValueError):
    """Nodes of a scene cannot be; says why, for a sentence about the file."""


class TooLarge(ValueError):
    """A scene moves in more numbers than are read."""


def scene_tree(scene: Scene, animation: Animation, time_T: np.ndarray, rest: Rest) -> JointTree:
    """The tree of a scene's nodes, whose angles are 0 at rest.

    Args:
        scene: the nodes.
        animation: what moves them.
        time_T: times (T,) of the frames [s].
        rest: the pose at rest.

    Raises:
        TooLarge: there are too many frames and nodes.
        BadScene: nodes are nowhere, or scaled to nothing; says which.
    """
    count, parents = len(scene.nodes), [node.parent for node in scene.nodes]
    if count > _MAX_JOINTS or 6 * count * len(time_T) > _MAX_NUMBERS:
        raise TooLarge(f"{len(time_T):,} frames of {count:,} nodes")
    _check(scene, rest.world_N34[None])
    inverse_N33 = np.linalg.inv(rest.world_N34[..., :3])
    value_TN6 = np.zeros((len(time_T), count, 6), np.float32)
    """Places in the parent's axes, and angles about z, y, x [deg]."""
    size = max(1, _BLOCK_NUMBERS // (12 * count))
    for begin in range(0, len(time_T), size):
        block = slice(begin, begin + size)
        world_FN34 = in_world(animation.local_FN34(time_T[block]), parents)
        _check(scene, world_FN34)
        turn_FN33 = orthonormal(world_FN34[..., :3] @ inverse_N33)
        for place, parent in enumerate(parents):
            point_F3, turn_F33 = world_FN34[:, place, :, 3], turn_FN33[:, place]
            if parent >= 0:
                back_F33 = turn_FN33[:, parent].mT
                point_F3 = (back_F33 @ (point_F3 - world_FN34[:, parent, :, 3])[..., None])[..., 0]
                turn_F33 = back_F33 @ turn_F33
            value_TN6[block, place] = np.concatenate([point_F3, angles_zyx(turn_F33)], axis=-1)
    return _tree([node.name for node in scene.nodes], parents, rest.world_N34[..., 3], value_TN6, rest.name)


def _tree(
    names: list[str], parents: list[int], rest_N3: np.ndarray, value_TN6: np.ndarray, rest_name: str
) -> JointTree:
    """The joints, with numbers for what moves alone."""
    extent = float(norm(np.ptp(rest_N3, axis=0)))
    joints, columns = [], []
    for place, (name, parent) in enumerate(zip(names, parents, strict=True)):
        offset_3 = rest_N3[place] - (rest_N3[parent] if parent >= 0 else 0.0)
        rows_T6 = value_TN6[:, place]
        position, rotation = (), ()
        if parent < 0 or norm(rows_T6[:, :3] - offset_3).max() > _STILL * extent:
            # a position takes the place of an offset
            position = tuple((axis, len(columns) + i) for i, axis in enumerate("xyz"))
            columns += [rows_T6[:, i] for i in range(3)]
            offset_3 = np.zeros(3)
        if np.abs(rows_T6[:, 3:]).max() > np.degrees(_STILL):
            rotation = tuple((axis, len(columns) + i) for i, axis in enumerate("zyx"))
            columns += [rows_T6[:, 3 + i] for i in range(3)]
        x, y, z = offset_3.tolist()
        joints.append(Joint(name, parent, (x, y, z), rotation, position))
    return JointTree(tuple(joints), np.stack(columns, axis=1), rest_name)


def _check(scene: Scene, world_FN34: np.ndarray) -> None:
    """Refuses nodes that are nowhere or have no axes."""
    with np.errstate(all="ignore"):
        volume_FN = np.abs(np.linalg.det(world_FN34[..., :3]))
        length_FN = np.abs(world_FN34[..., :3]).max(axis=(-1, -2))
        good_FN = (np.abs(world_FN34[..., 3]) < _LARGEST).all(-1)
        good_FN &= (length_FN < _LARGEST) & (volume_FN > _FLAT * length_FN**3)
    if not good_FN.all():
        node = scene.nodes[int(np.argwhere(~good_FN)[0][1])]
        raise BadScene(f"'{shortened(node.name, 40)}' is at no place, or scaled to nothing")
