"""The types and limits of a schema's fields, in words and as a list of keys."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrhubo.errors import nearest, unknown_name

NOUNS: dict[Any, str] = {
    int: "whole number",
    float: "number",
    str: "text",
    bool: "true or false",
    Path: "path",
    Any: "any value",
}


@dataclass(frozen=True)
class Key:
    """One field of a schema, at any depth."""

    name: str
    """Full name, for instance ``trainer.lr``."""
    kind: Any
    """Its type, without ``| None``."""
    optional: bool
    """Whether null is allowed."""
    field: dataclasses.Field[Any]
    owner: type
    """The dataclass it stands in."""

    @property
    def required(self) -> bool:
        """Whether it has no default."""
        return self.field.default is dataclasses.MISSING and self.field.default_factory is dataclasses.MISSING

    @property
    def is_section(self) -> bool:
        """Whether it is a dataclass of its own."""
        return dataclasses.is_dataclass(self.kind)


def fields_of(schema: type, prefix: str = "") -> list[Key]:
    """The fields of one dataclass, in order."""
    hints = typing.get_type_hints(schema)
    found = []
    for field in dataclasses.fields(schema):
        kind, optional = optional_kind(hints[field.name])
        found.append(Key(f"{prefix}{field.name}", kind, optional, field, schema))
    return found


def walk(schema: type, prefix: str = "") -> Iterator[Key]:
    """The fields of a dataclass and of the dataclasses in it."""
    for key in fields_of(schema, prefix):
        yield key
        if key.is_section:
            yield from walk(key.kind, f"{key.name}.")


def keys_of(schema: type) -> dict[str, Any]:
    """Full name and type of every key that holds a value: `trainer.lr` -> float."""
    return {key.name: key.kind for key in walk(schema) if not key.is_section}


def requires_anything(schema: type) -> bool:
    """Whether some field has no default."""
    return any(key.required and not key.is_section for key in walk(schema))


def example(schema: type) -> str:
    """A KEY=VALUE that the schema knows, for messages."""
    numbers = [key for key in walk(schema) if key.kind in (int, float) and isinstance(key.field.default, int | float)]
    if not numbers:
        return "name=value"
    key = min(numbers, key=lambda key: key.name.count("."))
    return f"{key.name}={key.field.default}"


def noun(kind: Any) -> str:
    """The type in words: ``whole number``, ``list of text``."""
    if dataclasses.is_dataclass(kind):
        return "section"
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is list:
        return f"list of {_plural(arguments[0])}"
    if origin is dict:
        return f"mapping of name to {noun(optional_kind(arguments[1])[0])}"
    if kind in NOUNS:
        return NOUNS[kind]
    raise TypeError(f"a schema cannot hold the type {kind!r}")


def expected(kind: Any, metadata: Mapping[str, Any]) -> str:
    """What a value must be, to follow the word "must be"."""
    if "choices" in metadata and kind is str:
        return _words(metadata["choices"])
    name = noun(kind)
    article = "" if name in ("text", "true or false", "any value") else "a "
    limits = allowed(metadata) if kind in (int, float) else ""
    return article + name + (f" {limits}" if limits else "")


def allowed(metadata: Mapping[str, Any]) -> str:
    """Range or choices in words; empty where everything is allowed."""
    if "choices" in metadata:
        return _words(metadata["choices"])
    low, high = metadata.get("low"), metadata.get("high")
    if low is not None and high is not None:
        return f"from {low} to {high}"
    if low is not None:
        return f"of at least {low}"
    if high is not None:
        return f"of at most {high}"
    return ""


def unknown_key(schema: type, section: type, prefix: str, name: str) -> str:
    """One sentence for a key that `section` (its keys start with `prefix`) of `schema` does not have."""
    here = [key.field.name for key in fields_of(section)]
    leaves = [key for key in walk(schema) if not key.is_section]
    near = nearest(name, here)
    if near is not None:
        return f"key '{prefix}{name}' does not exist; nearest: '{prefix}{near}'"
    if any(key.name == name for key in leaves):
        section_name, _, last = name.rpartition(".")
        return f"key '{name}' has a section of its own: write {last} below {section_name}"
    near = name if any(key.field.name == name for key in leaves) else nearest(name, {k.field.name for k in leaves})
    elsewhere = sorted((key.name for key in leaves if key.field.name == near), key=lambda n: n.count("."))
    if elsewhere:
        return f"key '{prefix}{name}' does not exist; nearest: '{elsewhere[0]}'"
    return unknown_name("key", prefix + name, [prefix + other for other in here])


def _words(choices: Sequence[str]) -> str:
    return f"one of {', '.join(choices)}" if len(choices) > 1 else choices[0]


def optional_kind(hint: Any) -> tuple[Any, bool]:
    """A type without ``| None``, and whether that was there."""
    if typing.get_origin(hint) not in (typing.Union, types.UnionType):
        return hint, hint is Any
    members = [member for member in typing.get_args(hint) if member is not type(None)]
    if len(members) != 1:
        raise TypeError(f"a schema cannot hold the type {hint!r}")
    return members[0], True


def _plural(kind: Any) -> str:
    word = noun(optional_kind(kind)[0])
    return word if word in ("text", "true or false", "any value") or " of " in word else word + "s"
