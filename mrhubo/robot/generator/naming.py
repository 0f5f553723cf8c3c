"""Names of links and joints as files have them: in several habits, numbered, or by chance."""

from __future__ import annotations

import re
from collections.abc import Callable

from mrhubo.robot.generator.limbs import Chance

STYLES = ("words", "camel", "short", "numbered sides", "numbers", "noise")


_SIDES = {
    "french": ("gauche", "droite"),
    "german": ("links", "rechts"),
    "spanish": ("izquierdo", "derecho"),
    "japanese": ("hidari", "migi"),
}
_WORDS = {
    "french": "shoulder epaule elbow coude forearm avantbras wrist poignet hand main finger doigt thumb pouce "
    "hip hanche knee genou ankle cheville neck cou head tete waist taille twist torsion pelvis bassin "
    "wheel roue",
    "german": "shoulder schulter elbow ellbogen forearm unterarm wrist handgelenk hand hand finger finger thumb "
    "daumen hip huefte knee knie ankle knoechel neck hals head kopf waist taille twist drehung pelvis "
    "becken wheel rad",
    "spanish": "shoulder hombro elbow codo forearm antebrazo wrist muneca hand mano finger dedo thumb pulgar hip "
    "cadera knee rodilla ankle tobillo neck cuello head cabeza waist cintura twist giro pelvis pelvis "
    "wheel rueda",
    "japanese": "shoulder kata elbow hiji forearm zenwan wrist tekubi hand te finger yubi thumb oyayubi hip koshi "
    "knee hiza ankle ashikubi neck kubi head atama waist koshi twist hineri pelvis kotsuban wheel "
    "sharin",
}
"""English words and those of the language, in turn."""


def namer(chance: Chance, style: str) -> Callable[[str, str], str]:
    """How joints (`kind` joint) and links (`kind` link) are called, by their role; each role gets a name of its own."""
    taken: set[str] = set()
    numbers: dict[str, int] = {}

    def name(role: str, kind: str) -> str:
        found = _styled(chance, style, role, kind, numbers)
        while found in taken:
            found += "x"
        taken.add(found)
        return found

    return name


def _styled(chance: Chance, style: str, role: str, kind: str, numbers: dict[str, int]) -> str:
    if style.startswith("swapped "):
        role = _swapped(role)
        style = style.removeprefix("swapped ")
    if style in _SIDES:
        return f"{_translated(role, style)}_{kind}"
    side = {"left": "l", "right": "r"}.get(role.split("_")[0], "")
    rest = re.sub("^(left|right)_", "", role)
    if style == "camel":
        return (
            side.upper() + "".join(word.capitalize() for word in rest.split("_")) + ("Link" if kind == "link" else "")
        )
    if style == "short":
        return "_".join(part for part in (side, rest[:9], kind[0]) if part)
    if style == "numbered sides":
        limb = (
            "arm"
            if re.search("should|elbow|arm|wrist|clav", rest)
            else "leg"
            if re.search("hip|knee|ank", rest)
            else rest.split("_")[0]
        )
        key = f"{limb}_{side}{kind}"
        numbers[key] = numbers.get(key, 0) + 1
        return "_".join(
            part for part in (limb, {"l": "left", "r": "right"}.get(side, ""), str(numbers[key]), kind) if part
        )
    if style == "numbers":
        numbers[kind] = numbers.get(kind, 0) + 1
        return f"{kind}{numbers[kind]}"
    if style == "noise":
        return "".join(chance.either(*"abcdefghijkmnopqrstuvwxyz") for _ in range(8))
    return f"{role}_{kind}"


def _swapped(role: str) -> str:
    """With the sides as who stands before the robot sees them."""
    return re.sub("^(left|right)_", lambda found: {"left": "right_", "right": "left_"}[found[1]], role)


def _translated(role: str, language: str) -> str:
    words = _WORDS[language].split()
    known = dict(zip(words[::2], words[1::2], strict=True)) | dict(
        zip(("left", "right"), _SIDES[language], strict=True)
    )
    return "_".join(known.get(word, word) for word in role.split("_"))
