"""YAML file + ``key.sub=value`` overrides -> a typed, checked config."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from mrhubo.config.kinds import example
from mrhubo.config.places import keep_places
from mrhubo.config.schema import Config
from mrhubo.config.tree import Node, command_line, describe, parse_typed, read_file
from mrhubo.config.typed import build
from mrhubo.errors import UserError

T = TypeVar("T")


def load_config(file: Path | str | None, overrides: Sequence[str] = (), schema: type[T] = Config) -> T:
    """Read, override, resolve ``${key}`` interpolations, check, build; raises `UserError` and nothing else.

    A relative path in the file is relative to the file, in an override to the current directory; both come out
    absolute. An override replaces what the file says under its key. `where` tells the place of every value.
    """
    root = Node({}, command_line()) if file is None else read_file(Path(file))
    for override in overrides:
        _replace(root, override, schema)
    _interpolate(root)
    config = build(schema, root)
    keep_places(config, root)
    return config


def _replace(root: Node, override: str, schema: type) -> None:
    name, equals, text = override.partition("=")
    parts = name.strip().split(".")
    if not equals or not all(parts):
        raise UserError(f"command line: '{override}' is not KEY=VALUE, for instance {example(schema)}")
    value = parse_typed(text)
    node = root
    for depth, part in enumerate(parts[:-1], start=1):
        child = node.content.get(part)
        if child is None or not isinstance(child.content, dict):
            if child is not None and _has_interpolation(child):
                raise UserError(
                    f"command line: {name} cannot be set, because {'.'.join(parts[:depth])} is an interpolation"
                    f" ({child.where})"
                )
            child = node.content[part] = Node({}, value.source)
        node = child
    node.content[parts[-1]] = value


def _interpolate(root: Node) -> None:
    """Put the values of ``${key}`` and ``${oc.env:NAME}`` in their places; the rules are OmegaConf's."""
    found = [(keys, node) for keys, node in _leaves(root, ()) if _has_interpolation(node)]
    if not found:
        return
    from omegaconf import OmegaConf

    for keys, node in found:
        with _blaming(keys, node):
            OmegaConf.create({"value": node.content})  # its syntax
    tree = OmegaConf.create(root.plain())
    results: list[Any] = []
    for keys, node in found:
        with _blaming(keys, node):
            value: Any = tree
            for key in keys:
                value = value[key]
            results.append(OmegaConf.to_container(value, resolve=True) if OmegaConf.is_config(value) else value)
    for (_, node), value in zip(found, results, strict=True):
        _fill(node, value)


def _leaves(node: Node, keys: tuple[str | int, ...]) -> Iterator[tuple[tuple[str | int, ...], Node]]:
    if isinstance(node.content, dict):
        for key, child in node.content.items():
            yield from _leaves(child, (*keys, key))
    elif isinstance(node.content, list):
        for index, child in enumerate(node.content):
            yield from _leaves(child, (*keys, index))
    else:
        yield keys, node


def _has_interpolation(node: Node) -> bool:
    return isinstance(node.content, str) and "${" in node.content


def _fill(node: Node, value: Any) -> None:
    node.text = str(value) if isinstance(value, int) and not isinstance(value, bool) else None
    if isinstance(value, dict):
        node.content = {str(key): Node(None, node.source, node.line) for key in value}
        for key, item in value.items():
            _fill(node.content[str(key)], item)
    elif isinstance(value, list):
        node.content = [Node(None, node.source, node.line) for _ in value]
        for child, item in zip(node.content, value, strict=True):
            _fill(child, item)
    else:
        node.content = value


@contextlib.contextmanager
def _blaming(keys: tuple[str | int, ...], node: Node) -> Iterator[None]:
    """Turn what OmegaConf raises into a sentence about this node."""
    from omegaconf.errors import OmegaConfBaseException

    try:
        yield
    except (OmegaConfBaseException, RecursionError, ValueError) as error:
        name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")
        reason = "it refers to itself" if isinstance(error, RecursionError) else str(error).strip().split("\n")[0]
        raise UserError(f"{node.where}: {name}, {describe(node)}, cannot be resolved: {reason}") from None
