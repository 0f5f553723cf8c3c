"""A pose of a file's skeleton of which we know how each part is turned: upright, legs down, arms at the sides or out.

Half of all files have such a pose where all angles are 0; some have it as their first frame, which is then no part of
the motion. Others (whose bones all point along one axis at 0) have none.

Frame: the file's own world.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.fast.rotations import turned
from mrhubo.motion.readers.tree.hierarchy import JointTree, Pose

_UPRIGHT_DEG = 30.0
"""How far legs may be from the line of the trunk, at rest."""
_LEVEL_DEG = 20.0
"""How far the line of the hips may be from that of the shoulders, and both from a right angle with the trunk."""
_STRAIGHT_DEG = 45.0
"""How far arms and legs may be bent: models stand with loose elbows."""
_ALIKE_DEG = 25.0
"""How far one arm may be from the mirror image of the other."""
_MIRRORED_DEG = 1.0
"""The same of all limbs in a pose that somebody made, and that is no moment of a motion."""
_ARMS_UP_DEG = 50.0
"""Arms at rest hang, or are held out, at least by this angle from straight up."""
_SNAP_DEG = 12.0
"""Trunk and hips that are as near to an axis of the file are meant to be along it."""
_ARM, _LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")
_JUMP = 2.0
"""How many times as far as in the next steps joints move from a first frame that is no part of the motion. Who really
starts from a pose moves less in the first step than in those that follow."""
_JUMP_LEAST = 0.15
"""The least that they then move, of a leg's length."""
_STEPS = 6
"""Steps that the first one is compared with."""


@dataclass(frozen=True)
class Reference:
    """A pose at rest."""

    point: Mapping[str, np.ndarray]
    """(3,) by our joints' names."""
    turn: Mapping[str, np.ndarray]
    """(3, 3) by our joints' names."""
    axes_33: np.ndarray
    """Columns: the body's left, up and forward."""
    what: str
    """In words."""

    def in_world(self, world_33: np.ndarray, unit: float) -> Reference:
        """The same in another world, into which a turn leads, in metres."""
        return Reference(
            {name: unit * world_33 @ point_3 for name, point_3 in self.point.items()},
            {name: world_33 @ turn for name, turn in self.turn.items()},
            world_33 @ self.axes_33,
            self.what,
        )


def find_reference(tree: JointTree, place: Mapping[str, int]) -> Reference | None:
    """The pose at all angles 0 if it is one of rest, else the first frame if that is; None where neither is.

    Args:
        tree: the joints and their motion.
        place: which joint is which (`mrhubo.motion.readers.tree.anatomy`).
    """
    for pose, what, strict in (
        (tree.rest(), tree.rest_name, False),
        (tree.pose(slice(0, 1), list(place.values())), "its first frame", True),
    ):
        found = _read(pose, place, what, strict) if what else None
        if found is not None:
            return found
    return None


def first_frame_jumps(tree: JointTree, place: Mapping[str, int]) -> bool:
    """Whether the first frame is a pose at rest from which the motion jumps away."""
    if len(tree) < 4 or _read(tree.pose(slice(0, 1), list(place.values())), place, "", True) is None:
        return False
    pose = tree.pose(slice(0, _STEPS + 2), list(place.values()))
    back_F33, hips_F3 = pose.matrix[place["pelvis"]].mT, pose.point[place["pelvis"]]
    ends = [pose.point[place[f"left_{name}"]][0] for name in ("hip", "knee", "ankle")]
    leg = np.linalg.norm(np.diff(ends, axis=0), axis=-1).sum()
    for seen in (  # from the hips; and in the world, where the body may turn round or be moved as a whole
        [turned(back_F33, pose.point[p] - hips_F3) for p in place.values()],
        [pose.point[p] for p in place.values()],
    ):
        step_F = np.linalg.norm(np.diff(np.stack(seen), axis=1), axis=-1).max(0)
        if step_F[0] > max(_JUMP * step_F[1:].max(), _JUMP_LEAST * leg):
            return True
    return False


def _read(pose: Pose, place: Mapping[str, int], what: str, strict: bool) -> Reference | None:
    """The pose as one of rest, if it is. Strict: arms are straight, and held out, or else both sides are alike to the
    degree, as nobody's are by chance.
    """
    point = {name: pose.point[p][0] for name, p in place.items()}
    turn = {name: pose.matrix[p][0] for name, p in place.items()}
    hips = point["left_hip"] - point["right_hip"]
    shoulders = point["left_shoulder"] - point["right_shoulder"]
    up = (point["left_shoulder"] + point["right_shoulder"]) - (point["left_hip"] + point["right_hip"])
    if min(map(np.linalg.norm, (hips, shoulders, up))) < 1e-9:
        return None
    wrong = angle(hips, shoulders) > _LEVEL_DEG or any(abs(angle(up, x) - 90) > _LEVEL_DEG for x in (hips, shoulders))
    arms, level = [], True
    for side in ("left", "right"):
        hip, knee, ankle, shoulder, elbow, wrist = (
            point[f"{side}_{name}"] for name in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
        )
        wrong |= angle(hip - ankle, up) > _UPRIGHT_DEG
        wrong |= angle(knee - hip, ankle - knee) > _STRAIGHT_DEG
        wrong |= angle(elbow - shoulder, wrist - elbow) > (_STRAIGHT_DEG if not strict else _LEVEL_DEG)
        wrong |= angle(wrist - shoulder, up) < _ARMS_UP_DEG
        level &= abs(angle(wrist - shoulder, up) - 90) <= _UPRIGHT_DEG
        arms.append(wrist - shoulder)
    if wrong:
        return None
    axes_33 = _axes(hips / np.linalg.norm(hips) + shoulders / np.linalg.norm(shoulders), up)
    left, right = (axes_33.T @ arm for arm in arms)
    if angle(left * [-1, 1, 1], right) > _ALIKE_DEG or left[0] < right[0]:
        return None
    if strict and not level and _unlike(point, axes_33) > _MIRRORED_DEG:
        return None
    return Reference(point, turn, axes_33, what)


def _unlike(point: Mapping[str, np.ndarray], axes_33: np.ndarray) -> float:
    """The largest angle [deg] between a bone of a limb and the mirror image of the other side's."""
    found = []
    for start, end in (*itertools.pairwise(_ARM), *itertools.pairwise(_LEG)):
        left, right = (axes_33.T @ (point[f"{side}_{end}"] - point[f"{side}_{start}"]) for side in SIDES)
        found.append(angle(left * [-1, 1, 1], right))
    return max(found)


def _axes(left: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Columns (3, 3) left, up, forward; along the file's own axes where they nearly are."""
    up = _snapped(up / np.linalg.norm(up))
    left = left - up * (up @ left)
    left = _snapped(left / np.linalg.norm(left))
    left = left - up * (up @ left)
    left /= np.linalg.norm(left)
    return np.stack((left, up, np.cross(left, up)), axis=-1)


def _snapped(unit: np.ndarray) -> np.ndarray:
    axis = np.zeros(3)
    largest = int(np.argmax(np.abs(unit)))
    axis[largest] = np.sign(unit[largest])
    return axis if angle(axis, unit) < _SNAP_DEG else unit


def angle(one: np.ndarray, other: np.ndarray) -> float:
    """Degrees between two vectors (3,)."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other)), one @ other)))
