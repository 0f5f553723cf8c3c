"""Standing: the pelvis moves, the feet stay where they are, hips, knees and ankles follow by inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from mrhubo.body.skeleton import JOINT_NAMES, Skeleton

_STEP_OUT = 0.03
"""How much farther out than the hips the ankles stand [m]."""
_TOE_OUT = np.radians(8.0)
_ANKLE_HEIGHT = 0.075
"""Ankle above the floor [m]."""
_KNEE_BEND = 0.003
"""How much shorter than its bones a leg is at least, so that no knee snaps straight [m]."""
_KNEE_EASE = 0.002
"""How softly the pelvis sinks before a leg would be longer than that [m]."""


@dataclass(frozen=True)
class Stance:
    """How the pelvis is moved away from standing upright [cm]."""

    sink: float = 0.0
    """Down, by bending the knees."""
    left: float = 0.0
    """To the left: the weight on the left leg."""
    forward: float = 0.0

    def numbers(self) -> np.ndarray:
        """(3,) in metres."""
        return 0.01 * np.array([self.sink, self.left, self.forward])


def stand(stance_T3: np.ndarray, pelvis: Rotation, lean_T: np.ndarray) -> tuple[np.ndarray, dict[str, Rotation]]:
    """The pelvis's place (T, 3) [m; y = 0 is the floor] and the local rotations of hips, knees and ankles.

    ``stance_T3``: sink, left, forward [m]; ``pelvis``: its T rotations in the world; ``lean_T``: its lean forward
    [rad], which takes the hips backward, to keep the balance.
    """
    offsets = dict(zip(JOINT_NAMES[1:], Skeleton().offsets_J3.double().numpy(), strict=True))
    thigh, shin = (float(np.linalg.norm(offsets[f"left_{name}"])) for name in ("knee", "ankle"))
    hip = offsets["left_hip"]
    longest = thigh + shin - _KNEE_BEND
    upright = _ANKLE_HEIGHT + np.sqrt(longest**2 - _STEP_OUT**2) - hip[1]
    sink_T, left_T, forward_T = stance_T3.T
    back_T = 0.22 * np.sin(lean_T)
    place_T3 = np.stack((left_T, upright - sink_T, forward_T - back_T), axis=-1)

    legs: dict[str, np.ndarray] = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        ankle = np.array([sign * (hip[0] + _STEP_OUT), _ANKLE_HEIGHT, hip[2]])
        legs[side] = ankle - place_T3 - pelvis.apply(offsets[f"{side}_hip"])
    excess_T2 = np.stack([np.linalg.norm(leg_T3, axis=-1) - longest for leg_T3 in legs.values()], axis=-1)
    drop_T = _KNEE_EASE * np.log1p(np.exp(excess_T2 / _KNEE_EASE).sum(-1))
    place_T3[:, 1] -= drop_T

    rotations: dict[str, Rotation] = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        foot = Rotation.from_euler("y", sign * _TOE_OUT)
        leg_T3 = legs[side] + drop_T[:, None] * np.array([0.0, 1.0, 0.0])
        thigh_global, shin_global = _two_links(leg_T3, thigh, shin, foot.apply([1.0, 0.0, 0.0]))
        rotations[f"{side}_hip"] = pelvis.inv() * thigh_global
        rotations[f"{side}_knee"] = thigh_global.inv() * shin_global
        rotations[f"{side}_ankle"] = shin_global.inv() * foot
    return place_T3, rotations


def _two_links(leg_T3: np.ndarray, thigh: float, shin: float, knee_axis_3: np.ndarray) -> tuple[Rotation, Rotation]:
    """World rotations of thigh and shin, along -y at rest, for vectors from hip to ankle; the knee points forward."""
    reach_T = np.minimum(np.linalg.norm(leg_T3, axis=-1), 0.9999 * (thigh + shin))
    down_T3 = leg_T3 / np.linalg.norm(leg_T3, axis=-1, keepdims=True)
    x_T3 = knee_axis_3 - (down_T3 @ knee_axis_3)[:, None] * down_T3
    x_T3 /= np.linalg.norm(x_T3, axis=-1, keepdims=True)
    straight = Rotation.from_matrix(np.stack((x_T3, -down_T3, np.cross(x_T3, -down_T3)), axis=-1))
    at_hip_T = np.arccos((thigh**2 + reach_T**2 - shin**2) / (2 * thigh * reach_T))
    at_knee_T = np.pi - np.arccos((thigh**2 + shin**2 - reach_T**2) / (2 * thigh * shin))
    thigh_global = straight * Rotation.from_euler("x", -at_hip_T[:, None])
    return thigh_global, thigh_global * Rotation.from_euler("x", at_knee_T[:, None])
