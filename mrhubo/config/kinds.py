"""The types and limits of a schema's fields, in words and as a list of keys."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrhubo.errors import listed, nearest

NOUNS: dict[Any, str] = {
    int: "whole number",
    float: "number",
    str: "text",
    bool: "true or false",
    Path: "path",
    Any: "any value",
}


@dataclass(frozen=True)
class Rule:
    """What a value must be beyond its type: ``Annotated[list[float], Rule("two numbers", length=2)]``."""

    noun: str = ""
    """The type in words, article included, in place of our own."""
    low: float | None = None
    """Least number, also of those in a list or mapping."""
    high: float | None = None
    """Greatest number."""
    length: int | None = None
    """Items that a list must have."""
    rising: bool = False
    """Whether each number of a list must be above the one before."""

    @property
    def metadata(self) -> dict[str, Any]:
        """As a field's metadata hold it."""
        return {"low": self.low, "high": self.high, "length": self.length, "rising": self.rising}


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
    hints = typing.get_type_hints(schema, include_extras=True)
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
    """The type in words: ``whole number``, ``list of text``, ``text or {link, offset}``."""
    kind, rule = without_rule(kind)
    if rule is not None and rule.noun:
        return rule.noun
    if dataclasses.is_dataclass(kind):
        return form(kind)
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind == int | float:
        return "number"
    if members := union_of(kind):
        nouns = list(dict.fromkeys(noun(member) for member in members))
        return ", ".join(nouns[:-1]) + f" or {nouns[-1]}"
    if origin is list:
        return f"list of {_plural(arguments[0])}"
    if origin is dict:
        return f"mapping of name to {noun(optional_kind(arguments[1])[0])}"
    if kind in NOUNS:
        return NOUNS[kind]
    raise TypeError(f"a schema cannot hold the type {kind!r}")


def form(section: Any) -> str:
    """The keys of a section in braces, for messages: ``{link, offset}``."""
    return "{" + ", ".join(field.name for field in dataclasses.fields(section)) + "}"


def expected(kind: Any, metadata: Mapping[str, Any]) -> str:
    """What a value must be, to follow the word "must be"."""
    if "choices" in metadata and kind is str:
        return _words(metadata["choices"])
    name, (base, rule) = noun(kind), without_rule(kind)
    bare = name in ("text", "true or false", "any value") or dataclasses.is_dataclass(base) or union_of(base)
    article = "" if (bare and base != int | float) or (rule is not None and rule.noun) else "a "
    limits = allowed(metadata) if base in (int, float) or base == int | float else ""
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


def unknown_key(schema: type, section: type, prefix: str, name: str, base: str = "") -> str:
    """One sentence for a key that `section` (its keys start with `prefix`) of `schema` (with `base`) does not have."""
    here = [key.field.name for key in fields_of(section)]
    leaves = [key for key in walk(schema, base) if not key.is_section]
    if nearest(name, here) is not None:
        return unknown_among(here, prefix, name)
    if any(key.name == name for key in leaves):
        section_name, _, last = name.rpartition(".")
        return f"key '{name}' has a section of its own: write {last} below {section_name}"
    near = name if any(key.field.name == name for key in leaves) else nearest(name, {k.field.name for k in leaves})
    elsewhere = sorted((key.name for key in leaves if key.field.name == near), key=lambda n: n.count("."))
    if elsewhere:
        return f"key '{prefix}{name}' does not exist; nearest: '{elsewhere[0]}'"
    return unknown_among(here, prefix, name)


def unknown_among(here: Sequence[str], prefix: str, name: str) -> str:
    """One sentence for a key that is none of those `here`; all of them start with `prefix`, which tells nothing."""
    near = nearest(name, here)
    known = f"available: {listed(prefix + other for other in here)}" if near is None else f"nearest: '{prefix}{near}'"
    return f"key '{prefix}{name}' does not exist; {known}"


def _words(choices: Sequence[str]) -> str:
    return f"one of {', '.join(choices)}" if len(choices) > 1 else choices[0]


def optional_kind(hint: Any) -> tuple[Any, bool]:
    """A type without ``| None``, and whether that was there."""
    members = union_of(hint)
    rest = tuple(member for member in members if member is not type(None))
    if not members or len(rest) == len(members):
        return hint, hint is Any
    return typing.Union[rest], True  # noqa: UP007 (the members are only known here)


def union_of(kind: Any) -> tuple[Any, ...]:
    """The members of ``A | B``; empty for any other type."""
    return typing.get_args(kind) if typing.get_origin(kind) in (typing.Union, types.UnionType) else ()


def without_rule(kind: Any) -> tuple[Any, Rule | None]:
    """A type without ``Annotated``, and the rule in that."""
    if typing.get_origin(kind) is not typing.Annotated:
        return kind, None
    base, *extras = typing.get_args(kind)
    return base, next((extra for extra in extras if isinstance(extra, Rule)), None)


def _plural(kind: Any) -> str:
    kind = optional_kind(kind)[0]
    word = noun(kind)
    counted = without_rule(kind)[0] in (int, float, Path) or kind == int | float
    return word + "s" if counted else word
