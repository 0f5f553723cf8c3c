"""Names of links and joints as files have them: in several habits, numbered, or by chance."""

from __future__ import annotations

import re
from collections.abc import Callable

from mrhubo.robot.generator.limbs import Chance

STYLES = ("words", "camel", "short", "numbered sides", "numbers", "noise")


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
