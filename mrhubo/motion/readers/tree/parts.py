"""How a file's bones are turned against the parts of a body that they stand for.

Where there is a pose at rest, that tells. Else the shape of a bone tells, as far as it is rigid: where shoulders and
neck are on the chest, hips and spine on the pelvis; and what is rigid nowhere is told by the mean over the motion:
people look where their chest faces.

World: y up, right-handed [m]. Legend: F frames.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import SIDES, hinge_axis
from mrhubo.fast.plain.human import cross, norm, normalize
from mrhubo.fast.plain.judging import quaternions
from mrhubo.fast.rotations import axis_angle_to_matrix, shortest_turn, turned
from mrhubo.motion.hinges import BENT
from mrhubo.motion.orientations import frame_of, known_frames, rest_points, turn_of
from mrhubo.motion.readers.tree.hands import hand_axes
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.reference import Reference

_STEADY = 0.9
"""Length of a mean of unit vectors from which on they agree: they spread by some 25 degrees."""
_ENOUGH = 10
"""Frames in which a limb must be bent, to tell the axis of its hinge."""
_NEAR_UP = np.cos(np.radians(20.0))
"""An axis of a bone as near as this to where up seems to be on pelvis or head is meant to be up, if another is left."""
_NEAR_LEFT = {"pelvis": np.cos(np.radians(3.0)), "head": np.cos(np.radians(20.0))}
"""How near that one is: hips tell it exactly, a head that looks about does not."""
_SHORT = 1e-3
"""Two joints nearer to each other [m] are in one place."""
_HINGES = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Frames:
    """Our joints in some frames."""

    point: dict[str, np.ndarray]
    """(F, 3)."""
    turn: dict[str, np.ndarray]
    """How the file's bones are turned (F, 3, 3), relative to how they are at all angles 0."""


def find_parts(
    tree: JointTree, sample: Frames, reference: Reference | None, place: Mapping[str, int]
) -> dict[str, np.ndarray]:
    """By what constant turn (3, 3) each part's bone differs from the part: part = bone @ constant; by the names of our
    joints, of trunk, head, hands and feet, as far as anything tells.

    Args:
        tree: the joints and their motion.
        sample: frames of all parts of the motion; `below` in it is the first joint of the spine.
        reference: the pose at rest, if there is one.
        place: which joint is which.
    """
    parts = _upright_parts(sample) if reference is None else _resting_parts(sample, reference)
    rest = rest_points()
    for side in SIDES:
        wrist = f"{side}_wrist"
        out_3 = normalize(rest[wrist] - rest[f"{side}_elbow"])[0]
        fingers_33 = hand_axes(tree, place[wrist])
        if fingers_33 is not None:
            own_33 = np.stack((out_3, _Z, cross(out_3, _Z)), axis=-1)
            parts[wrist] = fingers_33 @ own_33.T
        elif reference is not None:
            parts[wrist] = reference.turn[wrist].T @ _swung(reference, f"{side}_elbow", wrist, out_3)
    return parts


def find_hinges(sample: Frames, reference: Reference | None) -> dict[str, np.ndarray]:
    """The axis (3,) of elbow or knee in the axes of the bone above, by the joint above: where the two bones bend, by
    their plane over the motion; else as at rest.
    """
    found: dict[str, np.ndarray] = {}
    rest = rest_points()
    for side in SIDES:
        for joints in _HINGES:
            upper, hinge, tip = (f"{side}_{name}" for name in joints)
            bone_F3, lower_F3 = (
                normalize(sample.point[end] - sample.point[start]) for start, end in ((upper, hinge), (hinge, tip))
            )
            cross_F3 = cross(bone_F3, lower_F3)
            bent_F = norm(cross_F3) > np.sin(BENT)
            own_F3 = turned(sample.turn[upper].mT, normalize(cross_F3))
            mean_3 = own_F3[bent_F].mean(axis=0) if int(bent_F.sum()) >= _ENOUGH else np.zeros(3)
            if norm(mean_3) > _STEADY:
                found[upper] = normalize(mean_3)
            elif reference is not None:
                bone_3 = normalize(rest[hinge] - rest[upper])[0]
                axis_3 = np.array(hinge_axis(hinge))
                found[upper] = reference.turn[upper].T @ _swung(reference, upper, hinge, bone_3) @ axis_3
    return found


def _resting_parts(sample: Frames, reference: Reference) -> dict[str, np.ndarray]:
    """At rest trunk and head are upright, and soles flat, though toes may point outward, as far as they are there."""
    axes_33 = reference.axes_33
    at_rest = {name: turn.T for name, turn in reference.turn.items()}
    parts = {name: at_rest[name] @ axes_33 for name in ("pelvis", "spine3", "head") if name in sample.turn}
    for side in SIDES:
        ankle, foot, yaw = f"{side}_ankle", f"{side}_foot", 0.0
        if foot in sample.point:
            toe_3 = axes_33.T @ (reference.point[foot] - reference.point[ankle])
            level = norm(toe_3[[0, 2]]) > 0.1 * norm(toe_3)
            yaw = float(np.arctan2(toe_3[0], toe_3[2])) if level else 0.0
        parts[ankle] = at_rest[ankle] @ axes_33 @ axis_angle_to_matrix(np.array([0.0, yaw, 0.0]))
    return parts


def _upright_parts(sample: Frames) -> dict[str, np.ndarray]:
    """By shapes of bones and means over the motion."""
    rest = rest_points()
    rest["below"] = rest["spine1"]
    hips, shoulders, collars = (tuple(f"{side}_{name}" for side in SIDES) for name in ("hip", "shoulder", "collar"))
    parts: dict[str, np.ndarray] = {}
    if set(collars) <= sample.point.keys():  # they do not move on the chest, but may be in one place
        left_F3, right_F3 = (sample.point[collar] for collar in collars)
        shoulders = collars if norm(left_F3 - right_F3).mean() > _SHORT else shoulders
    for name, (left, right), up in (("pelvis", hips, (hips, "below")), ("spine3", shoulders, (("spine3",), "neck"))):
        start, end = up
        frames = []
        for point, turn_F33 in ((sample.point, sample.turn[name]), (rest, np.eye(3)[None])):
            if end not in point:
                continue
            line = [point[left] - point[right], point[end] - np.stack([point[n] for n in start]).mean(0)]
            mean = [turned(turn_F33.mT, vector_F3).mean(axis=0)[None] for vector_F3 in line]
            if np.linalg.norm(mean[1]) > _SHORT:
                frames.append(frame_of(mean[0], mean[1])[0])
        seen = turn_of(name, sample.point)
        if len(frames) == 2 and np.isfinite(frames[0]).all():
            parts[name] = frames[0] @ frames[1].T
        elif seen is not None and (mean_33 := _mean(sample.turn[name].mT @ seen)) is not None:
            parts[name] = mean_33
    if "pelvis" in parts:
        parts["pelvis"] = _snapped(parts["pelvis"], "pelvis")
    if "head" in sample.turn and "spine3" in parts:
        head_33 = _mean(sample.turn["head"].mT @ sample.turn["spine3"] @ parts["spine3"])
        if head_33 is not None:
            parts["head"] = _snapped(head_33, "head")
    for side in SIDES:
        seen = turn_of(f"{side}_ankle", sample.point) if f"{side}_foot" in sample.point else None
        mean_33 = None if seen is None else _mean(sample.turn[f"{side}_ankle"].mT @ seen)
        if mean_33 is not None:
            parts[f"{side}_ankle"] = mean_33
    return parts


def _snapped(part_33: np.ndarray, name: str) -> np.ndarray:
    """The constant with up along the bone's axis that is nearest, if the bone's axes are meant to be left and up."""
    up_3 = part_33[:, 1]
    largest = int(np.abs(up_3).argmax())
    if abs(up_3[largest]) < _NEAR_UP or np.abs(part_33[:, 0]).max() < _NEAR_LEFT[name]:
        return part_33
    axis_3 = np.zeros_like(up_3)
    axis_3[largest] = np.sign(up_3[largest])
    return shortest_turn(up_3, axis_3) @ part_33


def _swung(reference: Reference, start: str, end: str, bone_3: np.ndarray) -> np.ndarray:
    """How a limb at rest is turned (3, 3) if it was swung there from our rest pose without a twist."""
    axes_33 = reference.axes_33
    way_3 = axes_33.T @ (reference.point[end] - reference.point[start])
    return axes_33 @ shortest_turn(bone_3, normalize(way_3))


def _mean(rotation_F33: np.ndarray) -> np.ndarray | None:
    """The mean rotation (3, 3) of those that are finite (F. L. Markley et al., "Averaging Quaternions", Journal of
    Guidance, Control, and Dynamics 2007); None where there is none.
    """
    good_F33 = rotation_F33[known_frames(rotation_F33)]
    if not len(good_F33):
        return None
    quaternion_F4 = quaternions(good_F33)
    mean_4 = np.linalg.eigh(quaternion_F4.T @ quaternion_F4).eigenvectors[:, -1]  # of the largest eigenvalue
    return axis_angle_to_matrix(normalize(mean_4[:3]) * 2 * np.arctan2(norm(mean_4[:3]), mean_4[3]))
