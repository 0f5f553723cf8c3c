"""Which of several dataclasses a mapping of a YAML file is: the one that its keys fit."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from mrhubo.config.kinds import fields_of, form, unknown_among
from mrhubo.config.tree import Node


def chosen(sections: Sequence[type[Any]], node: Node, name: str) -> type[Any]:
    """The first that has all keys of the mapping `node` and misses none, else the one that fits best.

    Raises:
        UserError: a key belongs to none of them, or two keys belong to different ones; `name` is the mapping's.
    """
    given = list(node.content)
    known = {section: [field.name for field in dataclasses.fields(section)] for section in sections}
    every = list(dict.fromkeys(key for keys in known.values() for key in keys))
    for key in given:
        if key not in every:
            raise node.content[key].error(unknown_among(every, f"{name}.", key))
    holding = [section for section in sections if set(given) <= set(known[section])]
    if not holding:
        best = max(sections, key=lambda section: len(set(given) & set(known[section])))
        other = next(key for key in given if key not in known[best])
        one = next((key for key in given if key in known[best] and key not in _companions(other, known)), given[0])
        forms = ", ".join(map(form, sections[:-1])) + f" or {form(sections[-1])}"
        raise node.content[other].error(f"{name}: '{one}' and '{other}' do not go together; give {forms}")
    return min(holding, key=lambda section: sum(_misses(section, given)))


def _misses(section: type[Any], given: list[str]) -> list[bool]:
    return [key.required and key.field.name not in given for key in fields_of(section)]


def _companions(key: str, known: dict[type[Any], list[str]]) -> set[str]:
    """Keys that some section has together with `key`."""
    return {other for keys in known.values() if key in keys for other in keys}
