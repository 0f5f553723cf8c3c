"""What the names of links and joints say about the side that they are on: a hint, for nothing keeps a file to it."""

from __future__ import annotations

import re
from collections.abc import Iterable

_WORDS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")
_SIDES = {"l": 1, "left": 1, "r": -1, "right": -1}


def named_side(names: Iterable[str]) -> int:
    """1 where more names say left than right, -1 where more say right, else 0.

    A name says it with a word of its own: ``left_arm``, ``l_arm``, ``LArm``, ``armLeft``; ``lower`` and ``rail`` do not.
    """
    votes = 0
    for name in names:
        found = {_SIDES[word.lower()] for word in _WORDS.findall(name) if word.lower() in _SIDES}
        votes += sum(found)
    return (votes > 0) - (votes < 0)
