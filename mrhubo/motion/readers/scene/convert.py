"""The motion of a body in a scene: of which animation, by which pose at rest, at which rate.

Legend: T frames.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.assemble import MAX_FRAMES
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.names import motion_name, several
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import told_rate
from mrhubo.motion.readers.scene.nodes import Animation, BadScene, Rest, Scene, TooLarge, scene_tree
from mrhubo.motion.readers.tree.anatomy import NEEDED, NoBody, find_anatomy
from mrhubo.motion.readers.tree.convert import Given, tree_motion
from mrhubo.motion.readers.tree.given import read_map
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.people import of_person
from mrhubo.motion.readers.tree.reference import find_reference
from mrhubo.motion.readers.tree.world import named_axis

_NEARLY = 1e-3
"""Of a frame: times are rounded."""
_TESTED = 64
"""Frames by which a pose at rest is looked at."""
_GLIMPSES, _TURNED = 8, 0.01
"""Frames by which it is told whether nodes turn; and how much the axes of one must change, of the longest of them."""
_SAME_DEG, _MOST = 0.5, 0.9
"""Angles that are as in another pose; and the share of them, in a pose that is the same."""


def body_motion(
    path: Path, scene_of: Callable[[bool], Scene], kind: str, options: ReadOptions, notes: list[str]
) -> Motion:
    """The motion of one body: of bones, or of all nodes where what a file calls bones makes no body, as of a figure
    of rigid parts that wears a cape.

    Args:
        path: the file, for sentences.
        scene_of: what it holds, of bones (False) or of all nodes (True).
        kind: what the file is, for `Motion.source`.
        options: as of `scene_motion`.
        notes: is told what the file leaves open.

    Raises:
        NoMotion: nothing moves in it, or no body is found.
        UserError: it is too large, or has no animation or person that is asked for.
    """
    bones = scene_of(False)
    try:
        return scene_motion(path, bones, kind, options, list(notes))
    except NoMotion as error:
        every = scene_of(True) if isinstance(error.__cause__, NoBody) else bones
        if len(every.nodes) > len(bones.nodes):
            with contextlib.suppress(UserError):
                return scene_motion(path, every, kind, options, notes)
        raise


def scene_motion(path: Path, scene: Scene, kind: str, options: ReadOptions, notes: list[str]) -> Motion:
    """The motion of one body in a scene.

    Args:
        path: the file, for sentences.
        scene: what it holds.
        kind: what the file is, for `Motion.source`.
        options: may tell a rate, an animation, a person, and joints.
        notes: is told what the file leaves open.

    Raises:
        NoMotion: nothing moves in it, or no body is found.
        UserError: it is too large, or has no animation or person that is asked for.
    """
    animation = _chosen(path, scene, options, notes)
    name = shortened(animation.name, 40)
    rate = _rate(path, animation, name, options, notes)
    frames = int(np.floor((animation.end - animation.start) * rate + _NEARLY)) + 1
    if frames > MAX_FRAMES:
        raise UserError(f"{path}: '{name}' has {frames:,} frames; at most {MAX_FRAMES:,} are read")
    time_T = np.minimum(animation.start + np.arange(frames) / rate, animation.end)
    body = scene.body if scene.body.keys() >= set(NEEDED) else {}
    try:
        rest = _standing(path, scene, animation, time_T, body)
        tree = scene_tree(scene, animation, time_T, rest)
        if body:
            notes += options.of_one()
        else:
            tree = of_person(path, tree, options, notes)
        given = read_map(options.bvh_map, tree, path) if options.bvh_map else Given()
        given = dataclasses.replace(given, place={**body, **given.place})
        said = f"{kind} '{name}':" if name else f"{kind}:"
        return tree_motion(tree, motion_name(path), str(path), rate, said, given, tuple(notes), scene.up)
    except TooLarge as error:
        raise UserError(f"{path}: has {error}, more than are read; cut it, or export the skeleton alone") from error
    except NoBody as error:
        raise NoMotion(str(error)) from error
    except BadScene as error:
        raise UserError(f"{path}: {error}") from error


def _rate(path: Path, animation: Animation, name: str, options: ReadOptions, notes: list[str]) -> float:
    """Frames per second: what the keys tell, or the options, or else what is usual, with a note."""
    if not animation.note:
        return told_rate(path, f"animation '{name}' has", animation.rate, options, notes)
    if options.rate is not None:
        return float(options.rate)
    if animation.end > animation.start:
        notes.append(
            f"'{name}' {animation.note}: it is read at {animation.rate:g} frames a second; --rate says otherwise"
        )
    return animation.rate


def _chosen(path: Path, scene: Scene, options: ReadOptions, notes: list[str]) -> Animation:
    """The animation that is asked for, or the longest in which something turns."""
    if not scene.animations:
        raise NoMotion(f"{path}: holds a scene in which nothing moves; export the animation with it")
    by_length = sorted(scene.animations, key=lambda animation: animation.start - animation.end)
    told = [(animation.name, f"{animation.end - animation.start:.3g} s") for animation in by_length]
    if options.animation is None:
        if len(by_length) < 2:
            return by_length[0]
        longest = next(filter(_turns, by_length), by_length[0])
        still = " in which something turns" if longest is not by_length[0] else ""
        notes.append(
            f"'{shortened(longest.name, 40)}' is the longest animation{still} and was taken; there are {several(told)};"
            " --animation or ReadOptions(animation=...) takes another"
        )
        return longest
    for animation in by_length:
        if animation.name == options.animation:
            return animation
    present = several(told, options.animation)
    raise UserError(f"{path}: has no animation '{shortened(options.animation, 40)}'; there are {present}")


def _turns(animation: Animation) -> bool:
    """Whether nodes turn: programs leave takes beside the others that hold one pose for long."""
    axes_FN33 = animation.local_FN34(np.linspace(animation.start, animation.end, _GLIMPSES))[..., :3]
    changes_N, long_N = np.ptp(axes_FN33, axis=0).max(axis=(-1, -2)), np.abs(axes_FN33).max(axis=(0, -1, -2))
    return bool((changes_N > _TURNED * long_N).any())


def _standing(path: Path, scene: Scene, animation: Animation, time_T: np.ndarray, body: Mapping[str, int]) -> Rest:
    """The first pose at rest in which a body stands so; where it does in none, the first pose, without a name."""
    some_T = time_T[np.unique(np.linspace(0, len(time_T) - 1, _TESTED).astype(int))]
    for rest in scene.rests:
        tree = scene_tree(scene, animation, some_T, rest)
        if _is_rest(path, tree, body, rest.up) and not (rest.may_move and _begins_so(tree)):
            return rest
    return dataclasses.replace(scene.rests[0], name="")


def _is_rest(path: Path, tree: JointTree, body: Mapping[str, int], up: str | None) -> bool:
    try:
        anatomy = find_anatomy(tree, body, str(path))
    except UserError:  # said by who reads the tree
        return False
    found = find_reference(tree, anatomy.place)
    if found is None or found.what != tree.rest_name:
        return False
    return up is None or named_axis(found.axes_33[:, 1]) == up


def _begins_so(tree: JointTree) -> bool:
    """Whether a motion begins in its pose at rest: nodes that nobody put to rest are as in the first frame."""
    columns = [column for joint in tree.joints for _, column in joint.rotation]
    return not columns or bool((np.abs(tree.value_TC[0, columns]) < _SAME_DEG).mean() > _MOST)
