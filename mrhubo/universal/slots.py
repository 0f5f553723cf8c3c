"""Where the directions of a branch stand in what the universal network sees.

A branch (an arm, a leg, the head, the waist) turns at most one limb upon another, the axis about which the outer one
bends, and one oriented part: five directions, told apart by their kind alone.
"""

from __future__ import annotations

from mrhubo.body.skeleton import Skeleton, keypoint_indices
from mrhubo.robot.parts import BendPart, BodyPart, LimbPart

SLOTS = ("carrying limb", "bend axis", "bending limb", "first of an oriented part", "second of an oriented part")
"""What the directions of a branch are, in order."""
AXIAL_S = (1.0, -1.0, 1.0, 1.0, 1.0)
"""-1 for what a mirror turns round besides: an axis of rotation."""
MIRROR_3 = (-1.0, 1.0, 1.0)
"""What makes a right limb a left one, in human axes (x left, y up, z forward)."""
SIGN_3 = (0.8139, 0.5057, 0.2861)
"""A joint's sense of turn is canonical if its axis makes an acute angle with this direction in the middle of all
ranges. Oblique, so that no axis that people choose is at right angles to it."""


def slot_of(part: BodyPart, word: int, carried: bool) -> int:
    """Which slot a direction of a part has: `word` is its number among the part's, `carried` whether its limb hangs on
    another of the branch.
    """
    if isinstance(part, BendPart):
        return 1
    if isinstance(part, LimbPart):
        return 2 if carried else 0
    return 3 + word


def on_the_right(skeleton: Skeleton, limb: LimbPart) -> bool:
    """Whether a limb begins on a person's right."""
    return float(skeleton.rest_K3[keypoint_indices([limb.start])[0], 0]) < 0
