"""Which bone carries which in a table of Motive's, by their names and by how they move.

A bone turns about where it begins, and that keeps its place on the bone that carries it. Names keep out what cannot be:
the beginnings of shoulders are as near to the neck as to the chest, and hands may stay beside thighs.

Legend: F frames, B bones.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from mrhubo.fast.plain.human import norm

_NEAR = 0.02
"""Of a distance, as if a bone's beginning moved by that: of bones on which it keeps its place, the nearest carries."""
_MIDDLE = 2.0
"""How much farther a bone of the middle counts from one of a side."""
_KINDS = (
    ("finger", r"thumb|index|middle|ring|pinky|little|finger"),
    ("hand", r"hand|wrist"),
    ("lower arm", r"farm|forearm|lowerarm|elbow"),
    ("upper arm", r"uarm|upperarm|arm"),
    ("collar", r"collar|clavicle|shoulder"),
    ("toe", r"toe|ball"),
    ("foot", r"foot|ankle"),
    ("thigh", r"thigh|upleg|upperleg|hip"),
    ("shin", r"shin|calf|lowerleg|leg|knee"),
    ("head", r"head"),
    ("neck", r"neck"),
)
"""What bones are called in the ways of naming that Motive offers; the first that is in a name counts."""
_COLLAR, _SHOULDER = r"collar|clavicle", r"shoulder"
"""Beside a bone that is called as the first, one that is called as the second is an upper arm."""
_CARRIED_BY = {
    "toe": "foot", "foot": "shin", "shin": "thigh", "hand": "lower arm", "lower arm": "upper arm",
    "upper arm": "collar", "head": "neck",
}  # fmt: skip
"""Which kind carries which."""
_ON_SPINE = ("collar", "thigh", "neck")
"""Kinds that bones of the spine carry, which have another name, and a neck another neck."""


def carriers(
    place_FB3: np.ndarray, turn_FB33: np.ndarray, farther_BB: np.ndarray, top: int
) -> tuple[list[int], list[int], float]:
    """An order of bones, the place of each one's parent in it (-1 of the first), and how far beginnings move on
    parents.

    From the topmost bone on, the bone comes next that keeps its place best on one that is there, or is nearest to it.
    """
    count = len(place_FB3[0])
    cost_BB = np.empty((count, count))
    """Of a bone (second) on another (first)."""
    for bone in range(count):
        seen_FB3 = np.einsum("fji,fbj->fbi", turn_FB33[:, bone], place_FB3 - place_FB3[:, bone, None])
        far_B = np.where(np.isinf(farther_BB[bone]), np.inf, norm(seen_FB3.mean(axis=0)))  # and no product of 0 and it
        cost_BB[bone] = seen_FB3.std(axis=0).max(axis=-1) + _NEAR * np.where(far_B > 0, far_B * farther_BB[bone], 0.0)
    order, parents, total = [top], [-1], 0.0
    left = [bone for bone in range(count) if bone != top]
    while left:
        among = cost_BB[np.ix_(order, left)]
        parent, bone = np.unravel_index(int(among.argmin()), among.shape)
        total += float(among[parent, bone])
        parents.append(int(parent))
        order.append(left.pop(int(bone)))
    return order, parents, total


def farther(names: Sequence[str], top: int) -> np.ndarray:
    """How much farther than they are bones count from others that may carry them (B, B: a bone, what it carries), by
    their names in small letters: infinitely far from what cannot carry them.

    A bone of one side carries none of the other and none of the middle, and is carried rather by its own side.
    """
    side_B = sides(names)
    far_BB = np.where(side_B[:, None] == side_B, 1.0, np.where(side_B[:, None] == 0, _MIDDLE, np.inf))
    kinds = [_kind(name) if bone != top else "" for bone, name in enumerate(names)]
    if any(re.search(_COLLAR, name) for name in names):
        kinds = ["upper arm" if re.search(_SHOULDER, name) else kind for name, kind in zip(names, kinds, strict=True)]
    for bone in range(len(names)):
        may = _may_carry(bone, names, kinds, side_B)
        far_BB[[one for one in range(len(names)) if one not in may], bone] = np.inf
    return far_BB


def sides(names: Sequence[str]) -> np.ndarray:
    """The sides of bones (B,): 1 left, -1 right, 0 the middle, of names with a partner on the other side."""
    side_B = np.zeros(len(names), int)
    for bone, name in enumerate(names):
        for left, right in (("left", "right"), ("l", "r")):
            for side, own, other in ((1, left, right), (-1, right, left)):
                begins, ends = name.removeprefix(own), name.removesuffix(f"_{own}")
                if (begins != name and other + begins in names) or (ends != name and f"{ends}_{other}" in names):
                    side_B[bone] = side
    return side_B


def _kind(name: str) -> str:
    """What a bone is; empty where its name does not say, as of the spine."""
    return next((kind for kind, words in _KINDS if re.search(words, name)), "")


def _may_carry(bone: int, names: Sequence[str], kinds: Sequence[str], side_B: np.ndarray) -> set[int]:
    """The bones that may carry another, by names; all where they do not tell."""
    every = set(range(len(names))) - {bone}
    own = {other for other in every if side_B[other] == side_B[bone]}
    kind = kinds[bone]
    if kind == "finger":
        finger = re.sub(r"\d", "", names[bone])
        found = {other for other in own if re.sub(r"\d", "", names[other]) == finger and names[other] < names[bone]}
        found = {max(found, key=lambda other: names[other])} if found else {o for o in own if kinds[o] == "hand"}
    elif kind in _ON_SPINE:
        found = {other for other in every if not kinds[other] or (kind == "neck" == kinds[other])}
    else:
        found = {other for other in own if kinds[other] == _CARRIED_BY.get(kind)}
    return found or every
