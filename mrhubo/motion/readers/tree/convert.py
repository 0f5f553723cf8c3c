"""A tree of joints that moves, to a motion of our skeleton.

Bones' own rotations tell how trunk, head, hands and feet are turned (`mrhubo.motion.readers.tree.parts`); where limbs
point is told by points alone.

Legend: T frames, F some of them. World of the outcome: y up, right-handed [m].
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.tree.anatomy import find_anatomy
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.parts import Frames, find_hinges, find_parts
from mrhubo.motion.readers.tree.reference import find_reference, first_frame_jumps
from mrhubo.motion.readers.tree.world import to_y_up, unit_of, up_axis

_SAMPLES = 512
"""Frames that tell how bones are turned against the parts that they stand for."""
_BLOCK = 8_192
"""Frames that are worked out at a time."""


@dataclass(frozen=True)
class Given:
    """What the user says of a tree."""

    place: Mapping[str, int] = dataclasses.field(default_factory=dict)
    """Joints, by the names of ours."""
    up: str | None = None
    """The axis that is up."""
    unit: float | None = None
    """Metres."""


def tree_motion(
    tree: JointTree,
    name: str,
    what: str,
    frame_rate: float,
    kind: str,
    given: Given,
    notes: tuple[str, ...] = (),
    told_up: str | None = None,
) -> Motion:
    """The motion of a tree.

    Args:
        tree: the joints and their motion.
        name: of the motion.
        what: the file, for sentences.
        frame_rate: frames per second.
        kind: what the file is, for `Motion.source`.
        given: what the user says.
        notes: what the reader has to say.
        told_up: the axis that is up, as the file says; `AT_REST` if it is the one along which a body stands at rest.

    Raises:
        UserError: no body is found in the tree.
    """
    anatomy = find_anatomy(tree, given.place, what)
    place, remarks = anatomy.place, [*notes, *anatomy.notes]
    reference = find_reference(tree, place)
    if first_frame_jumps(tree, place):
        tree = dataclasses.replace(tree, value_TC=tree.value_TC[1:])
        remarks.append("the first frame is a pose at rest from which the motion jumps away: left out")
    frames = np.unique(np.linspace(0, len(tree) - 1, _SAMPLES).astype(int))
    pose = tree.pose(frames, list(place.values()))
    axis, why = up_axis(pose, place, reference, given.up, told_up, remarks)
    unit, unit_name = unit_of(pose, place, given.unit)
    world_33 = to_y_up(axis)
    spine = [above for above in tree.above(place["spine3"]) if place["pelvis"] in tree.above(above)[1:]]
    sample = _read(tree, frames, {**place, "below": spine[-1]} if spine else place, world_33, unit)
    if reference is not None:
        reference = reference.in_world(world_33, unit)
    parts, hinges = find_parts(tree, sample, reference, place), find_hinges(sample, reference)
    blocks = [_read(tree, slice(start, start + _BLOCK), place, world_33, unit) for start in range(0, len(tree), _BLOCK)]
    points = {joint: np.concatenate([block.point[joint] for block in blocks]) for joint in place}
    turns, axes = (
        {joint: np.concatenate([block.turn[joint] @ constant for block in blocks]) for joint, constant in found.items()}
        for found in (parts, hinges)
    )
    rest = f"rest is {reference.what}" if reference else "no pose at rest: how parts are turned is told by the motion"
    source = (
        f"{kind} {len(tree.joints)} joints, {unit_name}, {axis} up ({why}); {rest}; the chest is "
        f"'{tree.names[place['spine3']]}'"
    )
    return motion_from_points(BodyPoints(points, turns, axes), name, frame_rate, source, tuple(remarks), what)


def _read(
    tree: JointTree, frames: slice | np.ndarray, place: Mapping[str, int], world_33: np.ndarray, unit: float
) -> Frames:
    """Our joints in some frames, in the y-up world."""
    pose = tree.pose(frames, list(place.values()))
    point = {name: unit * pose.point[p] @ world_33.T for name, p in place.items()}
    turn = {name: world_33 @ pose.matrix[p] for name, p in place.items()}
    return Frames(point, turn)
