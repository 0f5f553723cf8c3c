"""A tree of nodes -> a typed dataclass; everything wrong is refused, in one sentence with place and key."""

from __future__ import annotations

import math
import os
import re
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from mrhubo.config.help import field_docs
from mrhubo.config.kinds import Key, expected, fields_of, optional_kind, unknown_key
from mrhubo.config.tree import Node, describe
from mrhubo.errors import UserError

T = TypeVar("T")

GROUPED_INT = re.compile(r"[-+]?[1-9][0-9]{0,399}(_[0-9]{1,399})+")
SWITCH_WORDS = {"yes": True, "on": True, "no": False, "off": False}


def build(schema: type[T], root: Node) -> T:
    """The dataclass that the tree describes."""
    return _Builder(schema, root).build()


class _Builder:
    """Recursion over the fields of a schema; collects the required keys that are missing, to name all of them."""

    def __init__(self, schema: type[Any], root: Node):
        self.schema = schema
        self.root = root
        self.missing: list[Key] = []

    def build(self) -> Any:
        config = self.section(self.schema, self.root, "")
        if self.missing:
            named = "; ".join(f"{key.name} ({_meaning(key)})" for key in self.missing)
            raise UserError(f"{self.root.source.name}: {_count(self.missing)} missing: {named}")
        return config

    def section(self, schema: type[Any], node: Node, prefix: str) -> Any:
        content = {} if node.content is None else node.content
        if not isinstance(content, dict):
            name = prefix.rstrip(".") or "a config"
            raise UserError(f"{node.where}: {name} must be a section of `key: value` lines, found {describe(node)}")
        keys = {key.field.name: key for key in fields_of(schema, prefix)}
        for name, child in content.items():
            if name not in keys:
                raise UserError(f"{child.where}: {unknown_key(self.schema, schema, prefix, name)}")
        values: dict[str, Any] = {}
        for name, key in keys.items():
            if name in content:
                values[name] = self.field(key, content[name])
            elif key.required and key.is_section:
                values[name] = self.section(key.kind, Node({}, node.source), f"{key.name}.")
            elif key.required:
                self.missing.append(key)
        return None if self.missing else schema(**values)

    def field(self, key: Key, node: Node) -> Any:
        if key.optional and node.content is None:
            return None
        if key.is_section:
            return self.section(key.kind, node, f"{key.name}.")
        return convert(key.kind, node, key.name, key.field.metadata)


def convert(kind: Any, node: Node, name: str, metadata: Mapping[str, Any]) -> Any:
    """One value of the given type; `metadata` holds its range or choices."""
    if node.text == "???" or node.content == "???":
        raise UserError(f"{node.where}: {name} has no value yet: replace '???' by {expected(kind, metadata)}")
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any:
        return _any(node, name)
    if origin is list and isinstance(node.content, list):
        return [_element(arguments[0], child, f"{name}[{i}]", metadata) for i, child in enumerate(node.content)]
    if origin is dict and isinstance(node.content, dict):
        return {k: _element(arguments[1], child, f"{name}.{k}", metadata) for k, child in node.content.items()}
    value = _path(node, name) if kind is Path else _SCALARS[kind](node) if kind in _SCALARS else None
    if value is None or not _within(value, metadata):
        raise UserError(f"{node.where}: {name} must be {expected(kind, metadata)}, found {describe(node)}")
    return value


def _element(hint: Any, node: Node, name: str, metadata: Mapping[str, Any]) -> Any:
    kind, optional = optional_kind(hint)
    return None if optional and node.content is None else convert(kind, node, name, metadata)


def _within(value: Any, metadata: Mapping[str, Any]) -> bool:
    if "choices" in metadata and value not in metadata["choices"]:
        return False
    low, high = metadata.get("low"), metadata.get("high")
    return (low is None or value >= low) and (high is None or value <= high)


def _any(node: Node, name: str) -> Any:
    if isinstance(node.content, dict):
        return {key: convert(Any, child, f"{name}.{key}", {}) for key, child in node.content.items()}
    if isinstance(node.content, list):
        return [convert(Any, child, f"{name}[{i}]", {}) for i, child in enumerate(node.content)]
    if isinstance(node.content, float) and not math.isfinite(node.content):
        raise UserError(f"{node.where}: {name} must be finite, found {describe(node)}")
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
        raise UserError(f"{node.where}: {name} must be a path, found {describe(node)}")
    try:
        path = Path(text).expanduser()
    except RuntimeError:
        raise UserError(f"{node.where}: {name} names the home folder of an unknown user, {describe(node)}") from None
    return Path(os.path.abspath(node.source.folder / path))


_SCALARS: dict[Any, Callable[[Node], Any]] = {int: _int, float: _float, bool: _bool, str: _str}


def _meaning(key: Key) -> str:
    text = field_docs(key.owner).get(key.field.name, "")
    first = re.split(r"(?<=[.:;])\s", text, maxsplit=1)[0].rstrip(".:;")
    return first or expected(key.kind, key.field.metadata)


def _count(missing: list[Key]) -> str:
    return "a required key is" if len(missing) == 1 else f"{len(missing)} required keys are"
