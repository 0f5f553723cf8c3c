"""Where the limbs of a body model point at rest, and rotations that refer to one rest pose told in another's.

A rotation of a file turns a limb from where the file's own body has it at rest. Ours is a T-pose along the axes; in
SMPL-X's the left upper arm droops by 16 and the right by 8 degrees. Taken for ours, such rotations put every limb by so
much beside where the person had it. With G a joint's rotation relative to the pelvis, b a limb's direction at rest, and
T the shortest turn from our direction to theirs,

    G_ours = G_theirs T,    so that    G_ours b_ours = G_theirs b_theirs.

Joints that turn no limb of the table (spine, collars, wrists, ankles) keep their rotation relative to the pelvis.

Legend: B batch, J = 21: SMPL's joints 1..21. Frame: x to the body's left, y up, z forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.body.joints import OFFSETS_J3, PARENTS, POSED_JOINT_NAMES
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import shortest_turn

if TYPE_CHECKING:
    from mrhubo.body.skeleton import Skeleton

_SAME = 5e-3
"""Sine of an angle (0.3 degrees) between two directions up to which they are the same: those of the table are rounded
to 0.01."""

_END = {
    f"{side}_{joint}": f"{side}_{end}"
    for side in ("left", "right")
    for joint, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
}
"""The joint at the end of each limb, by the joint that turns it."""


@dataclass(frozen=True)
class Family:
    """A family of body models: limb directions of its mean body at rest, by the joint that turns the limb."""

    name: str
    """For a sentence."""
    directions: dict[str, tuple[float, float, float]]
    pelvis: tuple[float, float, float]
    """Where the pelvis is from the model's origin [m], along the axes of the file, however the root is turned."""


_SMPL = {
    "left_shoulder": (0.99, -0.05, -0.11),
    "right_shoulder": (-0.99, -0.05, -0.08),
    "left_elbow": (1.00, 0.04, 0.00),
    "right_elbow": (-1.00, 0.03, -0.02),
    "left_hip": (0.09, -1.00, -0.01),
    "right_hip": (-0.10, -0.99, -0.02),
    "left_knee": (-0.03, -0.99, -0.11),
    "right_knee": (0.04, -0.99, -0.11),
}
_SMPLX = {
    "left_shoulder": (0.95, -0.27, -0.16),
    "right_shoulder": (-0.99, -0.13, -0.10),
    "left_elbow": (1.00, 0.09, -0.01),
    "right_elbow": (-1.00, -0.02, -0.06),
    "left_hip": (0.14, -0.99, -0.02),
    "right_hip": (-0.12, -0.99, -0.05),
    "left_knee": (-0.11, -0.99, -0.08),
    "right_knee": (0.04, -1.00, -0.05),
}
# Read off, to two digits, from the joints of humanoids that others made of the mean bodies and publish: SMPL's from
# github.com/ZhengyiLuo/PHC, phc/data/assets/mjcf/smpl_humanoid.xml; SMPL-X's from
# github.com/SMPLOlympics/SMPLOlympics, phc/data/assets/mjcf/smplx_humanoid.xml. SMPL-H has SMPL's body.
FAMILIES: dict[str, Family] = {
    "smpl": Family("SMPL", _SMPL, (0.0, -0.22, 0.03)),
    "smplh": Family("SMPL-H", _SMPL, (0.0, -0.22, 0.03)),
    "smplx": Family("SMPL-X", _SMPLX, (0.0, -0.35, 0.01)),
}
"""By the names that AMASS's `surface_model_type` has for them."""


def from_family(local_BJ33: np.ndarray, family: str) -> np.ndarray:
    """Local rotations (B, 21, 3, 3) that refer to our skeleton, of those that refer to a family's mean body."""
    turn_J33 = _turns(FAMILIES[family]).astype(local_BJ33.dtype)
    return _above(turn_J33).mT @ local_BJ33 @ turn_J33


def to_family(local_BJ33: np.ndarray, family: str) -> np.ndarray:
    """Local rotations (B, 21, 3, 3) that refer to a family's mean body, of those that refer to our skeleton."""
    turn_J33 = _turns(FAMILIES[family]).astype(local_BJ33.dtype)
    return _above(turn_J33) @ local_BJ33 @ turn_J33.mT


def is_ours(skeleton: Skeleton) -> bool:
    """Whether a skeleton's limbs point at rest where ours do, however long they are."""
    rows = [POSED_JOINT_NAMES.index(end) for end in _END.values()]
    theirs, ours = (
        normalize(offsets_J3[rows].astype(np.float64)) for offsets_J3 in (skeleton.offsets_J3.cpu().numpy(), OFFSETS_J3)
    )
    return bool((norm(theirs - ours) < _SAME).all())


def _turns(family: Family) -> np.ndarray:
    """The shortest turns (21, 3, 3), float64, from our rest directions to a family's; the identity where no limb is."""
    ours = dict(zip(POSED_JOINT_NAMES, OFFSETS_J3.astype(np.float64), strict=True))
    turns = np.tile(np.eye(3), (len(POSED_JOINT_NAMES), 1, 1))
    for joint, direction in family.directions.items():
        turns[POSED_JOINT_NAMES.index(joint)] = shortest_turn(*normalize(np.stack((ours[_END[joint]], direction))))
    return turns


def _above(turn_J33: np.ndarray) -> np.ndarray:
    """The turns (21, 3, 3) of the joints' parents; the pelvis's is the identity."""
    return np.concatenate((np.eye(3, dtype=turn_J33.dtype)[None], turn_J33))[list(PARENTS[1:])]
