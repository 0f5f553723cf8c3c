"""The numbers of a URDF's attributes, and what to say where they are none."""

from __future__ import annotations

import math

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.errors import shortened

MOST_METRES = 1e3
"""Longest offset: no robot is a kilometre long, and float32 would lose its joints."""
MOST_RADIANS = 1e4
_WORDS = {1: "one number", 3: "three numbers"}


def expression_in(text: str, wanted: str) -> str | None:
    """What to say of a text that only xacro can turn into what is wanted, such as ``number``; None of any other."""
    if "${" in text or "$(" in text:
        return f"is an expression, not a {wanted}: this is a xacro file; expand it, `xacro FILE > robot.urdf`"
    return None


def read_numbers(text: str, count: int, most: float = math.inf, infinite: bool = False) -> list[float] | str:
    """The numbers in a text, or what is wrong with them, to follow ``xyz="..."``.

    Args:
        text: the value of an attribute.
        count: how many there must be.
        most: the largest size of one.
        infinite: whether infinity will do.
    """
    if (expression := expression_in(text, "number")) is not None:
        return expression
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return "is no number" if count == 1 else f"must be {_WORDS[count]}"
    if len(numbers) != count:
        return f"must be {_WORDS[count]}, not {len(numbers)}"
    if any(map(math.isnan, numbers)):
        return "holds NaN" if count > 1 else "is NaN"
    if not infinite and any(map(math.isinf, numbers)):
        return "holds an infinite number" if count > 1 else "is infinite"
    if any(abs(number) > most for number in numbers if math.isfinite(number)):
        return f"is beyond {most:,.0f}"
    return numbers


def problem(
    element: etree._Element | None, attribute: str, count: int, most: float = math.inf, infinite: bool = False
) -> str | None:
    """What is wrong with an attribute, ``<axis xyz="0 0 1 0"> must be three numbers, not 4``; None if nothing is, or if
    it is not there. Arguments as for `read_numbers`.
    """
    text = None if element is None else element.get(attribute)
    if element is None or text is None:
        return None
    found = read_numbers(text, count, most, infinite)
    return shown(element, attribute, found) if isinstance(found, str) else None


def shown(element: etree._Element, attribute: str, what: str) -> str:
    """``<axis xyz="0 0 1 0"> must be three numbers``."""
    return f'<{element.tag} {attribute}="{shortened(element.get(attribute), 60)}"> {what}'
