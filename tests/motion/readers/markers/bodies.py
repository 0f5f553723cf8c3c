"""Bodies that move as the motions that ship do."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

import mrhubo
from mrhubo.body.joints import OFFSETS_J3, PARENTS, SIDES

_MOTIONS = Path(__file__).resolve().parents[4] / "data/motions"
_FRAMES = 60
Z_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""From a world with y up, z forward, to one with z up, x forward."""
BONES = {
    "Hips": "pelvis", "Spine": "spine1", "Spine1": "spine2", "Spine2": "spine3", "Neck": "neck", "Head": "head",
} | {
    f"{side.capitalize()}{theirs}": f"{side}_{ours}"
    for side in SIDES
    for theirs, ours in (
        ("Shoulder", "collar"), ("Arm", "shoulder"), ("ForeArm", "elbow"), ("Hand", "wrist"), ("UpLeg", "hip"),
        ("Leg", "knee"), ("Foot", "ankle"),
    )
}  # fmt: skip
"""Joints by the bones that begin there, as animations call them."""


@functools.cache
def moving_body(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Places (T, 22, 3) [m] and turns (T, 22, 3, 3) of joints in a world with y up, some frames of a motion."""
    motion = mrhubo.read_motion(_MOTIONS / f"{name}.npz")
    frames = np.linspace(0, len(motion) - 1, _FRAMES).astype(int)
    local_TJ33, root_T33 = motion.arrays.local_TJ33, motion.arrays.root_rotation_T33
    world_TJ33 = np.zeros((_FRAMES, 22, 3, 3))
    world_TJ33[:, 0] = np.eye(3) if root_T33 is None else root_T33[frames]
    place_TJ3 = np.zeros((_FRAMES, 22, 3)) + [0.2, 0.95, 0.5]
    place_TJ3[:, :, 2] += np.linspace(0, 0.5, _FRAMES)[:, None]
    for joint, offset_3 in enumerate(OFFSETS_J3.astype(float), start=1):
        place_TJ3[:, joint] = place_TJ3[:, PARENTS[joint]] + world_TJ33[:, PARENTS[joint]] @ offset_3
        world_TJ33[:, joint] = world_TJ33[:, PARENTS[joint]] @ local_TJ33[frames, joint - 1]
    return place_TJ3, world_TJ33
