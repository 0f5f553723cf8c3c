"""Which point of a body each keypoint is by its name.

Sets of points are named after what they are of (`LShoulder`, `right knee`), skeletons of animations after the bone that
begins there: Mixamo's `LeftArm` begins at the shoulder, and its `LeftShoulder` is a clavicle's beginning. So a name may
mean one thing beside some names and another beside others.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from mrhubo.body.joints import KEYPOINT_NAMES, SIDES

_PARTS = {
    "shoulder": "shoulder sho shldr", "elbow": "elbow elb forearm lowerarm", "wrist": "wrist wri",
    "hip": "hip upleg upperleg thigh", "knee": "knee kne lowerleg shin calf", "ankle": "ankle ank", "heel": "heel",
    "toe": "toe bigtoe footindex toes", "foot": "foot", "index": "index indexfinger handindex",
    "pinky": "pinky pinkyfinger little handpinky", "thumb": "thumb handthumb",
    "middle": "middle middlefinger handmiddle", "ear": "ear", "eye": "eye", "collar": "collar clavicle",
    "arm": "arm upperarm uparm", "hand": "hand", "leg": "leg", "toebase": "toebase ball",
}  # fmt: skip
_BONES = ("arm", "hand", "leg", "toebase")
"""Parts that are names of bones alone."""
_CENTRAL = {
    "pelvis": "pelvis root midhip hips hip spinebase", "spine1": "spinenaval spinenavel navalspine",
    "spine2": "spine torso belly spinemid spinechest chestspine", "neck": "neck", "nose": "nose",
    "head": "head", "head_top": "headtop tophead top headtopend headend",
}  # fmt: skip
_SPINE = ("spine1", "spine2", "spine3")
_HIGH = 0.48
"""How high `spine2` is on the way from the pelvis to the neck."""
_OF_NO_POINT = ("mixamorig", "bip", "def", "position", "pos", "loc", "location", "world", "joint", "jnt", "marker")
"""Words that say of which program a name is, or that it is a place."""
NEEDED = [f"{side}_{joint}" for side in SIDES for joint in ("shoulder", "hip")]
"""Points without which nothing can be made of the others."""
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_LEFT, _RIGHT = ("left", "l", "lft"), ("right", "r", "rgt")


def our_name(name: str) -> str | None:
    """Our name of a point that somebody calls `LShoulder`, `left shoulder`, `RIGHT_FOOT_INDEX`; None where there is
    none, or where it is that of a bone.
    """
    told = _told(name)
    return None if told is None or told.rpartition("_")[2] in _BONES else told


def by_names(names: Sequence[str]) -> dict[str, int]:
    """Our points among named ones, by place.

    Where an upper arm has a name of its own, what is called a shoulder is a collar; hands are wrists where there are
    none, legs hips beside shins and knees beside thighs, and feet ankles where there are none, as in Human3.6M.
    """
    found: dict[str, int] = {}
    for place, name in enumerate(names):
        told = _told(name)
        if told is not None:
            found.setdefault(told, place)
    _count_spine(found, names)
    for side in SIDES:
        _bones_to_points(found, side)
    return found


def _count_spine(found: dict[str, int], names: Sequence[str]) -> None:
    """Spines of animations, whose joints are counted, from a first one that may have no number; of more than three, the
    one that is as high as ours alone.
    """
    chain: dict[int, int] = {}
    for place, name in enumerate(names):
        words = _words(name.rpartition(":")[2])
        if "spine" in words and all(word == "spine" or (word.isdecimal() and len(word) < 4) for word in words):
            chain.setdefault(next((int(word) for word in words if word != "spine"), -1), place)
    places = [chain[number] for number in sorted(chain)]
    # ours are told by their numbers, whichever are there: `spine2` and `spine3` alone are no first and second
    ours = any(_told(names[place]) in _SPINE[::2] for place in places) and -1 not in chain
    if len(places) < 2 or (ours and len(places) <= len(_SPINE)):
        return
    for name in _SPINE:
        found.pop(name, None)
    if len(places) <= len(_SPINE):
        found.update(zip(_SPINE, places, strict=False))
    else:
        found["spine2"] = places[round(_HIGH * (len(places) + 1)) - 1]


def _bones_to_points(found: dict[str, int], side: str) -> None:
    """Names of bones of one side as those of the points at which they begin."""
    arm, hand, leg, toes = (found.pop(f"{side}_{bone}", None) for bone in _BONES)
    if arm is not None:
        if f"{side}_shoulder" in found:
            found.setdefault(f"{side}_collar", found[f"{side}_shoulder"])
        found[f"{side}_shoulder"] = arm
    if hand is not None:
        found.setdefault(f"{side}_wrist", hand)
    if leg is not None and f"{side}_knee" in found:
        found.setdefault(f"{side}_hip", leg)
    elif leg is not None and f"{side}_hip" in found:
        found[f"{side}_knee"] = leg
    if f"{side}_ankle" not in found and f"{side}_foot" in found:
        found[f"{side}_ankle"] = found.pop(f"{side}_foot")
    if toes is not None:
        found.setdefault(f"{side}_foot", toes)


def _told(name: str) -> str | None:
    """A point or a bone, with its side before it; None where a name is of neither."""
    bare = name.rpartition(":")[2].strip()
    plain = bare.lower().replace(" ", "_").replace("-", "_")
    if plain in KEYPOINT_NAMES:
        return plain
    if plain.replace("_", "") in _SPINE:
        return plain.replace("_", "")
    words = _words(bare)
    side = next((our for our, theirs in (("left", _LEFT), ("right", _RIGHT)) if set(words) & set(theirs)), None)
    rest = "".join(word for word in words if word not in (*_LEFT, *_RIGHT) and not word.isdigit())
    if side is None:
        central = next((our for our, theirs in _CENTRAL.items() if rest in theirs.split()), None)
        if central is not None or not rest or rest[0] not in "lr":
            return central
        side, rest = {"l": "left", "r": "right"}[rest[0]], rest[1:]
    part = next((our for our, theirs in _PARTS.items() if rest in theirs.split()), None)
    return None if part is None else f"{side}_{part}"


def _words(bare: str) -> list[str]:
    """The words of a name in small letters, without those that say nothing of a point."""
    words = [word.lower() for word in _WORD.findall(bare)]
    return [word for word in words if word not in _OF_NO_POINT] or words
