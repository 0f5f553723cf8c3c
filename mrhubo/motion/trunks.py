"""How pelvis, chest and neck are turned, by the joints of a trunk as SMPL's bodies have them.

Hips and the lowest joint of the spine are fixed to the pelvis, collars and neck to the chest, so that where they are
tells how both are turned, whatever the spine does. It tells so beside where they are at rest, and bodies differ in
that: from the middle of the hips, the spine of SMPL-X rises 17 degrees farther back than ours. Whose trunk it is, its
lengths tell.

How a head turns on its neck is not told by its joint, which is a single point.

Legend: T frames, K joints, N lengths. Frame at rest: x to the body's left, y up, z forward.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, REST_K3
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import shortest_turn, turned
from mrhubo.motion.orientations import known_frames

_CARRIED = {
    "pelvis": ("left_hip", "right_hip", "spine1"),
    "spine3": ("left_collar", "right_collar", "neck"),
}
"""What is fixed to a part, by its joint."""
_NAMES = ("spine2", "head", *_CARRIED, *(joint for joints in _CARRIED.values() for joint in joints))
_LENGTHS = (
    *((part, joint) for part, joints in _CARRIED.items() for joint in joints),
    *((one, other) for a, b, c in _CARRIED.values() for one, other in ((a, b), (a, c), (b, c))),
    ("spine1", "spine2"), ("spine2", "spine3"), ("neck", "head"),
)  # fmt: skip
"""Ways between joints that no pose changes."""
# Joints of the mean bodies at rest from their parents [m], to the millimetre, from the sources of
# `mrhubo.body.rest_directions`; spine1 and hips from the pelvis, neck and collars from spine3.
_OFFSETS = {
    "SMPL": {
        "left_hip": (0.070, -0.091, -0.007), "right_hip": (-0.068, -0.091, -0.004), "spine1": (-0.003, 0.109, -0.027),
        "spine2": (0.006, 0.135, 0.001), "spine3": (0.002, 0.053, 0.025), "neck": (-0.003, 0.214, -0.043),
        "left_collar": (0.079, 0.122, -0.034), "right_collar": (-0.082, 0.119, -0.039), "head": (0.005, 0.065, 0.051),
    },
    "SMPL-X": {
        "left_hip": (0.058, -0.093, -0.026), "right_hip": (-0.063, -0.104, -0.021), "spine1": (-0.003, 0.110, -0.028),
        "spine2": (0.009, 0.132, -0.006), "spine3": (-0.011, 0.052, 0.028), "neck": (-0.012, 0.165, -0.032),
        "left_collar": (0.046, 0.085, -0.007), "right_collar": (-0.048, 0.084, -0.008), "head": (0.025, 0.161, 0.021),
    },
}  # fmt: skip
_FARTHEST = 0.3
"""Standard deviation of the logarithms of lengths over those of a trunk's, from which on it is another's. SMPL's and
SMPL-X's are 0.28 apart, ours is 0.45 from SMPL-X's."""
_NEARLY_ALL = 0.9
"""In so many of the frames all joints must be known."""


def trunk_turns(points: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], str]:
    """Rotations (T, 3, 3) in the world of `pelvis`, `spine3` (the chest) and `neck`, relative to the rest pose of the
    trunk, NaN in frames where joints are missing, and whose trunk that is; nothing, and an empty text, where there are
    not all joints of a trunk that is known.

    The neck's is the shortest turn from the chest's that brings the head where it is.

    Args:
        points: points (T, 3), of any unit, by name.
    """
    if not points.keys() >= set(_NAMES):
        return {}, ""
    place = {name: points[name].astype(np.float64) for name in _NAMES}
    known_T = known_frames(np.stack([*place.values()], axis=1))
    if known_T.mean() < _NEARLY_ALL or not known_T.any():
        return {}, ""
    whose = _whose({name: point_T3[known_T] for name, point_T3 in place.items()})
    if not whose:
        return {}, ""
    rest = _TRUNKS[whose]
    found = {part: np.full((len(known_T), 3, 3), np.nan) for part in (*_CARRIED, "neck")}
    for part, joints in _CARRIED.items():
        seen_TK3 = np.stack([place[joint][known_T] for joint in (part, *joints)], axis=1)
        found[part][known_T] = _best_turn(np.stack([rest[joint] for joint in (part, *joints)]), seen_TK3)
    chest_T33 = found["spine3"]
    seen_T3 = turned(chest_T33.mT, normalize(place["head"] - place["neck"]))[known_T]
    at_rest_T3 = np.broadcast_to(normalize(rest["head"] - rest["neck"]), seen_T3.shape)
    found["neck"][known_T] = chest_T33[known_T] @ shortest_turn(at_rest_T3, seen_T3)
    return found, whose


def _trunks() -> dict[str, dict[str, np.ndarray]]:
    """Joints (3,) at rest [m] of each trunk that is known, from the pelvis."""
    parents = {joint: part for part, joints in _CARRIED.items() for joint in joints}
    parents |= {"spine2": "spine1", "spine3": "spine2", "head": "neck"}
    order = sorted(parents, key=JOINT_NAMES.index)
    trunks = {"mrhubo": dict(zip(JOINT_NAMES, REST_K3.astype(np.float64), strict=False))}
    for name, offsets in _OFFSETS.items():
        trunk = {"pelvis": np.zeros(3)}
        for joint in order:
            trunk[joint] = trunk[parents[joint]] + offsets[joint]
        trunks[name] = trunk
    return trunks


_TRUNKS = _trunks()


@np.errstate(divide="ignore", invalid="ignore")
def _whose(place: Mapping[str, np.ndarray]) -> str:
    """The trunk whose lengths are most like those of some joints (T, 3); empty where none's are."""
    seen_N = np.log([np.median(norm(place[one] - place[other])) for one, other in _LENGTHS])
    away = {
        name: float(np.std(seen_N - np.log([norm(trunk[one] - trunk[other]) for one, other in _LENGTHS])))
        for name, trunk in _TRUNKS.items()
    }
    nearest = min(away, key=away.__getitem__)
    return nearest if away[nearest] < _FARTHEST else ""


def _best_turn(rest_K3: np.ndarray, seen_TK3: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) that bring points at rest nearest to those that are seen, from the middle of both, by least
    squares (W. Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32, 1976).
    """
    rest_K3, seen_TK3 = (point_XK3 - point_XK3.mean(-2, keepdims=True) for point_XK3 in (rest_K3, seen_TK3))
    u_T33, _, v_T33 = np.linalg.svd(seen_TK3.mT @ rest_K3)
    u_T33[:, :, 2] *= np.linalg.det(u_T33 @ v_T33)[:, None]
    return u_T33 @ v_T33
