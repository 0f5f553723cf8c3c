"""Whether both sides of a robot were told the same: they are mirror images, so what differs is wrong on one of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mrhubo.robot.discovery.arm import GUESS, Arm, doubted, read_arm
from mrhubo.robot.discovery.bodies import Bodies, Chain
from mrhubo.robot.discovery.hand import Hand

_LENGTH = 0.05
"""How far upper arms, or forearms, of both sides may differ, as a share of the longer one."""
_TURNED = math.cos(math.radians(30))
"""How far a thumb may point from the mirror image of the other one (cosine)."""
_FINGERS = math.cos(math.radians(5))
"""The same of fingers, beyond which the zero pose is no mirror image and tells nothing of thumbs (cosine)."""

_OTHER = "; the other side tells another length"


def read_arms(bodies: Bodies, chains: Sequence[Chain]) -> list[Arm]:
    """Both arms, without those that have no elbow. Where their forearms differ, the origins of the forearms' twists
    told one of them at least, and shapes and masses tell both, if these agree.
    """
    arms, others = (
        [arm for chain in chains if (arm := read_arm(bodies, chain, by_origin)) is not None]
        for by_origin in (True, False)
    )
    if len(arms) == len(others) == 2 and _differ(_forearms(arms)) and not _differ(_forearms(others)):
        return others
    return arms


def agreeing_arms(arms: Mapping[str, Arm]) -> dict[str, Arm]:
    """The arms, with points less sure that make one side's upper arm or forearm longer than the other's."""
    upper = [math.dist(arm.shoulder.point_3, arm.elbow.point_3) for arm in arms.values()]
    lower = _forearms(arms.values())
    found = dict(arms)
    if _differ(upper):
        found = {side: replace(arm, elbow=doubted(arm.elbow, _OTHER)) for side, arm in found.items()}
    if _differ(lower):
        found = {side: replace(arm, wrist=doubted(arm.wrist, _OTHER)) for side, arm in found.items()}
    return found


def _forearms(arms: Iterable[Arm]) -> list[float]:
    return [math.dist(arm.elbow.point_3, arm.wrist.point_3) for arm in arms]


def _differ(lengths: list[float]) -> bool:
    return max(lengths) - min(lengths) > _LENGTH * max(lengths)


def agreeing_hands(hands: Mapping[str, Hand], left_3: np.ndarray) -> dict[str, Hand]:
    """The hands, asked about where thumbs are no mirror images of each other though the fingers are.

    Args:
        hands: by side.
        left_3: across the mirror plane, unit.
    """
    if len(hands) < 2:
        return dict(hands)
    one, other = hands.values()

    def image(vector_3: np.ndarray) -> np.ndarray:
        return vector_3 - 2 * left_3 * (left_3 @ vector_3)

    if float(image(one.fingers_3) @ other.fingers_3) < _FINGERS or float(image(one.thumb_3) @ other.thumb_3) > _TURNED:
        return dict(hands)
    doubt = "the thumbs were told on different sides of the two hands"
    return {
        side: replace(hand, confidence=min(hand.confidence, GUESS), doubt=hand.doubt or doubt)
        for side, hand in hands.items()
    }
