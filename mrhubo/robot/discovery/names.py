"""What names say of links and joints. Names only confirm: files call links as they like, in any language."""

from __future__ import annotations

import re
from collections.abc import Iterable

_WORDS = {
    "leg": r"leg|hip|knee|ankle|ankel|thigh|shin|calf|foot|feet|toe|crotch|crus|tibia|femur|sole|shank",
    "arm": r"arm|shoulder|elbow|wrist|hand|forearm|humer|bicep|gripper|finger|clavic|collar|(^|_)(sho|el)(_|$)",
    "hand": r"finger|thumb|gripper|jaw|claw|knuckle|index|pinky|little|middle_(?!lumb|abdo)|ring_|tip",
    "turn": r"yaw|pitch|roll|rot|twist|wrist|flex",
    "wrist": r"wrist|wrj",
    "elbow": r"elbow|(^|[^a-z])elb|(^|_)el(_|$)|ellbogen|coude|codo|hiji",
    "camera": r"cam(?!b)|eye|face|nose|imager|optical|realsense|kinect|zed|stereo|rgb|d435|xtion|vision",
    "head": r"head|neck|skull",
    "waist": r"waist|torso|spine|lumbar|trunk|lift|column|pelvis|abdomen",
    "trunk": r"torso|chest|thorax|trunk|spine|breast|upper_?body",
    "tail": r"(^|[^a-z])tail(?!l)",  # taille is a waist
    "rod": r"rod(_|$|\d)|crank|piston|cylinder|linkage|lever|pushrod|four_?bar|tendon|spring",
    "face": r"jaw|chin|mouth|lip(_|s|$)|brow|eyelid|(^|_)lid|(^|^[lr]|[^a-z])eye|cheek|tongue|antenna|(^|_)ear(_|s|$)",
    "sensor": r"lidar|laser|radar|scanner|spin|rotor|propeller",
    "sole": r"sole|(foot|ankle)_?(contact|center|base|ground)",
    "tool": r"tool|tcp|(^|_)ee(_|$)|end_?eff|tip|palm|hand|gripper|grasp",
}
_SIDES = re.compile(r"left|right")
_PATTERNS = {kind: re.compile(text, re.IGNORECASE) for kind, text in _WORDS.items()}


def speaks_of(name: str, kind: str) -> bool:
    """Whether a name has a word of a kind: leg, arm, hand (what moves in it), turn (of a whole limb), ..."""
    return _PATTERNS[kind].search(name) is not None


def share(names: Iterable[str], kind: str) -> float:
    """Share of the names that speak of a kind."""
    found = [speaks_of(name, kind) for name in names]
    return sum(found) / len(found) if found else 0.0


def side(name: str, other: str) -> int:
    """1 if the first of two names that differ in one place is the left one's, -1 if the right one's, 0 if that cannot
    be told.
    """
    name, other = name.lower(), other.lower()
    start = 0
    while start < min(len(name), len(other)) and name[start] == other[start]:
        start += 1
    ends = name[start : start + 1] + other[start : start + 1]
    return {"lr": 1, "rl": -1}.get(ends, 0)


def sides(names: Iterable[tuple[str, str]]) -> float:
    """-1..1: mean of `side` over pairs of names."""
    found = [side(name, other) for name, other in names]
    return sum(found) / len(found) if found else 0.0


def twins(name: str, other: str) -> bool:
    """Whether two names differ by `left` and `right`, or by an l and an r, alone."""
    name, other = name.lower(), other.lower()
    if name != other and all(map(_SIDES.search, (name, other))) and _SIDES.sub("", name) == _SIDES.sub("", other):
        return True
    different = [{a, b} for a, b in zip(name, other, strict=False) if a != b]
    return len(name) == len(other) and different == [{"l", "r"}]
