"""A tree of joints that moves, to a motion of our skeleton.

Bones' own rotations tell how trunk, head, hands and feet are turned, once it is known how they are turned in one pose;
where limbs point is told by points alone.

Legend: T frames, F some of them. World of the outcome: y up, right-handed [m].
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from mrhubo.body.anatomy import hinge_axis
from mrhubo.body.skeleton import SIDES
from mrhubo.motion.motion import Motion
from mrhubo.motion.orientations import rest_points, turn_of
from mrhubo.motion.positions import BENT, BodyPoints, motion_from_points
from mrhubo.motion.readers.tree.anatomy import find_anatomy
from mrhubo.motion.readers.tree.hands import hand_axes
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.reference import Reference, find_reference, first_frame_jumps
from mrhubo.motion.readers.tree.world import to_y_up, unit_of, up_axis
from mrhubo.rotation import shortest_turn

_SAMPLES = 512
"""Frames that tell how bones are turned against the parts that they stand for."""
_BLOCK = 8_192
"""Frames that are worked out at a time."""
_STEADY = 0.9
"""Length of a mean of unit vectors from which on they agree: they spread by some 25 degrees."""
_ENOUGH = 10
"""Frames in which a limb must be bent, to tell the axis of its hinge."""
_HINGES = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))


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
    tree: JointTree, name: str, what: str, frame_rate: float, kind: str, given: Given, notes: tuple[str, ...] = ()
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

    Raises:
        UserError: no body is found in the tree.
    """
    anatomy = find_anatomy(tree, given.place, what)
    place, remarks = anatomy.place, [*notes, *anatomy.notes]
    reference = find_reference(tree, place)
    if first_frame_jumps(tree, place, reference):
        tree = dataclasses.replace(tree, value_TC=tree.value_TC[1:])
        remarks.append("the first frame is a pose at rest from which the motion jumps away: left out")
    frames = np.unique(np.linspace(0, len(tree) - 1, _SAMPLES).astype(int))
    pose = tree.pose(frames, list(place.values()))
    axis, why = up_axis(pose, place, reference, given.up)
    unit, unit_name = unit_of(pose, place, given.unit)
    world_33 = to_y_up(axis)
    sample = _read(tree, frames, place, world_33, unit)
    parts = _parts(tree, sample, reference, place)
    hinges = _hinges(sample, reference)
    blocks = [_read(tree, slice(start, start + _BLOCK), place, world_33, unit) for start in range(0, len(tree), _BLOCK)]
    points = {n: torch.cat([block.point[n] for block in blocks]) for n in sample.point}
    turns = {n: torch.cat([block.turn[n] @ part_33 for block in blocks]) for n, part_33 in parts.items()}
    axes = {n: torch.cat([block.turn[n] @ axis_3 for block in blocks]) for n, axis_3 in hinges.items()}
    rest = f"rest is {reference.what}" if reference else "no pose at rest: how parts are turned is told by the motion"
    source = (
        f"{kind} {len(tree.joints)} joints, {unit_name}, {axis} up ({why}); {rest}; the chest is "
        f"'{tree.names[place['spine3']]}'"
    )
    return motion_from_points(BodyPoints(points, turns, axes), name, frame_rate, source, tuple(remarks))


@dataclass(frozen=True)
class _Frames:
    """Our joints in some frames, in the y-up world."""

    point: dict[str, Tensor]
    turn: dict[str, Tensor]
    """How the file's bones are turned, relative to how they are at all angles 0."""


def _read(
    tree: JointTree, frames: slice | np.ndarray, place: Mapping[str, int], world_33: np.ndarray, unit: float
) -> _Frames:
    pose = tree.pose(frames, list(place.values()))
    turn_to_world = Rotation.from_matrix(world_33)
    point = {name: torch.from_numpy(unit * pose.point[p] @ world_33.T) for name, p in place.items()}
    turn = {name: torch.from_numpy((turn_to_world * pose.turn[p]).as_matrix()) for name, p in place.items()}
    return _Frames(point, turn)


def _parts(
    tree: JointTree,
    sample: _Frames,
    reference: Reference | None,
    place: Mapping[str, int],
) -> dict[str, Tensor]:
    """By what constant turn (3, 3) each part's bone differs from the part: part = bone @ constant."""
    parts: dict[str, Tensor] = {}
    at_rest = {} if reference is None else {name: _inverse(turn) for name, turn in reference.turn.items()}
    axes_33 = None if reference is None else torch.from_numpy(reference.axes_33)
    for name in ("pelvis", "spine3", "head"):
        if name not in sample.turn:
            continue
        if axes_33 is not None:
            parts[name] = at_rest[name] @ axes_33
            continue
        seen = turn_of(name, sample.point) if name != "head" else sample.turn["spine3"] @ parts["spine3"]
        constant = None if seen is None else _mean(sample.turn[name].mT @ seen)
        if constant is not None:
            parts[name] = constant
    rest = rest_points()
    for side in SIDES:
        wrist, ankle, foot = f"{side}_wrist", f"{side}_ankle", f"{side}_foot"
        out_3 = torch.nn.functional.normalize(rest[wrist] - rest[f"{side}_elbow"], dim=-1)[0]
        fingers_33 = hand_axes(tree, place[wrist])
        if fingers_33 is not None:
            own_33 = torch.stack((out_3, _Z, torch.linalg.cross(out_3, _Z)), dim=-1)
            parts[wrist] = torch.from_numpy(fingers_33) @ own_33.T
        elif reference is not None and axes_33 is not None:
            parts[wrist] = at_rest[wrist] @ _swung(reference, axes_33, f"{side}_elbow", wrist, out_3)
        if foot in sample.point:
            seen = turn_of(ankle, sample.point)
            constant = None if seen is None else _mean(sample.turn[ankle].mT @ seen)
            if reference is not None and axes_33 is not None:  # soles are flat at rest; toes may point outward
                toe_3 = axes_33.T @ torch.from_numpy(reference.point[foot] - reference.point[ankle])
                yaw = torch.atan2(toe_3[0], toe_3[2]) if toe_3[[0, 2]].norm() > 0.1 * toe_3.norm() else 0.0 * toe_3[0]
                parts[ankle] = at_rest[ankle] @ axes_33 @ _about_y(yaw)
            elif constant is not None:
                parts[ankle] = constant
    return parts


def _hinges(sample: _Frames, reference: Reference | None) -> dict[str, Tensor]:
    """The axis (3,) of elbow or knee in the axes of the bone above: where the two bones bend, by their plane over the
    motion; else as at rest.
    """
    found: dict[str, Tensor] = {}
    rest = rest_points()
    for side in SIDES:
        for joints in _HINGES:
            upper, hinge, tip = (f"{side}_{name}" for name in joints)
            bone_T3, lower_T3 = (
                torch.nn.functional.normalize(sample.point[end] - sample.point[start], dim=-1)
                for start, end in ((upper, hinge), (hinge, tip))
            )
            cross_T3 = torch.linalg.cross(bone_T3, lower_T3)
            bent_T = (cross_T3.norm(dim=-1) > np.sin(BENT)) & ((bone_T3 * lower_T3).sum(-1) > -0.9)
            own_T3 = (sample.turn[upper].mT @ torch.nn.functional.normalize(cross_T3, dim=-1)[..., None])[..., 0]
            mean_3 = own_T3[bent_T].mean(dim=0) if int(bent_T.sum()) >= _ENOUGH else torch.zeros(3).double()
            if float(mean_3.norm()) > _STEADY:
                found[upper] = torch.nn.functional.normalize(mean_3, dim=0)
            elif reference is not None:
                axes_33 = torch.from_numpy(reference.axes_33)
                bone_3 = torch.nn.functional.normalize(rest[hinge] - rest[upper], dim=-1)[0]
                swung_33 = _swung(reference, axes_33, upper, hinge, bone_3)
                axis_3 = torch.tensor(hinge_axis(hinge), dtype=torch.float64)
                found[upper] = _inverse(reference.turn[upper]) @ swung_33 @ axis_3
    return found


_Z = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)


def _swung(reference: Reference, axes_33: Tensor, start: str, end: str, bone_3: Tensor) -> Tensor:
    """How a limb at rest is turned (3, 3) if it was swung there from our rest pose without a twist."""
    way_3 = axes_33.T @ torch.from_numpy(reference.point[end] - reference.point[start])
    return axes_33 @ shortest_turn(bone_3, torch.nn.functional.normalize(way_3, dim=0))


def _inverse(turn: Rotation) -> Tensor:
    return torch.from_numpy(turn.inv().as_matrix()[0])


def _about_y(angle: Tensor) -> Tensor:
    return torch.from_numpy(Rotation.from_euler("y", float(angle)).as_matrix())


def _mean(rotation_F33: Tensor) -> Tensor | None:
    """The mean rotation (3, 3) of those that are finite (chordal, by Markley et al. 2007); None where there is none."""
    good_F33 = rotation_F33[torch.isfinite(rotation_F33).flatten(1).all(-1)]
    return torch.from_numpy(Rotation.from_matrix(good_F33.numpy()).mean().as_matrix()) if len(good_F33) else None
