"""What joints' names say: which side they are of, and whether they belong to an arm, a leg, a head.

Makers of files name joints in many ways (`mixamorig:LeftArm`, `Bip01 L UpperArm`, `lShldr`, `upper_arm.L`, `lhumerus`,
`l_shoulder_JNT`), and one name means different bones with different makers. So names are asked where the shape of the
tree leaves a choice.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+|[^\W\d_a-zA-Z]+")
_LEG = ("leg", "thigh", "shin", "knee", "ankle", "foot", "toe", "calf", "femur", "tibia", "buttock", "feet")
_ARM = (
    "arm", "hand", "wrist", "elbow", "shoulder", "shldr", "collar", "clavicle", "finger", "thumb", "humerus",
    "radius", "palm",
)  # fmt: skip
_THUMB, _HEAD, _HAND = ("thumb",), ("head", "skull"), ("hand", "wrist", "palm")
_END = ("end", "top", "nub", "tip", "effector", "site")


def is_thumb(name: str) -> bool:
    """Whether a name says thumb."""
    return _has(name, _THUMB)


def is_hand(name: str) -> bool:
    """Whether a name says hand or wrist, and no finger."""
    return _has(name, _HAND) and not is_finger(name) and not re.search(r"\d", name)


def is_finger(name: str) -> bool:
    """Whether a name says finger, or one of them."""
    return re.search(r"thumb|index|mid|ring|pinky|little|finger", name, re.IGNORECASE) is not None


def is_head(name: str) -> bool:
    """Whether a name says head, and not the end of it."""
    return _has(name, _HEAD) and not _has(name, _END)


def is_neck(name: str) -> bool:
    """Whether a name says neck."""
    return _has(name, ("neck",))


def is_spine(name: str) -> bool:
    """Whether a name says spine."""
    return _has(name, ("spine",))


def limb_votes(names: Iterable[str]) -> float:
    """Whether joints are called after a leg, 1, or an arm, -1: the mean over those that are called after either."""
    votes = [leg - arm for name in names if (leg := _has(name, _LEG)) != (arm := _has(name, _ARM))]
    return sum(votes) / len(votes) if votes else 0.0


def left_votes(names: Sequence[str], others: Sequence[str]) -> float:
    """Whether the joints of one limb are called left and those of its partner right, 1, or the other way, -1.

    Only where the two names differ is looked at: it must begin with l and r, or say left and right in another tongue.
    """
    votes = []
    for name, other in zip(names, others, strict=False):
        one, two = _difference(name, other)
        for left, right in (("l", "r"), ("左", "右"), ("gauche", "droit"), ("izq", "der"), ("sinistr", "destr")):
            if one.startswith(left) and two.startswith(right):
                votes.append(1.0)
            elif one.startswith(right) and two.startswith(left):
                votes.append(-1.0)
    return sum(votes) / len(votes) if votes else 0.0


def _difference(name: str, other: str) -> tuple[str, str]:
    """Where two names differ, in small letters."""
    one, two = name.lower(), other.lower()
    start = 0
    while start < min(len(one), len(two)) and one[start] == two[start]:
        start += 1
    end = 0
    while end < min(len(one), len(two)) - start and one[-1 - end] == two[-1 - end]:
        end += 1
    return one[start : len(one) - end], two[start : len(two) - end]


def _has(name: str, words: Sequence[str]) -> bool:
    """Whether one of the words is in one of the words of a name, in small letters."""
    bare = name.rpartition(":")[2]
    found = [word.lower() for word in _WORD.findall(bare)]
    return any(word in part for part in found for word in words)
