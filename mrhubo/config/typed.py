"""A tree of nodes -> a typed dataclass; everything wrong is refused, in one sentence with place and key."""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
import re
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from mrhubo.config.help import field_docs
from mrhubo.config.kinds import Key, expected, fields_of, optional_kind, union_of, unknown_key, without_rule
from mrhubo.config.tree import Node, describe, from_plain, shown
from mrhubo.config.unions import chosen
from mrhubo.errors import UserError

T = TypeVar("T")

GROUPED_INT = re.compile(r"[-+]?[1-9][0-9]{0,399}(_[0-9]{1,399})+")
SWITCH_WORDS = {"yes": True, "on": True, "no": False, "off": False}


def build(schema: type[T], root: Node) -> T:
    """The dataclass that the tree describes."""
    return _Builder(schema, root).build()


def typed_value(hint: Any, value: Any, name: str) -> Any:
    """A value that Python code gives, checked as one in a YAML file is and made what the type `hint` says.

    Raises:
        UserError: it is something else; the sentence begins with `name`.
    """
    try:
        node = from_plain(value)
    except UserError as error:
        raise UserError(f"{name}: {error}") from None
    return _Builder(None, node, name).value(hint, node, name, {})


class _Builder:
    """Recursion over the fields of a schema; collects the required keys that are missing, to name all of them."""

    def __init__(self, schema: type[Any] | None, root: Node, base: str = ""):
        self.schema, self.root, self.base = schema, root, base
        self.missing: list[Key] = []

    def build(self) -> Any:
        assert self.schema is not None
        config = self.section(self.schema, self.root, "")
        if self.missing:
            raise UserError(f"{self.root.source.name}: {_missing(self.missing)}")
        return config

    def section(self, schema: type[Any], node: Node, prefix: str) -> Any:
        """A dataclass whose place in the schema is fixed; what is missing is told at the end."""
        content = {} if node.content is None else node.content
        if not isinstance(content, dict):
            name = prefix.rstrip(".") or "a config"
            raise node.error(f"{name} must be a section of `key: value` lines, found {describe(node)}")
        keys = {key.field.name: key for key in fields_of(schema, prefix)}
        for name, child in content.items():
            if name not in keys:
                raise child.error(unknown_key(self.schema or schema, schema, prefix, name, self.base))
        values: dict[str, Any] = {}
        for name, key in keys.items():
            if name in content:
                values[name] = self.field(key, content[name])
            elif key.required and key.is_section:
                values[name] = self.section(key.kind, Node({}, node.source), f"{key.name}.")
            elif key.required:
                self.missing.append(key)
        return None if self.missing else schema(**values)

    def entry(self, sections: list[type[Any]], node: Node, name: str) -> Any:
        """A dataclass in a list, a mapping or a union: of several, the one that the keys that are there fit."""
        section = sections[0] if len(sections) == 1 else chosen(sections, node, name)
        builder = _Builder(section, node, f"{name}.")
        found = builder.section(section, node, f"{name}.")
        if builder.missing:
            raise node.error(_missing(builder.missing))
        return found

    def field(self, key: Key, node: Node) -> Any:
        if key.optional and node.content is None:
            return None
        if key.is_section:
            return self.section(key.kind, node, f"{key.name}.")
        return self.value(key.kind, node, key.name, key.field.metadata)

    def value(self, hint: Any, node: Node, name: str, metadata: Mapping[str, Any]) -> Any:
        """One value of the given type; `metadata` holds its range or choices, which are also those of its items."""
        kind, optional = optional_kind(hint)
        if optional and node.content is None:
            return None
        base, rule = without_rule(kind)
        if rule is not None:
            metadata = rule.metadata
        if node.text == "???" or node.content == "???":
            raise node.error(f"{name} has no value yet: replace '???' by {expected(kind, metadata)}")
        content, origin, arguments = node.content, typing.get_origin(base), typing.get_args(base)

        def wrong(describe: Callable[[Node], str] = describe) -> UserError:
            return node.error(f"{name} must be {expected(kind, metadata)}, found {describe(node)}")

        if base is Any:
            return _any(node, name)
        if members := union_of(base):
            return self.union(members, node, name, metadata, wrong)
        if dataclasses.is_dataclass(base) and isinstance(base, type):
            if not isinstance(content, dict):
                raise wrong()
            return self.entry([base], node, name)
        if origin is list and isinstance(content, list):
            if metadata.get("length") not in (None, len(content)):
                raise wrong(shown)
            items = [self.value(arguments[0], child, f"{name}[{i}]", metadata) for i, child in enumerate(content)]
            if metadata.get("rising") and any(b <= a for a, b in itertools.pairwise(items)):
                raise wrong(shown)
            return items
        if origin is dict and isinstance(content, dict):
            return {k: self.value(arguments[1], child, f"{name}.{k}", metadata) for k, child in content.items()}
        found = _path(node, name) if base is Path else _SCALARS[base](node) if base in _SCALARS else None
        if found is None or not _within(found, metadata):
            raise wrong()
        return found

    def union(
        self,
        members: tuple[Any, ...],
        node: Node,
        name: str,
        metadata: Mapping[str, Any],
        wrong: Callable[[], UserError],
    ) -> Any:
        """The member of the value's kind (scalar, list, mapping); of several dataclasses, the one that the keys fit."""
        bases = [(member, without_rule(member)[0]) for member in members]
        if isinstance(node.content, dict):
            sections = [base for _, base in bases if dataclasses.is_dataclass(base) and isinstance(base, type)]
            if sections and node.content:
                return self.entry(sections, node, name)
        kind = dict if isinstance(node.content, dict) else list if isinstance(node.content, list) else None
        for member, base in bases:
            if kind is not None and typing.get_origin(base) is kind:
                return self.value(member, node, name, metadata)
            if kind is None and base in _SCALARS:
                found = _SCALARS[base](node)
                if found is not None and _within(found, metadata):
                    return found
        raise wrong()


def _within(value: Any, metadata: Mapping[str, Any]) -> bool:
    if "choices" in metadata and value not in metadata["choices"]:
        return False
    low, high = metadata.get("low"), metadata.get("high")
    return (low is None or value >= low) and (high is None or value <= high)


def _any(node: Node, name: str) -> Any:
    if node.text == "???" or node.content == "???":
        raise node.error(f"{name} has no value yet: replace '???' by any value")
    if isinstance(node.content, dict):
        return {key: _any(child, f"{name}.{key}") for key, child in node.content.items()}
    if isinstance(node.content, list):
        return [_any(child, f"{name}[{i}]") for i, child in enumerate(node.content)]
    if isinstance(node.content, float) and not math.isfinite(node.content):
        raise node.error(f"{name} must be finite, found {describe(node)}")
    return node.content


def _int(node: Node) -> int | None:
    if isinstance(node.content, bool):
        return None
    if isinstance(node.content, int):
        return node.content
    if node.text is not None and GROUPED_INT.fullmatch(node.text):
        return int(node.text)
    return None


def _float(node: Node) -> float | None:
    whole = _int(node)
    try:
        value = node.content if whole is None else float(whole)
    except OverflowError:
        return None
    return value if isinstance(value, float) and math.isfinite(value) else None


def _bool(node: Node) -> bool | None:
    if isinstance(node.content, bool):
        return node.content
    return SWITCH_WORDS.get(node.text.lower()) if node.text is not None else None


def _str(node: Node) -> str | None:
    """Unquoted numbers and truth words are the text that stands there: ``13_28``, ``1.10``."""
    if node.content is None:
        return None
    if node.text is not None:
        return node.text
    return node.content if isinstance(node.content, str) else None


def _path(node: Node, name: str) -> Path | None:
    text = _str(node)
    if not text:
        return None
    if "\0" in text:
        raise node.error(f"{name} must be a path, found {describe(node)}")
    try:
        path = Path(text).expanduser()
    except RuntimeError:
        raise node.error(f"{name} names the home folder of an unknown user, {describe(node)}") from None
    return Path(os.path.abspath(node.source.folder / path))


_SCALARS: dict[Any, Callable[[Node], Any]] = {int: _int, float: _float, bool: _bool, str: _str}


def _meaning(key: Key) -> str:
    text = field_docs(key.owner).get(key.field.name, "")
    first = re.split(r"(?<=[.:;])\s", text, maxsplit=1)[0].rstrip(".:;")
    return first or expected(key.kind, key.field.metadata)


def _missing(keys: list[Key]) -> str:
    count = "a required key is" if len(keys) == 1 else f"{len(keys)} required keys are"
    return f"{count} missing: " + "; ".join(f"{key.name} ({_meaning(key)})" for key in keys)
