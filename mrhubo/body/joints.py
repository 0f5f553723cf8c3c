"""The human body's tree of 22 joints and the points fixed to them: names, lengths, mirroring; needs no PyTorch.

Frame: x to the body's left, y up, z forward, metres. Rest pose: T-pose, arms along +-x, legs along -y, palms down. A
pose is the local rotation of joints 1..21 (the pelvis is the root and stays at the origin), in SMPL's order.

Legend: B batch, J = 21 posed joints, K keypoints (22 joints and the points fixed to them).
Source of the lengths: mean skeleton of the CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu); of the hand,
eye and foot points: round numbers of an adult.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from mrhubo.errors import UserError, unknown_name

if TYPE_CHECKING:
    from torch import Tensor

Array = TypeVar("Array", np.ndarray, "Tensor")

_SIGNS = {"left": 1.0, "right": -1.0}
SIDES: tuple[str, ...] = tuple(_SIGNS)
"""Sides of the body; what there is on both is called `left_` and `right_` and its name."""
PAIRED_JOINTS = ("hip", "knee", "ankle", "foot", "collar", "shoulder", "elbow", "wrist")
"""Joints that there are on both sides."""
SIDE_OF: dict[str, str] = {f"{side}_{name}": side for side in SIDES for name in PAIRED_JOINTS}
"""The side of each joint that there is on both."""
LEG_JOINTS: tuple[str, ...] = tuple(f"{side}_{name}" for name in ("hip", "knee", "ankle", "foot") for side in SIDES)

# name: (parent, offset from the parent at rest [m])
_JOINTS: dict[str, tuple[str | None, tuple[float, float, float]]] = {
    "pelvis": (None, (0.0, 0.0, 0.0)),
    "left_hip": ("pelvis", (0.0901, -0.1018, 0.0392)),
    "right_hip": ("pelvis", (-0.0901, -0.1018, 0.0392)),
    "spine1": ("pelvis", (0.0, 0.0585, -0.0040)),
    "left_knee": ("left_hip", (0.0, -0.4103, 0.0)),
    "right_knee": ("right_hip", (0.0, -0.4103, 0.0)),
    "spine2": ("spine1", (0.0, 0.0585, -0.0040)),
    "left_ankle": ("left_knee", (0.0, -0.4357, 0.0)),
    "right_ankle": ("right_knee", (0.0, -0.4357, 0.0)),
    "spine3": ("spine2", (0.0, 0.1171, -0.0018)),
    "left_foot": ("left_ankle", (0.0, -0.04, 0.119)),
    "right_foot": ("right_ankle", (0.0, -0.04, 0.119)),
    "neck": ("spine3", (0.0, 0.1175, 0.0030)),
    "left_collar": ("spine3", (0.0278, 0.0875, 0.0030)),
    "right_collar": ("spine3", (-0.0278, 0.0875, 0.0030)),
    "head": ("neck", (0.0, 0.1479, 0.0004)),
    "left_shoulder": ("left_collar", (0.1577, 0.0959, -0.0162)),
    "right_shoulder": ("right_collar", (-0.1577, 0.0959, -0.0162)),
    "left_elbow": ("left_shoulder", (0.3017, 0.0, 0.0)),
    "right_elbow": ("right_shoulder", (-0.3017, 0.0, 0.0)),
    "left_wrist": ("left_elbow", (0.26, 0.0, 0.0)),
    "right_wrist": ("right_elbow", (-0.26, 0.0, 0.0)),
}
# name: (parent, whether it is on the point's own side, offset from it at rest [m], x mirrored on the right)
_FIXED_POINTS: dict[str, tuple[str, bool, tuple[float, float, float]]] = {
    "eye": ("head", False, (0.032, 0.065, 0.090)),
    "thumb": ("wrist", True, (0.045, -0.015, 0.045)),
    "index": ("wrist", True, (0.092, -0.003, 0.024)),
    "middle": ("wrist", True, (0.095, 0.0, 0.0)),
    "pinky": ("wrist", True, (0.080, -0.006, -0.042)),
    "toe": ("foot", True, (0.0, -0.015, 0.070)),
    "heel": ("ankle", True, (0.0, -0.060, -0.050)),
}

JOINT_NAMES: tuple[str, ...] = tuple(_JOINTS)
"""SMPL's 22 body joints in SMPL's order."""
POSED_JOINT_NAMES: tuple[str, ...] = JOINT_NAMES[1:]
"""The 21 joints whose local rotations make a pose H."""
PARENTS: tuple[int, ...] = tuple(-1 if p is None else JOINT_NAMES.index(p) for p, _ in _JOINTS.values())
"""Index of each joint's parent in JOINT_NAMES; -1 for the pelvis."""


def _fixed_points() -> dict[str, tuple[int, tuple[float, float, float]]]:
    points = {}
    for name, (parent, own_side, (x, y, z)) in _FIXED_POINTS.items():
        for side, sign in _SIGNS.items():
            carrier = f"{side}_{parent}" if own_side else parent
            points[f"{side}_{name}"] = (JOINT_NAMES.index(carrier), (sign * x, y, z))
    return points


_POINTS = _fixed_points()
POINT_NAMES: tuple[str, ...] = tuple(_POINTS)
"""The points fixed to head, wrists, ankles and feet."""
KEYPOINT_NAMES: tuple[str, ...] = JOINT_NAMES + POINT_NAMES
"""The 22 joints, then the points fixed to head, wrists, ankles and feet."""
PAIRED_KEYPOINTS: dict[str, tuple[str, ...]] = {
    name: tuple(f"{side}_{name}" for side in SIDES) for name in (*PAIRED_JOINTS, *_FIXED_POINTS)
}
"""The left and the right keypoint of each that there are two of, by the name that they share."""
KEYPOINT_JOINT: tuple[int, ...] = tuple(range(22)) + tuple(joint for joint, _ in _POINTS.values())
"""Index in JOINT_NAMES of the joint that carries each keypoint (a joint's own keypoint is carried by itself)."""


def joint_index(name: str) -> int:
    """Position of a joint in JOINT_NAMES; UserError with the nearest name if there is none such."""
    if name not in JOINT_NAMES:
        raise UserError(unknown_name("human joint", name, JOINT_NAMES))
    return JOINT_NAMES.index(name)


def ancestors(joint: int) -> list[int]:
    """The joint itself and all joints above it, nearest first, the pelvis last (indices in JOINT_NAMES)."""
    chain = []
    while joint >= 0:
        chain.append(joint)
        joint = PARENTS[joint]
    return chain


def _levels() -> list[list[int]]:
    depth = [len(ancestors(j)) - 1 for j in range(len(JOINT_NAMES))]
    levels = [[j for j in range(len(JOINT_NAMES)) if depth[j] == d] for d in range(1, max(depth) + 1)]
    assert [j for level in levels for j in level] == list(range(1, len(JOINT_NAMES))), "SMPL's order is by depth"
    return levels


LEVELS: list[list[int]] = _levels()
"""Joints but the root by how far below it they are."""
OTHER_SIDE = {
    f"{side}_{name}": f"{other}_{name}"
    for side, other in zip(SIDES, SIDES[::-1], strict=True)
    for name in PAIRED_JOINTS
}
"""The joint on the other side of each that there is on both."""
MIRROR = [POSED_JOINT_NAMES.index(OTHER_SIDE.get(name, name)) for name in POSED_JOINT_NAMES]
"""The posed joint on the other side of each."""


def _offsets() -> np.ndarray:
    return np.array([offset for _, offset in _JOINTS.values()], np.float32)[1:]


def _rest() -> np.ndarray:
    place_K3 = np.zeros((len(KEYPOINT_NAMES), 3), np.float32)
    for joint, offset_3 in enumerate(OFFSETS_J3, start=1):
        place_K3[joint] = place_K3[PARENTS[joint]] + offset_3
    for point, (joint, offset_3) in enumerate(_POINTS.values(), start=len(JOINT_NAMES)):
        place_K3[point] = place_K3[joint] + np.array(offset_3, np.float32)
    return place_K3


OFFSETS_J3: np.ndarray = _offsets()
"""The open skeleton's offsets (21, 3) [m] of joints 1..21 from their parents at rest, float32."""
POINT_OFFSETS_E3: np.ndarray = np.array([offset for _, offset in _POINTS.values()], np.float32)
"""The same [m] of POINT_NAMES from the joints that carry them."""
REST_K3: np.ndarray = _rest()
"""Its keypoints (K, 3) [m] at rest; the pelvis is the origin."""
ELBOW_AXIS = (0.0, -1.0, 0.0)
"""Hinge of the left elbow, SMPL's: turning about it by a positive angle flexes."""
KNEE_AXIS = (1.0, 0.0, 0.0)
"""Hinge of the knees: turning about it by a positive angle flexes."""
_HINGES = {f"{side}_{name}": axis for side in SIDES for name, axis in (("elbow", ELBOW_AXIS), ("knee", KNEE_AXIS))}


def hinge_axis(name: str) -> tuple[float, float, float]:
    """Axis about which a positive angle flexes the elbow or knee of this name."""
    x, y, z = _HINGES[name]
    return (x, -y, -z) if SIDE_OF[name] == "right" else (x, y, z)


def local_rotations(world_BJ33: Array) -> Array:
    """Rotations (..., 22, 3, 3) of all joints in one frame, whichever, to those of joints 1..21 relative to their
    parents (..., 21, 3, 3); undoes `Skeleton.global_rotations`.
    """
    return world_BJ33[..., PARENTS[1:], :, :].mT @ world_BJ33[..., 1:, :, :]


def keypoint_indices(names: Sequence[str]) -> list[int]:
    """Positions of keypoints in KEYPOINT_NAMES; UserError with the nearest name for one that does not exist."""
    for name in names:
        if name not in KEYPOINT_NAMES:
            raise UserError(unknown_name("human keypoint", name, KEYPOINT_NAMES))
    return [KEYPOINT_NAMES.index(name) for name in names]
